/// Worlds in SDF, as Gazebo flies in: what can be collided with.
/// Source: SDFormat 1.4 to 1.10 (sdformat.org), by hand: models, nested models, links, collisions, included models.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

struct SdfWorld {
  /// Shapes and the ground: that of the highest horizontal plane, -infinity without one. Upright cylinders are pillars and boxes
  /// along the axes boxes; others are turned. Bounds, start and goal are not filled in.
  WorldDescription shapes;
  std::vector<Triangle> triangles;
  std::size_t open_edges{0};   ///< Of its meshes.
  std::string open_mesh;       ///< The first mesh that has some.
  std::vector<Aabb> planes_W;  ///< The size of each plane, which itself has no end.
};

/// `path` names the file in complaints, and says where to look for meshes and included models: beside it, in models
/// there and in ../models. Everything is multiplied by `scale`. Throws InputError with file, line and element for what is
/// damaged, and for what could be collided with and cannot be read: height maps, polylines, actors.
[[nodiscard]] SdfWorld parse_sdf(std::span<const unsigned char> bytes, const std::string& path, double scale);

}  // namespace roborun::sitl
