#include "stages/perception/depth_pyramid.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::stages {

Status check_frame(const PosedDepthFrame& posed) noexcept {
  const firmware_if::DepthFrame& f = posed.frame;
  const bool size_ok = f.width >= 8 && f.height >= 8 && f.width <= DepthPyramid::kMaxPixels &&
                       f.height <= DepthPyramid::kMaxPixels &&
                       f.depth_m.size() == std::size_t{f.width} * std::size_t{f.height};
  const bool optics_ok = std::isfinite(f.range_m) && f.range_m > 0.0F &&
                         std::isfinite(f.tan_half_fov_ratio) && f.tan_half_fov_ratio > 0.0F;
  if (!size_ok || !optics_ok || !is_finite(posed.X_WC.p_RT) || !posed.X_WC.R_RT.allFinite())
    return Status::kInvalidArgument;
  const bool any_valid = std::any_of(f.depth_m.begin(), f.depth_m.end(), [](float d) { return d > 0.0F; });
  return any_valid ? Status::kOk : Status::kInvalidArgument;
}

namespace {

/// See the class comment: a lone dropout counts as the nearest of its neighbours.
void bridge_single_dropouts(const firmware_if::DepthFrame& frame,
                            std::span<DepthPyramid::Bound> entry) noexcept {
  const std::size_t width = frame.width;
  const auto seen_m = [&frame](std::size_t i) { return visible_depth_m(frame.depth_m[i], frame.range_m); };
  for (std::size_t y = 0; y < frame.height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      if (frame.depth_m[i] > 0.0F) continue;
      float nearest_m = frame.range_m;
      if (x > 0) nearest_m = std::min(nearest_m, seen_m(i - 1));
      if (x + 1 < width) nearest_m = std::min(nearest_m, seen_m(i + 1));
      if (y > 0) nearest_m = std::min(nearest_m, seen_m(i - width));
      if (y + 1 < frame.height) nearest_m = std::min(nearest_m, seen_m(i + width));
      entry[i] = {nearest_m, nearest_m};
    }
  }
}

}  // namespace

DepthPyramid::DepthPyramid(core::Arena& arena, std::size_t max_side) noexcept : max_side_(max_side) {
  std::size_t total = 0;
  for (std::size_t side = max_side;; side = (side + 1) / 2) {
    total += side * side;
    if (side == 1) break;
  }
  memory_ = arena.take<Bound>(total, "map depth pyramid");
}

Status DepthPyramid::build(const firmware_if::DepthFrame& frame) noexcept {
  if (frame.width > max_side_ || frame.height > max_side_ || memory_.empty()) return Status::kCapacity;
  int width = frame.width;
  int height = frame.height;
  std::size_t used = 0;
  level_count_ = 0;
  for (std::size_t k = 0; k < kMaxLevels; ++k) {
    Level& level = level_[k];
    const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    level = {memory_.subspan(used, count), width, height};
    used += count;
    ++level_count_;
    if (k == 0) {
      for (std::size_t i = 0; i < count; ++i) {
        const float visible_m = visible_depth_m(frame.depth_m[i], frame.range_m);
        level.entry[i] = {visible_m, visible_m};
      }
      bridge_single_dropouts(frame, level.entry);
    } else {
      const Level& fine = level_[k - 1];
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const int x1 = std::min(2 * x + 1, fine.width - 1);
          const int y1 = std::min(2 * y + 1, fine.height - 1);
          const auto at = [&fine](int ix, int iy) { return fine.entry[fine.index(ix, iy)]; };
          const Bound a = at(2 * x, 2 * y);
          const Bound b = at(x1, 2 * y);
          const Bound c = at(2 * x, y1);
          const Bound d = at(x1, y1);
          level.entry[level.index(x, y)] = {
              std::min(std::min(a.least_m, b.least_m), std::min(c.least_m, d.least_m)),
              std::max(std::max(a.most_m, b.most_m), std::max(c.most_m, d.most_m))};
        }
      }
    }
    if (width == 1 && height == 1) break;
    width = (width + 1) / 2;
    height = (height + 1) / 2;
  }
  return Status::kOk;
}

DepthPyramid::Bound DepthPyramid::bound(int u0, int v0, int u1, int v1) const noexcept {
  int shift = 0;
  const int last = static_cast<int>(level_count_) - 1;
  while (shift < last && (((u1 >> shift) - (u0 >> shift)) > 2 || ((v1 >> shift) - (v0 >> shift)) > 2))
    ++shift;
  const Level& level = level_[static_cast<std::size_t>(shift)];
  Bound result{3.0e38F, 0.0F};
  for (int y = v0 >> shift; y <= v1 >> shift; ++y) {
    for (int x = u0 >> shift; x <= u1 >> shift; ++x) {
      const Bound& entry = level.entry[level.index(x, y)];
      result.least_m = std::min(result.least_m, entry.least_m);
      result.most_m = std::max(result.most_m, entry.most_m);
    }
  }
  return result;
}

}  // namespace roborun::stages
