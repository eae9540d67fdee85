#include "platform/vehicle/rig_tables.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::vehicle {
namespace {

/// Of the place of a sensor: may be missing. They are the last six keys of both tables.
constexpr std::size_t kPlaceKeys = 6;

template <class Spec>
Spec read_sensor(const input::TomlReader& reader, const toml::table& table, const char* name) {
  Spec spec;
  const auto keys = keys_of(spec);
  std::set<std::string_view> known;
  for (const SensorKey<Spec>& key : keys) known.insert(key.key);
  reader.allow_keys(table, name, known);
  for (const SensorKey<Spec>& key : keys) {
    const bool of_place = &key >= &keys[keys.size() - kPlaceKeys];
    if (of_place && table.get(key.key) == nullptr) continue;
    const toml::node& node = reader.need(table, key.key, name);
    const double value = reader.number(node, key.key, key.low, key.high);
    if (!assign(key, spec, value) ||
        (std::string_view(key.text).ends_with("whole number") && value != std::floor(value)))
      reader.refuse(node, key.key, fmt::format("must be a whole number from {} to {}", key.low, key.high));
  }
  return spec;
}

template <class Spec, std::size_t N>
void read_sensors(const input::TomlReader& reader, const toml::table& root, const char* name,
                  core::StaticVector<Spec, N>& sensors) {
  const toml::node* list = root.get(name);
  if (list == nullptr) return;
  if (list->as_array() == nullptr) reader.refuse(*list, name, fmt::format("must be written as [[{}]]", name));
  for (const toml::node& node : *list->as_array()) {
    if (node.as_table() == nullptr) reader.refuse(node, name, fmt::format("must be written as [[{}]]", name));
    const std::string where = fmt::format("[[{}]]", name);
    if (!sensors.push_back(read_sensor<Spec>(reader, *node.as_table(), where.c_str())))
      reader.refuse(node, name, fmt::format("must be at most {}", N));
  }
}

}  // namespace

std::optional<SensorRig> read_rig(const input::TomlReader& reader, const toml::table& root) {
  if (root.get("camera") == nullptr && root.get("lidar") == nullptr) return std::nullopt;
  SensorRig rig;
  read_sensors(reader, root, "camera", rig.cameras);
  read_sensors(reader, root, "lidar", rig.lidars);
  if (const auto fault = first_fault(rig))
    reader.refuse(root, fault->key, fmt::format("{} {}: {}", fault->sensor, fault->index + 1, fault->text));
  return rig;
}

}  // namespace roborun::vehicle
