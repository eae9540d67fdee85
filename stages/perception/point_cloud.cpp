#include "stages/perception/point_cloud.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/random/counter_rng.hpp"
#include "firmware_if/assert.hpp"
#include "stages/perception/depth_steps.hpp"
#include "stages/perception/empty_reach.hpp"

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

PointCloud::Wanted::Wanted(const CloudNeed& need, double cell_m) noexcept
    : center_W_(need.center_W),
      low_m_(need.low_m - 1.01 * cell_m),
      high_m_(need.high_m + 1.01 * cell_m),
      diagonal_m_(1.75 * cell_m),
      least_reach_m_(need.reach_m + diagonal_m_),
      inner_W_{need.box_W.min_W + Vector3::Constant(1.01 * cell_m),
               need.box_W.max_W - Vector3::Constant(1.01 * cell_m)} {}

bool PointCloud::Wanted::includes(const Vector3& p_W) noexcept {
  if (p_W.z() < low_m_ || p_W.z() > high_m_) return false;
  const double distance2_m2 = (p_W - center_W_).squaredNorm();
  if (distance2_m2 > reach2_m2_) return false;
  if (distance2_m2 < nearest2_m2_ && inner_W_.contains(p_W)) {
    nearest2_m2_ = distance2_m2;
    // Its mean is at most a diagonal farther away than it; so is no other mean that is nearer still, from any of its pixels.
    const double reach_m = std::fmax(least_reach_m_, std::sqrt(distance2_m2) + 2.0 * diagonal_m_);
    reach2_m2_ = reach_m * reach_m;
  }
  return true;
}

bool PointCloud::add_row(const Row& row, double cell_m, Wanted& wanted) noexcept {
  const firmware_if::DepthFrame& frame = row.posed.frame;
  const Vector3 from_W = row.posed.X_WC.p_RT;
  const double above_m = std::fmax(high_m_ - from_W.z(), 0.0), below_m = std::fmax(from_W.z() - low_m_, 0.0);
  const float* const raw = frame.depth_m.data() + row.v * frame.width;
  const bool mixes = row.posed.error.mixes;
  if (mixes) tell_pixels(frame, row.v, 0, frame.width, row.rules, pixels_);
  bool room = true;
  for (std::size_t u = 0; u < frame.width; ++u) {
    const bool is_value = raw[u] > frame.range_min_m;
    // A hole may be sky: what the map makes of it is its own matter, but it must be allowed to.
    if (!is_value && !row.posed.error.dark_sky) continue;
    const Vector3 direction_W = row.posed.X_WC.R_RT * Vector3(1.0, row.y[u], row.z);
    double depth_m = is_value && raw[u] < frame.range_m
                         ? static_cast<double>(raw[u])
                         : static_cast<double>(empty_reach_m(row.posed, u, row.v));
    if (is_value && raw[u] < frame.range_m && !(mixes && pixels_.depth_m[u] == 0.0F)) {
      const Vector3 p_W = from_W + depth_m * direction_W;
      if (wanted.includes(p_W) && !add(p_W, cell_m)) room = false;
    }
    if (direction_W.z() > 0.0) depth_m = std::fmin(depth_m, above_m / direction_W.z());
    if (direction_W.z() < 0.0) depth_m = std::fmin(depth_m, below_m / -direction_W.z());
    seen_volume_m3_ += row.pixel_area * depth_m * depth_m * depth_m / 3.0;
  }
  return room;
}

Status PointCloud::step(std::span<const PosedDepthFrame> frames, int level, const CloudNeed& need,
                        core::StageBudget& budget, core::Work& work) noexcept {
  ++counters_.steps;
  for (std::size_t i = 0; i < count_; ++i) grid_[used_[i]] = {};
  count_ = 0;
  seen_volume_m3_ = 0.0;
  work = {};
  work.level = level;
  const double cell_m = lattice_.cell_size_m(level);
  Wanted wanted(need, cell_m);
  guard_.begin(frames);
  std::size_t usable = 0;
  bool full = false;
  bool spent = false;
  std::array<double, kMaxImageSide> y;
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
    for (int u = 0; u < frame.width; ++u)
      y[static_cast<std::size_t>(u)] = across - (u + 0.5) * 2.0 * across / frame.width;
    const double pixel_area = 4.0 * across * along / (frame.width * frame.height);
    const PixelRules rules = pixel_rules(frame, posed.error);
    for (int v = 0; v < frame.height && !spent; ++v) {
      const double z = along - (v + 0.5) * 2.0 * along / frame.height;
      if (!add_row({posed, static_cast<std::size_t>(v), z, y, pixel_area, rules}, cell_m, wanted))
        full = true;
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
