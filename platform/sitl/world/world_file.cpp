#include "platform/sitl/world/world_file.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <string_view>
#include <vector>

#include "platform/input/input_error.hpp"
#include "platform/input/toml_reader.hpp"
#include "platform/sitl/world/body_reader.hpp"
#include "platform/sitl/world/octomap_file.hpp"

namespace roborun::sitl {
namespace {

constexpr std::size_t kMaxFile_bytes = 64U << 20U;
constexpr std::size_t kMaxObjects = 100000;
constexpr double kVehicleRadius_m = 0.6;
constexpr double kPillarTop_m = 20.0;
constexpr std::array<WorldKey, 10> kKeys{
    {{"world",
      "bounds",
      "[[x, y, z], [x, y, z]], m",
      {},
      "lowest and highest corner: the vehicle's centre stays inside"},
     {"world", "start", "[x, y, z], m", {}, "top of the climb, free all around; --start says another"},
     {"world", "goal", "[x, y, z], m", {}, "where the mission ends, hovering; --goal says another"},
     {"pillar", "x", "m", {}, "of the axis of an upright cylinder"},
     {"pillar", "y", "m", {}, ""},
     {"pillar", "radius", "m, above 0", {}, ""},
     {"pillar", "bottom", "m", 0.0, "height at which it begins"},
     {"pillar", "top", "m, above bottom", kPillarTop_m, "height at which it ends"},
     {"box", "min", "[x, y, z], m", {}, "lowest corner of a box along the axes"},
     {"box", "max", "[x, y, z], m, above min", {}, "highest corner"}}};

std::vector<unsigned char> read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw InputError(fmt::format("{}: cannot be opened: must be a readable .toml, .bt or .ot file", path));
  std::vector<unsigned char> bytes;
  std::array<char, 1U << 16U> block{};
  while (file.read(block.data(), block.size()) || file.gcount() > 0) {
    bytes.insert(bytes.end(), block.begin(), block.begin() + file.gcount());
    if (bytes.size() > kMaxFile_bytes) throw InputError(fmt::format("{}: larger than 64 MiB", path));
  }
  if (file.bad())
    throw InputError(fmt::format("{}: cannot be read: must be a readable .toml, .bt or .ot file", path));
  return bytes;
}

void read_pillars(const input::TomlReader& reader, const toml::table& root, WorldDescription& world) {
  const toml::node* list = root.get("pillar");
  if (list == nullptr) return;
  if (list->as_array() == nullptr) reader.refuse(*list, "pillar", "must be written as [[pillar]]");
  for (const toml::node& node : *list->as_array()) {
    const toml::table* table = node.as_table();
    if (table == nullptr) reader.refuse(node, "pillar", "must be written as [[pillar]]");
    reader.allow_keys(*table, "[[pillar]]", keys_of(kKeys, "pillar"));
    Pillar pillar;
    pillar.x_m = reader.number(reader.need(*table, "x", "[[pillar]]"), "x");
    pillar.y_m = reader.number(reader.need(*table, "y", "[[pillar]]"), "y");
    pillar.radius_m = reader.number(reader.need(*table, "radius", "[[pillar]]"), "radius");
    pillar.bottom_m = reader.number_or(*table, "bottom", 0.0);
    pillar.top_m = reader.number_or(*table, "top", kPillarTop_m);
    if (!(pillar.radius_m > 0.0)) reader.refuse(*table, "radius", "must be above 0");
    if (!(pillar.top_m > pillar.bottom_m)) reader.refuse(*table, "top", "must be above bottom");
    world.pillars.push_back(pillar);
    if (world.pillars.size() > kMaxObjects) reader.refuse(*table, "pillar", "more than 100000 pillars");
  }
}

void read_boxes(const input::TomlReader& reader, const toml::table& root, WorldDescription& world) {
  const toml::node* list = root.get("box");
  if (list == nullptr) return;
  if (list->as_array() == nullptr) reader.refuse(*list, "box", "must be written as [[box]]");
  for (const toml::node& node : *list->as_array()) {
    const toml::table* table = node.as_table();
    if (table == nullptr) reader.refuse(node, "box", "must be written as [[box]]");
    reader.allow_keys(*table, "[[box]]", keys_of(kKeys, "box"));
    const Aabb box{reader.point(reader.need(*table, "min", "[[box]]"), "min"),
                   reader.point(reader.need(*table, "max", "[[box]]"), "max")};
    if (!(box.size().minCoeff() > 0.0)) reader.refuse(*table, "max", "must be above min on every axis");
    world.boxes.push_back(box);
    if (world.boxes.size() > kMaxObjects) reader.refuse(*table, "box", "more than 100000 boxes");
  }
}

WorldDescription read_toml(const std::string& path, const std::vector<unsigned char>& bytes,
                           const Endpoints& endpoints) {
  const toml::table root =
      input::parse_toml(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const input::TomlReader reader(path);
  reader.allow_keys(root, "the file", {"world", "pillar", "box", "body"});
  const toml::table* table = reader.need(root, "world", "the file").as_table();
  if (table == nullptr) reader.refuse(root, "world", "must be a table: [world]");
  reader.allow_keys(*table, "[world]", keys_of(kKeys, "world"));

  WorldDescription world;
  const toml::node& bounds = reader.need(*table, "bounds", "[world]");
  if (bounds.as_array() == nullptr || bounds.as_array()->size() != 2)
    reader.refuse(bounds, "bounds", "must be [[x, y, z], [x, y, z]] in metres");
  world.bounds_W = {reader.point((*bounds.as_array())[0], "bounds"),
                    reader.point((*bounds.as_array())[1], "bounds")};
  world.start_W =
      endpoints.start_W ? *endpoints.start_W : reader.point(reader.need(*table, "start", "[world]"), "start");
  world.goal_W =
      endpoints.goal_W ? *endpoints.goal_W : reader.point(reader.need(*table, "goal", "[world]"), "goal");
  read_pillars(reader, root, world);
  read_boxes(reader, root, world);
  world.bodies = read_bodies(reader, root);
  return world;
}

/// The point with the most room around it near one end of the longer side, at middle height.
Vector3 roomiest(const VoxelGrid& voxels, const Aabb& bounds_W, bool at_low_end) {
  const int axis = bounds_W.size().x() >= bounds_W.size().y() ? 0 : 1;
  Vector3 best_W = bounds_W.center();
  double best_m = -1.0;
  for (int i = 0; i <= 10; ++i) {
    for (int k = 1; k <= 19; ++k) {
      Vector3 p_W = bounds_W.center();
      const double along = 0.02 + 0.02 * i;
      p_W[axis] = bounds_W.min_W[axis] + (at_low_end ? along : 1.0 - along) * bounds_W.size()[axis];
      p_W[1 - axis] = bounds_W.min_W[1 - axis] + 0.05 * k * bounds_W.size()[1 - axis];
      const double room_m = voxels.clearance_m(p_W, 3.0);
      if (room_m > best_m + 1e-9) {
        best_m = room_m;
        best_W = p_W;
      }
    }
  }
  return best_W;
}

WorldDescription read_octomap(const std::string& path, const std::vector<unsigned char>& bytes, bool full,
                              const Endpoints& endpoints) {
  WorldDescription world;
  world.voxels = parse_octomap(bytes, full, path);
  world.bounds_W = world.voxels.bounds_W();
  // The simulator's ground is z = 0: maps that reach below it keep their voxels there, but nobody flies
  // there.
  world.bounds_W.min_W.z() = std::max(world.bounds_W.min_W.z(), 0.0) + 0.5;
  if (!(world.bounds_W.size().minCoeff() > 1.0))
    throw InputError(fmt::format("{}: less than 1 m of space to fly in above z = 0.5 m", path));
  world.start_W = endpoints.start_W ? *endpoints.start_W : roomiest(world.voxels, world.bounds_W, true);
  world.goal_W = endpoints.goal_W ? *endpoints.goal_W : roomiest(world.voxels, world.bounds_W, false);
  return world;
}

}  // namespace

std::vector<WorldKey> world_keys() {
  std::vector<WorldKey> keys(kKeys.begin(), kKeys.end());
  const std::span<const WorldKey> bodies = body_keys();
  keys.insert(keys.end(), bodies.begin(), bodies.end());
  return keys;
}

OctomapLeaves load_octomap(const std::string& path) {
  const bool full = is_full_octomap(path);
  return read_octomap(read_file(path), full, path);
}

World load_world(const std::string& path, const Endpoints& endpoints) {
  const auto ends_with = [&path](std::string_view end) {
    return path.size() >= end.size() && std::string_view(path).substr(path.size() - end.size()) == end;
  };
  const bool toml = ends_with(".toml");
  const bool bt = ends_with(".bt");
  const bool ot = ends_with(".ot");
  if (!toml && !bt && !ot)
    throw InputError(fmt::format("{}: unknown kind of world file: must end in .toml, .bt or .ot", path));
  const std::vector<unsigned char> bytes = read_file(path);
  World world(toml ? read_toml(path, bytes, endpoints) : read_octomap(path, bytes, ot, endpoints));
  for (const auto& [name, p_W] : {std::pair{"start", world.start_W()}, std::pair{"goal", world.goal_W()}}) {
    if (world.clearance_m(p_W, kVehicleRadius_m) < kVehicleRadius_m) {
      throw InputError(
          fmt::format("{}: {} ({:.2f}, {:.2f}, {:.2f}) is closer than {} m to an obstacle: must be free",
                      path, name, p_W.x(), p_W.y(), p_W.z(), kVehicleRadius_m));
    }
  }
  return world;
}

}  // namespace roborun::sitl
