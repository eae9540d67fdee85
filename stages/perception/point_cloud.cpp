#include "stages/perception/point_cloud.hpp"

#include <algorithm>
#include <cmath>

#include "core/random/counter_rng.hpp"
#include "firmware_if/assert.hpp"

namespace roborun::stages {

PointCloud::PointCloud(const Config& config, core::Arena& arena) noexcept
    : lattice_(config.lattice),
      grid_(arena.take<Entry>(config.max_points, "cloud grid")),
      grid_pool_(arena.last_pool()),
      point_(arena.take<CloudPoint>(config.max_points, "cloud points")),
      point_pool_(arena.last_pool()),
      used_(arena.take<std::uint32_t>(config.max_points, "cloud used entries")),
      used_pool_(arena.last_pool()) {
  ROBORUN_ASSERT(config.validate() == Status::kOk);
}

void PointCloud::set_height_limits(double low_m, double high_m) noexcept {
  low_m_ = low_m;
  high_m_ = high_m;
}

bool PointCloud::add(const Vector3& p_W, double cell_m) noexcept {
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i) {
    const double index = std::clamp(std::floor(p_W[i] / cell_m), -1048576.0, 1048575.0);
    key = (key << 21U) | static_cast<std::uint64_t>(static_cast<std::int64_t>(index) + 1048576);
  }
  key |= std::uint64_t{1} << 63U;
  const std::size_t mask = grid_.size() - 1;
  std::size_t slot = static_cast<std::size_t>(core::mix64(key)) & mask;
  while (grid_[slot].key != 0 && grid_[slot].key != key)
    slot = (slot + 1) & mask;  // bounded: never more than 3/4 full
  if (grid_[slot].key == 0) {
    if (point_pool_.exhausted() || count_ >= grid_.size() - grid_.size() / 4) {
      ++counters_.points_dropped;
      return false;
    }
    grid_[slot] = {key, static_cast<std::uint32_t>(count_)};
    used_[count_] = static_cast<std::uint32_t>(slot);
    point_[count_++] = {};
  }
  CloudPoint& point = point_[grid_[slot].point];
  point.p_W += p_W;  // a sum until the end of the step
  ++point.count;
  return true;
}

Status PointCloud::step(std::span<const PosedDepthFrame> frames, int level, core::StageBudget& budget,
                        core::Work& work) noexcept {
  ++counters_.steps;
  for (std::size_t i = 0; i < count_; ++i) grid_[used_[i]] = {};
  count_ = 0;
  seen_volume_m3_ = 0.0;
  work = {};
  work.level = level;
  const double cell_m = lattice_.cell_size_m(level);
  guard_.begin(frames);
  std::size_t usable = 0;
  bool full = false;
  bool spent = false;
  for (const PosedDepthFrame& posed : frames) {
    if (spent) break;
    if (guard_.check(posed) != Status::kOk) {
      ++counters_.frames_refused;
      continue;
    }
    ++usable;
    const firmware_if::DepthFrame& frame = posed.frame;
    const auto across = static_cast<double>(frame.tan_half_width);
    const auto along = static_cast<double>(frame.tan_half_height);
    const double pixel_area = 4.0 * across * along / (frame.width * frame.height);  // of the plane at depth 1
    for (int v = 0; v < frame.height && !spent; ++v) {
      const double z = along - (v + 0.5) * 2.0 * along / frame.height;
      for (int u = 0; u < frame.width; ++u) {
        const float raw_m =
            frame.depth_m[static_cast<std::size_t>(v) * frame.width + static_cast<std::size_t>(u)];
        const bool is_value = raw_m > frame.range_min_m;
        // A hole may be sky: what the map makes of it is its own matter, but it must be allowed to.
        if (!is_value && !posed.error.dark_sky) continue;
        const double y = across - (u + 0.5) * 2.0 * across / frame.width;
        const Vector3 direction_W = posed.X_WC.R_RT * Vector3(1.0, y, z);
        const auto range_m = static_cast<double>(frame.range_m);
        double depth_m = is_value ? std::fmin(static_cast<double>(raw_m), range_m) : range_m;
        if (is_value && raw_m < frame.range_m && !add(posed.X_WC.p_RT + depth_m * direction_W, cell_m))
          full = true;
        const double height_m = posed.X_WC.p_RT.z();
        if (direction_W.z() > 0.0)
          depth_m = std::fmin(depth_m, std::fmax(high_m_ - height_m, 0.0) / direction_W.z());
        if (direction_W.z() < 0.0)
          depth_m = std::fmin(depth_m, std::fmax(height_m - low_m_, 0.0) / -direction_W.z());
        seen_volume_m3_ += pixel_area * depth_m * depth_m * depth_m / 3.0;
      }
      work.units += frame.width;
      spent = budget.spent(work);
    }
  }
  for (std::size_t i = 0; i < count_; ++i) point_[i].p_W /= point_[i].count;
  for (core::PoolRecord* pool : {&grid_pool_, &point_pool_, &used_pool_}) pool->use(count_);
  if (usable == 0) return Status::kInvalidArgument;
  if (spent) return Status::kBudgetSpent;
  return full ? Status::kCapacity : Status::kOk;
}

}  // namespace roborun::stages
