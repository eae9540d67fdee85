/// Occupied voxels as a dense bit set: worlds that come from OctoMap files.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/geometry/vector.hpp"

namespace roborun::sitl {

/// How far away what a ray does not hit is.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

class VoxelGrid {
 public:
  VoxelGrid() = default;
  /// Covers [min_W, min_W + count * cell_m). Allocates one bit a voxel.
  VoxelGrid(const Vector3& min_W, double cell_m, const std::array<std::int64_t, 3>& count);

  /// Marks voxels [first, first + size)^3, clipped to the grid.
  void fill(const std::array<std::int64_t, 3>& first, std::int64_t size);
  /// All lengths times this, about the origin.
  void scale(double factor) noexcept {
    min_W_ *= factor;
    cell_m_ *= factor;
  }
  [[nodiscard]] bool empty() const noexcept { return bits_.empty(); }
  [[nodiscard]] double cell_m() const noexcept { return cell_m_; }
  [[nodiscard]] Aabb bounds_W() const noexcept;
  [[nodiscard]] bool occupied(const Vector3& p_W) const noexcept;
  [[nodiscard]] bool occupied(std::int64_t ix, std::int64_t iy, std::int64_t iz) const noexcept;
  [[nodiscard]] const std::array<std::int64_t, 3>& count() const noexcept { return count_; }
  /// Distance along a unit direction to the first occupied voxel, +infinity if none within max_m.
  [[nodiscard]] double hit_distance_m(const Vector3& origin_W, const Vector3& direction_W,
                                      double max_m) const noexcept;
  /// Distance to the nearest occupied voxel, at most cap_m; 0 inside one. Nearest blocks first, empty ones at a glance.
  [[nodiscard]] double clearance_m(const Vector3& p_W, double cap_m) const noexcept;

 private:
  Vector3 min_W_ = Vector3::Zero();
  double cell_m_{1.0};
  std::array<std::int64_t, 3> count_{};
  std::vector<std::uint64_t> bits_;
  static constexpr std::int64_t kBlock = 8;  ///< Voxels on an edge of a block.
  std::array<std::int64_t, 3> block_count_{};
  std::vector<bool> block_;  ///< Whether any voxel of the block is occupied.

  /// The nearest occupied voxel of one block, if it is nearer than best_m.
  [[nodiscard]] double clearance_in_block_m(const std::array<std::int64_t, 3>& block, const Vector3& p_W,
                                            double best_m) const noexcept;
};

}  // namespace roborun::sitl
