/// Surfaces made of triangles, with a tree of boxes to search them: worlds that come from meshes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/vector.hpp"

namespace roborun::sitl {

using Triangle = std::array<Vector3, 3>;

/// Squared distance from a point to a triangle, edges and corners included.
[[nodiscard]] double squared_distance_m2(const Triangle& triangle, const Vector3& p_W) noexcept;

/// A triangle has no inside: what is closed can be entered only through its surface, which nobody may touch.
class TriangleMesh {
 public:
  TriangleMesh() = default;
  /// O(n log n). Triangles without area are dropped. Precondition: all corners are finite.
  explicit TriangleMesh(std::vector<Triangle> triangles);

  [[nodiscard]] bool empty() const noexcept { return triangles_.empty(); }
  [[nodiscard]] const std::vector<Triangle>& triangles() const noexcept { return triangles_; }
  /// Box around all; precondition: not empty.
  [[nodiscard]] Aabb bounds_W() const noexcept { return node_.front().box; }
  /// Distance along a unit direction to the first triangle, +infinity if none within max_m. O(log n) in the mean.
  [[nodiscard]] double hit_distance_m(const Vector3& origin_W, const Vector3& direction_W,
                                      double max_m) const noexcept;
  /// Distance to the nearest triangle, at most cap_m.
  [[nodiscard]] double clearance_m(const Vector3& p_W, double cap_m) const noexcept;

 private:
  /// The first child of an inner node is the next one; a leaf has count > 0.
  struct Node {
    Aabb box;
    std::uint32_t first{};   ///< Leaf: its first triangle. Inner node: its second child.
    std::uint32_t count{0};  ///< Leaf: how many triangles.
  };
  void build(std::vector<std::uint32_t>& order, const std::vector<Triangle>& all);

  std::vector<Triangle> triangles_;  ///< In the order of the leaves.
  std::vector<Node> node_;
};

}  // namespace roborun::sitl
