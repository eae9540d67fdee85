#include "platform/vehicle/vehicle_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "core/record/state_hash.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/input/toml_reader.hpp"
#include "platform/vehicle/rig_tables.hpp"
#include "platform/vehicle/shipped_vehicles.hpp"

namespace roborun::vehicle {
namespace {

constexpr std::array<const char*, 3> kStoppingKeys{"quadratic_s2pm", "linear_s", "constant_m"};

std::set<std::string_view> tables() {
  std::set<std::string_view> names{"vehicle", "stopping", "camera", "lidar"};
  for (const VehicleKey& key : kVehicleKeys) names.insert(key.table);
  return names;
}

class VehicleReader {
 public:
  VehicleReader(const std::string& path, const std::string& text)
      : reader_(path), path_(path), root_(input::parse_toml(path, text)) {}

  Vehicle read() const {
    reader_.allow_keys(root_, "a vehicle file", tables());
    Vehicle vehicle;
    read_head(vehicle);
    read_model(vehicle.model);
    vehicle.model.measured_stopping = measured_stopping();
    vehicle.rig = read_rig(reader_, root_);
    return vehicle;
  }

 private:
  const toml::table& table(const char* name) const {
    const toml::node& node = reader_.need(root_, name, "a vehicle file");
    if (node.as_table() == nullptr) reader_.refuse(node, name, fmt::format("must be a table: [{}]", name));
    return *node.as_table();
  }
  void read_head(Vehicle& vehicle) const {
    const toml::table& head = table("vehicle");
    reader_.allow_keys(head, "[vehicle]", {"name", "about"});
    for (const auto& [key, to] : {std::pair("name", &vehicle.name), std::pair("about", &vehicle.about)}) {
      const toml::node& node = reader_.need(head, key, "[vehicle]");
      const auto value = node.value<std::string>();
      if (!value || value->empty() || value->find('\n') != std::string::npos)
        reader_.refuse(node, key, "must be one line of text");
      *to = *value;
    }
  }
  void read_model(VehicleModel& model) const {
    for (const VehicleKey& key : kVehicleKeys) {
      const toml::table& from = table(key.table);
      const toml::node& node = reader_.need(from, key.key, fmt::format("[{}]", key.table));
      model.*key.value = reader_.number(node, key.key, key.low, key.high);
    }
    for (const char* name : {"body", "propulsion", "drag", "power", "limits"}) {
      std::set<std::string_view> known;
      for (const VehicleKey& key : kVehicleKeys) {
        if (std::string_view(key.table) == name) known.insert(key.key);
      }
      reader_.allow_keys(table(name), fmt::format("[{}]", name), known);
    }
  }
  std::optional<StoppingModel> measured_stopping() const {
    if (root_.get("stopping") == nullptr) return std::nullopt;
    const toml::table& from = table("stopping");
    reader_.allow_keys(from, "[stopping]", {kStoppingKeys.begin(), kStoppingKeys.end()});
    const auto number = [&](const char* key, double low, double high) {
      return reader_.number(reader_.need(from, key, "[stopping]"), key, low, high);
    };
    return StoppingModel{number("quadratic_s2pm", 0.0, 10.0), number("linear_s", 0.0, 10.0),
                         number("constant_m", -10.0, 10.0)};
  }

  input::TomlReader reader_;
  std::string path_;
  toml::table root_;
};

}  // namespace

Vehicle vehicle_from_toml(const std::string& path, const std::string& text) {
  Vehicle vehicle = VehicleReader(path, text).read();
  core::StateHash hash;
  for (const char c : text) hash.add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  vehicle.digest = fmt::format("{:016x}", hash.value());
  const double visible_m = vehicle.rig ? shortest_range_m(*vehicle.rig) : 25.0;
  if (vehicle.rig && !looks_forward(*vehicle.rig))
    throw InputError(fmt::format(
        "{}: yaw_deg: nothing looks within 45 degrees of forward: it must see where it flies", path));
  if (const char* why = cannot_fly(vehicle.model, visible_m))
    throw InputError(fmt::format("{}: {}", path, why));
  return vehicle;
}

std::vector<std::string> shipped_vehicles() {
  std::vector<std::string> names;
  for (const ShippedVehicle& v : kShippedVehicles) names.emplace_back(v.name);
  return names;
}

Vehicle load_vehicle(const std::string& name_or_path) {
  for (const ShippedVehicle& v : kShippedVehicles) {
    if (name_or_path == v.name) return vehicle_from_toml(v.name, v.text);
  }
  return vehicle_from_toml(name_or_path,
                           input::read_text(name_or_path, fmt::format("a vehicle file, or one of {}",
                                                                      fmt::join(shipped_vehicles(), ", "))));
}

std::vector<input::KeyText> vehicle_keys() {
  std::vector<input::KeyText> keys;
  const VehicleModel defaults;
  for (const VehicleKey& key : kVehicleKeys)
    keys.push_back({key.table, key.key, key.low, key.high, defaults.*key.value, key.text});
  return keys;
}

}  // namespace roborun::vehicle
