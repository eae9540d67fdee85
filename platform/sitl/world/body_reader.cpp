#include "platform/sitl/world/body_reader.hpp"

#include <array>

namespace roborun::sitl {
namespace {

constexpr std::size_t kMost = 1000;
constexpr std::array<WorldKey, 5> kBodyKeys{
    {{"body", "radius", "m, above 0, at most 100", {}, "of a sphere, or of an upright cylinder"},
     {"body", "height", "m, 0 .. 1000", 0.0, "of the cylinder; 0: a sphere"},
     {"body", "speed", "m/s, 0 .. 50", 0.0, "constant, along its path"},
     {"body", "at_s", "s, 0 .. 7200", 0.0, "until then it waits at its first point"},
     {"body",
      "path",
      "[[x, y, z], ...], m",
      {},
      "of its centre, one to 1000 points; it stays at the last one"}}};

double number_within(const input::TomlReader& reader, const toml::table& table, const char* key,
                     double fallback, double high) {
  const double value = reader.number_or(table, key, fallback);
  if (!(value >= 0.0 && value <= high))
    reader.refuse(*table.get(key), key, fmt::format("must be a number from 0 to {}", high));
  return value;
}

}  // namespace

std::span<const WorldKey> body_keys() noexcept { return kBodyKeys; }

std::vector<Body> read_bodies(const input::TomlReader& reader, const toml::table& root) {
  std::vector<Body> bodies;
  const toml::node* list = root.get("body");
  if (list == nullptr) return bodies;
  if (list->as_array() == nullptr) reader.refuse(*list, "body", "must be written as [[body]]");
  for (const toml::node& node : *list->as_array()) {
    const toml::table* table = node.as_table();
    if (table == nullptr) reader.refuse(node, "body", "must be written as [[body]]");
    reader.allow_keys(*table, "[[body]]", keys_of(kBodyKeys, "body"));
    Body body;
    const toml::node& radius = reader.need(*table, "radius", "[[body]]");
    body.radius_m = number_within(reader, *table, "radius", 0.0, 100.0);
    if (!(body.radius_m > 0.0)) reader.refuse(radius, "radius", "must be above 0");
    body.height_m = number_within(reader, *table, "height", 0.0, 1000.0);
    body.speed_mps = number_within(reader, *table, "speed", 0.0, 50.0);
    body.start_s = number_within(reader, *table, "at_s", 0.0, 7200.0);
    const toml::node& path = reader.need(*table, "path", "[[body]]");
    if (path.as_array() == nullptr || path.as_array()->empty() || path.as_array()->size() > kMost)
      reader.refuse(path, "path", "must be one to 1000 points: [[x, y, z], ...]");
    for (const toml::node& point : *path.as_array()) body.path_W.push_back(reader.point(point, "path"));
    if (bodies.size() == kMost) reader.refuse(node, "body", "more than 1000 bodies");
    bodies.push_back(std::move(body));
  }
  return bodies;
}

}  // namespace roborun::sitl
