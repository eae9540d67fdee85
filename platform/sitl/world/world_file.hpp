/// Worlds from files: TOML written by a person, or any OctoMap file.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "platform/sitl/world/world.hpp"
#include "platform/sitl/world/world_key.hpp"

namespace roborun::sitl {

/// Cells of a point cloud where nobody says otherwise.
inline constexpr double kCloudCell_m = 0.2;

/// What the file does not say, or somebody wants otherwise.
struct WorldOptions {
  std::optional<Vector3> start_W{};
  std::optional<Vector3> goal_W{};
  std::optional<Aabb> bounds_W{};    ///< Where the vehicle's centre may be.
  std::optional<double> ground_m{};  ///< Height of the plane that is the ground.
  std::optional<double> cell_m{};    ///< Of point clouds; none: kCloudCell_m.
  double scale{1.0};                 ///< All lengths of the file times this, 1e-6 to 1e6; not of TOML.
  bool surfaces{false};              ///< Meshes need not be closed.
  double radius_m{0.6};              ///< Start and goal must be free for a sphere of this size.
};

/// By the end of its name: .toml, .bt, .ot, .world, .sdf, .pcd, .ply, .las, .stl, .obj or .dae. Throws InputError (file,
/// line, key, what would be right) for anything that is not a valid world: unreadable, too large (64 MiB; clouds and
/// meshes 1 GiB), of another format than its name says, damaged, unknown keys, wrong types, numbers not finite, start
/// or goal occupied or out of bounds, no ground below the start.
///
/// TOML: the keys of world_keys(), metres, at most 100,000 pillars, 100,000 boxes and 1,000 bodies. The ground is
///   z = 0.
/// OctoMap: every leaf that its log-odds call occupied becomes solid; the bounds are the box around all
///   leaves, from 0.5 m above its lowest. The ground is the lowest leaf, or z = 0 if that is lower.
/// SDF (sdf_file.hpp): shapes stay exact; planes are the ground, and what stands under the start is.
/// Point clouds (cloud_file.hpp): each cell with a point is solid. Positions farther than 20 km from the origin (maps in
///   national grids) are counted from the lowest corner of all.
/// Meshes (mesh_file.hpp, and PLY files with faces): surfaces, which must be closed unless `surfaces`.
/// The last three: bounds are the box around everything, from 0.5 m above the lowest or the ground, and wide enough
/// for given ends. Start and goal default (but for TOML) to the free-most points near the two ends of the longer
/// side, at the middle height.
[[nodiscard]] World load_world(const std::string& path, const WorldOptions& options);

/// Every key of a TOML world: the only ones that load_world() takes.
[[nodiscard]] std::vector<WorldKey> world_keys();

/// The occupied space of an OctoMap file in memory (.ot if `full`, otherwise .bt). Iterative, at most 16
/// levels deep; refuses what is truncated, too long or not OctoMap. A leaf of a coarse level is filled cell by
/// cell, so that a few bytes can mean as many cells as a grid may have (512 MB).
[[nodiscard]] VoxelGrid parse_octomap(std::span<const unsigned char> bytes, bool full,
                                      const std::string& name);

}  // namespace roborun::sitl
