#include "platform/sitl/world/voxel_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace roborun::sitl {
namespace {

std::int64_t index_of(double p_m, double min_m, double cell_m) noexcept {
  const double raw = std::floor((p_m - min_m) / cell_m);
  return static_cast<std::int64_t>(std::clamp(raw, -1e15, 1e15));
}

}  // namespace

VoxelGrid::VoxelGrid(const Vector3& min_W, double cell_m, const std::array<std::int64_t, 3>& count)
    : min_W_(min_W), cell_m_(cell_m), count_(count) {
  const auto total = static_cast<std::size_t>(count[0] * count[1] * count[2]);
  bits_.assign((total + 63) / 64, 0);
  for (std::size_t i = 0; i < 3; ++i) block_count_[i] = (count[i] + kBlock - 1) / kBlock;
  block_.assign(static_cast<std::size_t>(block_count_[0] * block_count_[1] * block_count_[2]), false);
}

void VoxelGrid::fill(const std::array<std::int64_t, 3>& first, std::int64_t size) {
  std::array<std::int64_t, 3> low{};
  std::array<std::int64_t, 3> high{};
  for (std::size_t i = 0; i < 3; ++i) {
    low[i] = std::max<std::int64_t>(first[i], 0);
    high[i] = std::min(first[i] + size, count_[i]);
  }
  for (std::int64_t z = low[2]; z < high[2]; ++z) {
    for (std::int64_t y = low[1]; y < high[1]; ++y) {
      for (std::int64_t x = low[0]; x < high[0]; ++x) {
        const auto bit = static_cast<std::size_t>((z * count_[1] + y) * count_[0] + x);
        bits_[bit / 64] |= std::uint64_t{1} << (bit % 64);
        const std::int64_t row = z / kBlock * block_count_[1] + y / kBlock;
        block_[static_cast<std::size_t>(row * block_count_[0] + x / kBlock)] = true;
      }
    }
  }
}

Aabb VoxelGrid::bounds_W() const noexcept {
  const Vector3 size(static_cast<double>(count_[0]), static_cast<double>(count_[1]),
                     static_cast<double>(count_[2]));
  return {min_W_, min_W_ + cell_m_ * size};
}

bool VoxelGrid::occupied(std::int64_t ix, std::int64_t iy, std::int64_t iz) const noexcept {
  if (ix < 0 || iy < 0 || iz < 0 || ix >= count_[0] || iy >= count_[1] || iz >= count_[2]) return false;
  const auto bit = static_cast<std::size_t>((iz * count_[1] + iy) * count_[0] + ix);
  return ((bits_[bit / 64] >> (bit % 64)) & 1U) != 0;
}

bool VoxelGrid::occupied(const Vector3& p_W) const noexcept {
  return occupied(index_of(p_W.x(), min_W_.x(), cell_m_), index_of(p_W.y(), min_W_.y(), cell_m_),
                  index_of(p_W.z(), min_W_.z(), cell_m_));
}

double VoxelGrid::hit_distance_m(const Vector3& origin_W, const Vector3& direction_W,
                                 double max_m) const noexcept {
  if (bits_.empty()) return kInfinity;
  const Aabb box = bounds_W();
  double enter_m = 0.0;
  double leave_m = max_m;
  for (int i = 0; i < 3; ++i) {
    if (direction_W[i] == 0.0) {
      if (origin_W[i] < box.min_W[i] || origin_W[i] >= box.max_W[i]) return kInfinity;
      continue;
    }
    const double a = (box.min_W[i] - origin_W[i]) / direction_W[i];
    const double b = (box.max_W[i] - origin_W[i]) / direction_W[i];
    enter_m = std::max(enter_m, std::min(a, b));
    leave_m = std::min(leave_m, std::max(a, b));
  }
  if (enter_m > leave_m) return kInfinity;

  std::array<std::int64_t, 3> cell{};
  std::array<std::int64_t, 3> step{};
  std::array<double, 3> next_m{};
  std::array<double, 3> delta_m{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double d = direction_W[axis];
    const double p_m = origin_W[axis] + enter_m * d;
    cell[i] = std::clamp<std::int64_t>(index_of(p_m, min_W_[axis], cell_m_), 0, count_[i] - 1);
    step[i] = d > 0.0 ? 1 : -1;
    delta_m[i] = d == 0.0 ? kInfinity : cell_m_ / std::fabs(d);
    const double border_m = min_W_[axis] + static_cast<double>(cell[i] + (d > 0.0 ? 1 : 0)) * cell_m_;
    next_m[i] = d == 0.0 ? kInfinity : (border_m - origin_W[axis]) / d;
  }
  double at_m = enter_m;
  const std::int64_t limit = count_[0] + count_[1] + count_[2] + 3;
  for (std::int64_t n = 0; n < limit && at_m <= leave_m; ++n) {
    if (occupied(cell[0], cell[1], cell[2])) return at_m;
    const std::size_t axis =
        next_m[0] <= next_m[1] ? (next_m[0] <= next_m[2] ? 0U : 2U) : (next_m[1] <= next_m[2] ? 1U : 2U);
    at_m = next_m[axis];
    next_m[axis] += delta_m[axis];
    cell[axis] += step[axis];
    if (cell[axis] < 0 || cell[axis] >= count_[axis]) return kInfinity;
  }
  return kInfinity;
}

