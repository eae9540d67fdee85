#include "platform/sitl/world/world_file.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/input/toml_reader.hpp"
#include "platform/sitl/world/body_reader.hpp"
#include "platform/sitl/world/cloud_file.hpp"
#include "platform/sitl/world/file_bytes.hpp"
#include "platform/sitl/world/mesh_file.hpp"
#include "platform/sitl/world/octomap_file.hpp"
#include "platform/sitl/world/sdf_file.hpp"

namespace roborun::sitl {
namespace {

constexpr std::size_t kMaxFile_bytes = 64U << 20U;
constexpr std::size_t kMaxCloud_bytes = 1U << 30U;
constexpr std::size_t kMaxObjects = 100000;
constexpr double kMaxVoxels = 4e9;     // bits: 512 MB
constexpr double kFarthest_m = 20e3;   // from the origin; what is farther is counted from its lowest corner
constexpr double kOverGround_m = 0.5;  // from there on is where a vehicle may be
constexpr double kSide_m = 5.0;        // beside a start or goal outside of what is in the file
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

enum class Kind : std::uint8_t { kToml, kBt, kOt, kSdf, kPcd, kPly, kLas, kMesh };

/// Ends of names, what they hold, and how such a file begins; empty: in no special way.
struct KnownKind {
  std::string_view end;
  Kind kind;
  std::string_view format;
  std::string_view magic;
};
constexpr std::array kKnown{KnownKind{".toml", Kind::kToml, "TOML", ""},
                            KnownKind{".bt", Kind::kBt, "an OctoMap (.bt)", "# Octomap OcTree binary file"},
                            KnownKind{".ot", Kind::kOt, "an OctoMap (.ot)", "# Octomap OcTree file"},
                            KnownKind{".world", Kind::kSdf, "SDF", "<?xml"},
                            KnownKind{".sdf", Kind::kSdf, "SDF", "<sdf"},
                            KnownKind{".pcd", Kind::kPcd, "PCD", "# .PCD"},
                            KnownKind{".ply", Kind::kPly, "PLY", "ply"},
                            KnownKind{".las", Kind::kLas, "LAS", "LASF"},
                            KnownKind{".stl", Kind::kMesh, "a mesh", ""},
                            KnownKind{".obj", Kind::kMesh, "a mesh", ""},
                            KnownKind{".dae", Kind::kMesh, "a mesh", ""}};
constexpr const char* kWanted =
    "a readable .toml, .bt, .ot, .world, .sdf, .pcd, .ply, .las, .stl, .obj or .dae file";

Kind kind_of(const std::string& path) {
  for (const KnownKind& known : kKnown)
    if (path.ends_with(known.end)) return known.kind;
  refuse(path,
         "unknown kind of world file: must end in .toml, .bt or .ot, .world, .sdf, .pcd, .ply, .las, .stl, "
         ".obj or .dae");
}

/// A file of another format under this name is refused.
void check_content(const std::string& path, Kind kind, const std::vector<unsigned char>& bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (kind == Kind::kMesh && path.ends_with(".dae")) kind = Kind::kSdf;  // XML, too: its root says which
  for (const KnownKind& known : kKnown) {
    if (known.kind == kind || known.magic.empty() || !text.starts_with(known.magic)) continue;
    refuse(path, fmt::format("holds {}, not {}: must have the name of what it is, {}", known.format,
                             path.substr(path.rfind('.')), known.end));
  }
  if (kind == Kind::kLas && !text.starts_with("LASF")) refuse(path, "not a LAS file: must begin with LASF");
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
                           const WorldOptions& options) {
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
  if (!options.start_W) world.start_W = reader.point(reader.need(*table, "start", "[world]"), "start");
  if (!options.goal_W) world.goal_W = reader.point(reader.need(*table, "goal", "[world]"), "goal");
  read_pillars(reader, root, world);
  read_boxes(reader, root, world);
  world.bodies = read_bodies(reader, root);
  return world;
}

/// The point with the most room around it near one end of the longer side, at middle height.
Vector3 roomiest(const World& world, bool at_low_end) {
  const Aabb& bounds_W = world.bounds_W();
  const int axis = bounds_W.size().x() >= bounds_W.size().y() ? 0 : 1;
  Vector3 best_W = bounds_W.center();
  double best_m = -1.0;
  for (int i = 0; i <= 10; ++i) {
    for (int k = 1; k <= 19; ++k) {
      Vector3 p_W = bounds_W.center();
      const double along = 0.02 + 0.02 * i;
      p_W[axis] = bounds_W.min_W[axis] + (at_low_end ? along : 1.0 - along) * bounds_W.size()[axis];
      p_W[1 - axis] = bounds_W.min_W[1 - axis] + 0.05 * k * bounds_W.size()[1 - axis];
      const double room_m = world.clearance_m(p_W, 3.0);
      if (room_m > best_m + 1e-9) {
        best_m = room_m;
        best_W = p_W;
      }
    }
  }
  return best_W;
}

WorldDescription read_octomap(const std::string& path, const std::vector<unsigned char>& bytes, bool full,
                              double scale) {
  WorldDescription world;
  world.voxels = parse_octomap(bytes, full, path);
  world.voxels.scale(scale);
  world.bounds_W = world.voxels.bounds_W();
  // Below what the map knows is ground; a map that begins above z = 0 stands on z = 0.
  world.ground_m = std::min(world.bounds_W.min_W.z(), 0.0);
  world.bounds_W.min_W.z() += kOverGround_m;
  return world;
}

/// Occupied cells of all points near the bounds.
VoxelGrid voxels_of(const std::string& path, const std::vector<Vector3>& points,
                    const WorldOptions& options) {
  const double cell_m = options.cell_m.value_or(kCloudCell_m);
  if (!(cell_m >= 0.01 && cell_m <= 10.0))
    throw InputError(fmt::format("--cell: {} must be from 0.01 to 10 m", cell_m));
  if (points.empty()) refuse(path, "no finite point: must hold points that are not nan");
  Aabb near_W{Vector3::Constant(-kInfinity), Vector3::Constant(kInfinity)};
  if (options.bounds_W)
    near_W = {options.bounds_W->min_W - Vector3::Constant(kSide_m),
              options.bounds_W->max_W + Vector3::Constant(kSide_m)};
  Aabb box{Vector3::Constant(kInfinity), Vector3::Constant(-kInfinity)};
  for (const Vector3& p : points) {
    if (!near_W.contains(p)) continue;
    box = {box.min_W.cwiseMin(p), box.max_W.cwiseMax(p)};
  }
  if (!(box.size().minCoeff() >= 0.0)) refuse(path, "--bounds: no point of the cloud is inside");
  const Vector3 min_W = cell_m * (box.min_W / cell_m).array().floor().matrix();
  std::array<std::int64_t, 3> count{};
  double cells = 1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double side = std::floor((box.max_W[axis] - min_W[axis]) / cell_m) + 1.0;
    cells *= side;
    if (!(cells <= kMaxVoxels))
      refuse(path,
             fmt::format("{:.3g} cells or more of {} m around all points: must be at most {:.0e}: larger "
                         "--cell, or --bounds",
                         cells, cell_m, kMaxVoxels));
    count[i] = static_cast<std::int64_t>(side);
  }
  VoxelGrid grid(min_W, cell_m, count);
  for (const Vector3& p : points) {
    if (!near_W.contains(p)) continue;
    std::array<std::int64_t, 3> cell{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      cell[i] = static_cast<std::int64_t>(std::floor((p[axis] - min_W[axis]) / cell_m));
    }
    grid.fill(cell, 1);
  }
  return grid;
}

void check_closed(const std::string& path, std::size_t open, const WorldOptions& options) {
  if (open > 0 && !options.surfaces)
    refuse(path,
           fmt::format("the mesh is not closed ({} open edges): must be closed, or taken as mere surfaces: "
                       "--surfaces",
                       open));
}

WorldDescription with_triangles(const std::string& path, WorldDescription world,
                                std::vector<Triangle> triangles) {
  for (const Triangle& t : triangles)
    for (const Vector3& p : t)
      if (!(p.cwiseAbs().maxCoeff() <= kFarthest_m))
        refuse(path, "a corner of a mesh is farther than 20 km from the origin: smaller --scale");
  world.mesh = TriangleMesh(std::move(triangles));
  return world;
}

/// Where a vehicle may be in a world whose file does not say so: from above the ground to the highest surface, and so far
/// aside that given ends are inside.
Aabb bounds_around(const Aabb& all_W, double ground_m, const WorldOptions& options) {
  Aabb bounds = all_W;
  bounds.min_W.z() = std::max(all_W.min_W.z(), ground_m) + kOverGround_m;
  for (const auto& end : {options.start_W, options.goal_W}) {
    if (!end) continue;
    for (int axis = 0; axis < 2; ++axis) {
      if ((*end)[axis] < bounds.min_W[axis]) bounds.min_W[axis] = (*end)[axis] - kSide_m;
      if ((*end)[axis] > bounds.max_W[axis]) bounds.max_W[axis] = (*end)[axis] + kSide_m;
    }
    bounds.max_W.z() = std::max(bounds.max_W.z(), end->z() + kOverGround_m);
  }
  return bounds;
}

Aabb extent_of_all(const WorldDescription& shapes, const std::vector<Aabb>& planes_W) {
  Aabb all = extent_W(shapes);
  for (const Aabb& plane : planes_W) all = {all.min_W.cwiseMin(plane.min_W), all.max_W.cwiseMax(plane.max_W)};
  return all;
}

WorldDescription read_sdf(const std::string& path, const std::vector<unsigned char>& bytes,
                          const WorldOptions& options) {
  SdfWorld sdf = parse_sdf(bytes, path, options.scale);
  check_closed(sdf.open_mesh, sdf.open_edges, options);
  WorldDescription world = with_triangles(path, std::move(sdf.shapes), std::move(sdf.triangles));
  const Aabb all_W = extent_of_all(world, sdf.planes_W);
  if (!(all_W.size().minCoeff() >= 0.0)) refuse(path, "no model in it can be collided with: must have one");
  world.bounds_W = bounds_around(all_W, world.ground_m, options);
  return world;
}

WorldDescription read_geometry(const std::string& path, Geometry geometry, const WorldOptions& options) {
  WorldDescription world;
  world.ground_m = -kInfinity;
  const auto each_point = [&](auto&& what) {
    for (Vector3& p : geometry.points) what(p);
    for (Triangle& t : geometry.triangles)
      for (Vector3& p : t) what(p);
  };
  Vector3 lowest = Vector3::Constant(kInfinity);
  bool far = false;
  each_point([&](Vector3& p) {
    p *= options.scale;
    lowest = lowest.cwiseMin(p);
    far = far || p.cwiseAbs().maxCoeff() > kFarthest_m;
  });
  if (far) each_point([&](Vector3& p) { p -= lowest; });
  Aabb all_W;
  if (geometry.triangles.empty()) {
    world.voxels = voxels_of(path, geometry.points, options);
    all_W = world.voxels.bounds_W();
  } else {
    check_closed(path, open_edges(geometry.triangles), options);
    world = with_triangles(path, std::move(world), std::move(geometry.triangles));
    if (world.mesh.empty()) refuse(path, "no triangle has an area");
    all_W = world.mesh.bounds_W();
  }
  world.bounds_W = bounds_around(all_W, -kInfinity, options);
  return world;
}

WorldDescription read_world(const std::string& path, Kind kind, const std::vector<unsigned char>& bytes,
                            const WorldOptions& options) {
  switch (kind) {
    case Kind::kToml:
      return read_toml(path, bytes, options);
    case Kind::kBt:
    case Kind::kOt:
      return read_octomap(path, bytes, kind == Kind::kOt, options.scale);
    case Kind::kSdf:
      return read_sdf(path, bytes, options);
    case Kind::kPcd:
      return read_geometry(path, parse_pcd(bytes, path), options);
    case Kind::kPly:
      return read_geometry(path, parse_ply(bytes, path), options);
    case Kind::kLas:
      return read_geometry(path, parse_las(bytes, path), options);
    default:
      return read_geometry(path, {{}, parse_mesh(bytes, path)}, options);
  }
}

void check_options(const std::string& path, Kind kind, const WorldOptions& options) {
  const bool cloud = kind == Kind::kPcd || kind == Kind::kPly || kind == Kind::kLas;
  if (options.cell_m && !cloud) refuse(path, "--cell goes with point clouds: .pcd, .ply, .las");
  if (kind == Kind::kToml && options.scale != 1.0) refuse(path, "--scale does not go with .toml");
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
  return read_octomap(read_bytes(path, kMaxFile_bytes, "a readable .bt or .ot file"), full, path);
}

World load_world(const std::string& path, const WorldOptions& options) {
  const Kind kind = kind_of(path);
  check_options(path, kind, options);
  const bool small = kind == Kind::kToml || kind == Kind::kBt || kind == Kind::kOt;
  const auto bytes = read_bytes(path, small ? kMaxFile_bytes : kMaxCloud_bytes, kWanted);
  check_content(path, kind, bytes);
  WorldDescription read = read_world(path, kind, bytes, options);
  if (options.bounds_W) read.bounds_W = *options.bounds_W;
  if (options.ground_m) read.ground_m = *options.ground_m;
  if (kind != Kind::kToml) {
    if (!(read.bounds_W.size().minCoeff() > 1.0))
      refuse(path,
             fmt::format("less than 1 m of space to fly in above z = {:.1f} m: must be more, or --bounds",
                         read.bounds_W.min_W.z()));
    read.start_W = read.goal_W = read.bounds_W.center();
    if (!options.start_W || !options.goal_W) {
      World world(std::move(read));
      const Vector3 start_W = roomiest(world, true);
      const Vector3 goal_W = roomiest(world, false);
      read = std::move(world).description();
      read.start_W = start_W;
      read.goal_W = goal_W;
    }
  }
  if (options.start_W) read.start_W = *options.start_W;
  if (options.goal_W) read.goal_W = *options.goal_W;
  World world(std::move(read));
  if (const std::string why = why_no_room(world, options.radius_m); !why.empty()) refuse(path, why);
  return world;
}

}  // namespace roborun::sitl
