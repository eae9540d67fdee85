#include "stages/planning/node_grid.hpp"

#include <limits>

namespace roborun::stages {
namespace {

constexpr double kFinestSide_m = 2.0;
constexpr double kMaxIndex = 1e6;

}  // namespace

void NodeGrid::reset(const Aabb& box_W) noexcept {
  count_ = 0;
  corner_W_ = box_W.min_W;
  const Vector3 size_m = box_W.size();
  side_m_ = kFinestSide_m;
  // Doubling ends: a finite box is smaller than 2^1100 cells.
  for (int round = 0; round < 1100; ++round, side_m_ *= 1.26) {
    double cells = 1.0;
    for (int i = 0; i < 3; ++i) cells *= std::floor(size_m[i] / side_m_) + 1.0;
    if (cells <= static_cast<double>(kCells)) break;
  }
  for (std::size_t i = 0; i < 3; ++i)
    size_[i] = 1 + static_cast<std::int32_t>(size_m[static_cast<int>(i)] / side_m_);
  head_pool_.use(static_cast<std::size_t>(std::int64_t{size_[0]} * size_[1] * size_[2]));
  std::fill(head_.begin(), head_.end(), -1);
}

NodeGrid::Cell NodeGrid::cell_of(const Vector3& p_W) const noexcept {
  Cell cell{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<int>(i);
    const double index = std::clamp((p_W[axis] - corner_W_[axis]) / side_m_, 0.0, kMaxIndex);
    cell[i] = std::min(static_cast<std::int32_t>(index), size_[i] - 1);
  }
  return cell;
}

void NodeGrid::insert(const Vector3& p_W) noexcept {
  const Cell cell = cell_of(p_W);
  std::int32_t& first = head(cell[0], cell[1], cell[2]);
  point_[count_] = {p_W, first};
  first = static_cast<std::int32_t>(count_++);
  point_pool_.use(count_);
}

NodeGrid::Near NodeGrid::nearest(const Vector3& p_W) const noexcept {
  std::int32_t best = 0;
  double best2 = std::numeric_limits<double>::infinity();
  if (count_ <= kFewPoints) {
    for (std::size_t i = 0; i < count_; ++i) {
      const double d2 = (point_[i].p_W - p_W).squaredNorm();
      if (d2 < best2) {
        best2 = d2;
        best = static_cast<std::int32_t>(i);
      }
    }
    return {best, std::sqrt(best2)};
  }
  const Cell c = cell_of(p_W);
  const std::int32_t rings = std::max({size_[0], size_[1], size_[2]});
  for (std::int32_t ring = 0; ring <= rings; ++ring) {
    // Cells in this ring and beyond are at least this far.
    const double beyond_m = static_cast<double>(ring - 1) * side_m_;
    if (ring > 0 && beyond_m > 0.0 && beyond_m * beyond_m > best2) break;
    for (std::int32_t z = std::max(c[2] - ring, 0); z <= std::min(c[2] + ring, size_[2] - 1); ++z) {
      for (std::int32_t y = std::max(c[1] - ring, 0); y <= std::min(c[1] + ring, size_[1] - 1); ++y) {
        const bool face = z == c[2] - ring || z == c[2] + ring || y == c[1] - ring || y == c[1] + ring;
        const std::int32_t stride = face || ring == 0 ? 1 : 2 * ring;
        for (std::int32_t x = c[0] - ring; x <= c[0] + ring; x += stride) {
          if (x < 0 || x >= size_[0]) continue;
          for (std::int32_t i = head(x, y, z); i >= 0; i = point_[static_cast<std::size_t>(i)].next) {
            const double d2 = (point_[static_cast<std::size_t>(i)].p_W - p_W).squaredNorm();
            if (d2 < best2) {
              best2 = d2;
              best = i;
            }
          }
        }
      }
    }
  }
  return {best, std::sqrt(best2)};
}

std::size_t NodeGrid::within(const Vector3& p_W, double radius_m, std::span<Near> found) const noexcept {
  std::size_t count = 0;
  const double radius2 = radius_m * radius_m;
  const auto visit = [&](std::int32_t i) {
    const double d2 = (point_[static_cast<std::size_t>(i)].p_W - p_W).squaredNorm();
    if (d2 > radius2 || (count == found.size() && d2 >= found[count - 1].distance_m)) return;
    std::size_t at = count < found.size() ? count++ : count - 1;
    for (; at > 0 && found[at - 1].distance_m > d2; --at) found[at] = found[at - 1];
    found[at] = {i, d2};
  };
  if (count_ <= kFewPoints) {
    for (std::size_t i = 0; i < count_; ++i) visit(static_cast<std::int32_t>(i));
  } else {
    const Cell low = cell_of(p_W - Vector3::Constant(radius_m));
    const Cell high = cell_of(p_W + Vector3::Constant(radius_m));
    for (std::int32_t z = low[2]; z <= high[2]; ++z) {
      for (std::int32_t y = low[1]; y <= high[1]; ++y) {
        for (std::int32_t x = low[0]; x <= high[0]; ++x) {
          for (std::int32_t i = head(x, y, z); i >= 0; i = point_[static_cast<std::size_t>(i)].next) visit(i);
        }
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) found[i].distance_m = std::sqrt(found[i].distance_m);
  return count;
}

}  // namespace roborun::stages