double VoxelGrid::clearance_in_block_m(const std::array<std::int64_t, 3>& block, const Vector3& p_W,
                                       double best_m) const noexcept {
  const auto distance_m = [&](const std::array<std::int64_t, 3>& first, double size) {
    const Vector3 corner =
        min_W_ + cell_m_ * Vector3(static_cast<double>(first[0]), static_cast<double>(first[1]),
                                   static_cast<double>(first[2]));
    return (p_W - p_W.cwiseMax(corner).cwiseMin(corner + Vector3::Constant(size * cell_m_))).norm();
  };
  const std::array<std::int64_t, 3> low{block[0] * kBlock, block[1] * kBlock, block[2] * kBlock};
  if (distance_m(low, static_cast<double>(kBlock)) >= best_m) return best_m;
  for (std::int64_t z = low[2]; z < low[2] + kBlock; ++z) {
    for (std::int64_t y = low[1]; y < low[1] + kBlock; ++y) {
      for (std::int64_t x = low[0]; x < low[0] + kBlock; ++x)
        if (occupied(x, y, z)) best_m = std::min(best_m, distance_m({x, y, z}, 1.0));
    }
  }
  return best_m;
}

double VoxelGrid::clearance_m(const Vector3& p_W, double cap_m) const noexcept {
  if (bits_.empty()) return cap_m;
  const double size_m = static_cast<double>(kBlock) * cell_m_;
  std::array<std::int64_t, 3> middle{};
  std::int64_t last = 0;  // the shell of the farthest block
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    middle[i] = index_of(p_W[axis], min_W_[axis], size_m);
    last = std::max({last, std::abs(middle[i]), std::abs(block_count_[i] - 1 - middle[i])});
  }
  // Shell after shell of blocks around the point's own: those of shell n are at least n - 1 blocks away.
  double best_m = cap_m;
  for (std::int64_t shell = 0; shell <= last && static_cast<double>(shell - 1) * size_m < best_m; ++shell) {
    std::array<std::int64_t, 3> low{};
    std::array<std::int64_t, 3> high{};
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::max<std::int64_t>(middle[i] - shell, 0);
      high[i] = std::min<std::int64_t>(middle[i] + shell, block_count_[i] - 1);
    }
    for (std::int64_t z = low[2]; z <= high[2]; ++z) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        const bool face = std::abs(z - middle[2]) == shell || std::abs(y - middle[1]) == shell;
        for (std::int64_t x = low[0]; x <= high[0]; ++x) {
          // Inside of the shell all has been looked at: on to its far side.
          if (!face && x > middle[0] - shell && x < middle[0] + shell) {
            if (middle[0] + shell > high[0]) break;
            x = middle[0] + shell;
          }
          if (block_[static_cast<std::size_t>((z * block_count_[1] + y) * block_count_[0] + x)])
            best_m = clearance_in_block_m({x, y, z}, p_W, best_m);
        }
      }
    }
  }
  return best_m;
}

}  // namespace roborun::sitl
