/// Point clouds in memory: PCD, PLY, LAS. Nothing is allocated that the bytes do not justify; what is truncated, has
/// impossible counts, or is of another format throws InputError with one line.
/// Sources: PCD 0.7 (Point Cloud Library), PLY (Turk 1994), ASPRS LAS 1.4 R15.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/geometry/vector.hpp"
#include "platform/sitl/world/triangle_mesh.hpp"

namespace roborun::sitl {

/// What a file holds, in its own units and frame. All finite.
struct Geometry {
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
};

/// ascii, binary and binary_compressed. Points with a coordinate that is not finite are "no return" and left out, here and
/// in the others; the view point of the header is not applied.
[[nodiscard]] Geometry parse_pcd(std::span<const unsigned char> bytes, const std::string& name);
/// ascii and binary of either byte order. A file with faces gives triangles and no points.
[[nodiscard]] Geometry parse_ply(std::span<const unsigned char> bytes, const std::string& name);
/// Versions 1.0 to 1.4, all point formats; not LAZ.
[[nodiscard]] Geometry parse_las(std::span<const unsigned char> bytes, const std::string& name);

}  // namespace roborun::sitl
