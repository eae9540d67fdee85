#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "stages/perception/brick_map.hpp"
#include "stages/perception/empty_reach.hpp"

namespace roborun::stages {
namespace {

/// So often must something thin not be met where it should be until it is believed to be gone.
constexpr double kThinPatience = 4.0;
constexpr double kMoved_m = 1.5;  // about twice a body's radius

/// Tiles of at most half the image that a cell of p0 has at the end of the range.
int tile_shift(const firmware_if::DepthFrame& frame, double p0_m) noexcept {
  const double half_cell_m = 0.5 * p0_m;
  const double cell_columns =
      frame.width * half_cell_m / static_cast<double>(frame.tan_half_width * frame.range_m);
  const double cell_rows =
      frame.height * half_cell_m / static_cast<double>(frame.tan_half_height * frame.range_m);
  const double cell_pixels = std::min(cell_columns, cell_rows);
  int shift = 0;
  while (shift < 3 && cell_pixels >= 4.0 * (1 << shift)) ++shift;
  return shift;
}

}  // namespace

firmware_if::DepthFrame BrickMap::with_reach(const PosedDepthFrame& posed) noexcept {
  firmware_if::DepthFrame frame = posed.frame;
  const std::size_t pixels = frame.depth_m.size();
  if (pixels > filled_.size()) return frame;
  const std::span<float> filled = filled_.first(pixels);
  if (posed.is_cloud) {
    std::size_t i = 0;
    for (std::size_t v = 0; v < frame.height; ++v)
      for (std::size_t u = 0; u < frame.width; ++u, ++i)
        filled[i] = frame.depth_m[i] >= frame.range_m ? empty_reach_m(posed, u, v) : frame.depth_m[i];
    frame.depth_m = filled;
  } else if (reach_.fill(posed, filled)) {
    frame.depth_m = filled;
  }
  return frame;
}

std::size_t BrickMap::usable_frames(const IntegrationRequest& request, IntegrationResult& result) noexcept {
  std::size_t clouds = 0;
  bool any = false;
  cameras_.count = 0;
  guard_.begin(request.frames);
  const bool keeps = !request.frames.empty() && history_.begin(request.frames.front().frame.stamp);
  for (std::size_t i = 0; i < request.frames.size(); ++i) {
    const PosedDepthFrame& posed = request.frames[i];
    DepthPyramid* const image = cameras_.count < config_.max_frames ? &*pyramid_[cameras_.count] : nullptr;
    const bool has_shape = image != nullptr && check_shape(posed) == Status::kOk;
    const firmware_if::DepthFrame frame = has_shape ? with_reach(posed) : firmware_if::DepthFrame{};
    // All pixels are read once, by the pyramid: it counts what the guard has to know.
    if (!has_shape || image->build(frame, tile_shift(frame, size_m(request.level))) != Status::kOk ||
        guard_.check_content(posed) != Status::kOk ||
        (!image->shows_surface() && image->shows_anything() && is_white(posed, request.moved_W))) {
      ++result.frames_refused;
      continue;
    }
    if (keeps) history_.add(posed, frame);
    cameras_.camera[cameras_.count].prepare(posed, *image);
    any = any || image->shows_anything();
    clouds += posed.is_cloud ? 1U : 0U;
    frame_of_[cameras_.count++] = i;
  }
  counters_.frames_refused += result.frames_refused;
  const std::size_t images = cameras_.count - clouds;
  cameras_.complete =
      clouds > 0 ? images == 0 && clouds == CloudImages::kImages : images == config_.all_around_frames;
  if (keeps) history_.set_complete(cameras_.complete);
  return any ? cameras_.count : 0;
}

std::size_t BrickMap::unit_index(const Position& unit) const noexcept {
  const int shift = unit_level_ - kBrickLevel;
  return (static_cast<std::size_t>(unit.z) * static_cast<std::size_t>(ny_ >> shift) +
          static_cast<std::size_t>(unit.y)) *
             static_cast<std::size_t>(nx_ >> shift) +
         static_cast<std::size_t>(unit.x);
}

BrickMap::Position BrickMap::unit_at(std::uint32_t packed) const noexcept {
  const auto x_bits = static_cast<unsigned>(std::bit_width(static_cast<std::uint32_t>(nx_)));
  const auto y_bits = static_cast<unsigned>(std::bit_width(static_cast<std::uint32_t>(ny_)));
  const auto low = [](std::uint32_t bits, unsigned count) {
    return static_cast<std::int32_t>(bits & ((1U << count) - 1U));
  };
  return {low(packed, x_bits), low(packed >> x_bits, y_bits),
          static_cast<std::int32_t>(packed >> (x_bits + y_bits))};
}

std::uint32_t BrickMap::packed(const Position& unit) const noexcept {
  const auto x_bits = static_cast<unsigned>(std::bit_width(static_cast<std::uint32_t>(nx_)));
  const auto y_bits = static_cast<unsigned>(std::bit_width(static_cast<std::uint32_t>(ny_)));
  return static_cast<std::uint32_t>(unit.x) | static_cast<std::uint32_t>(unit.y) << x_bits |
         static_cast<std::uint32_t>(unit.z) << (x_bits + y_bits);
}

Vector3 BrickMap::unit_center_W(const Position& unit) const noexcept {
  return corner_W_ + size_m(unit_level_) * Vector3(unit.x + 0.5, unit.y + 0.5, unit.z + 0.5);
}

bool BrickMap::is_white(const PosedDepthFrame& posed, std::span<const Vector3> moved_W) const noexcept {
  constexpr int kRays = 8;          // in each direction
  constexpr int kLeastBlocked = 3;  // one may be a stray cell
  const double brick_step_m = 0.5 * brick_m(), fine_step_m = 0.5 * finest_m();
  const firmware_if::DepthFrame& frame = posed.frame;
  if (posed.is_cloud) return false;
  const double end_m = 0.8 * static_cast<double>(frame.range_m);
  Cell cell{};
  const auto brick_around = [&](const Vector3& p_W) -> const Brick* {
    if (!cell_of(p_W, cell)) return nullptr;
    return brick_at(slot_of(cell.x >> kBrickLevel, cell.y >> kBrickLevel, cell.z >> kBrickLevel));
  };
  const auto meets_surface = [&](const Vector3& ray_W) {
    const double length = ray_W.norm();
    bool near_end = true;  // The brick at that end of the piece has a surface.
    for (double far_m = brick_step_m / length; far_m < end_m; far_m += brick_step_m / length) {
      const Brick* brick = brick_around(posed.X_WC.p_RT + far_m * ray_W);
      const bool far_end = brick != nullptr && (brick->flags(kBrickLevel, 0) & content::kOccupied) != 0;
      if (!std::exchange(near_end, far_end) && !far_end) continue;
      for (double at_m = far_m - brick_step_m / length; at_m < far_m; at_m += fine_step_m / length) {
        const Vector3 at_W = posed.X_WC.p_RT + at_m * ray_W;
        brick = brick_around(at_W);
        if (brick != nullptr &&
            evidence::is_occupied(brick->cell(morton3(in_brick(cell.x), in_brick(cell.y), in_brick(cell.z)))))
          return !moved_nearby(moved_W, at_W);
      }
    }
    return false;
  };
  int blocked = 0;
  for (int v = 0; v < kRays; ++v) {
    for (int u = 0; u < kRays; ++u) {
      const auto across = static_cast<double>(frame.tan_half_width);
      const auto along = static_cast<double>(frame.tan_half_height);
      const Vector3 ray_C(1.0, across * (1.0 - (2.0 * u + 1.0) / kRays),
                          along * (1.0 - (2.0 * v + 1.0) / kRays));
      blocked += meets_surface(posed.X_WC.R_RT * ray_C) ? 1 : 0;
    }
  }
  return blocked >= kLeastBlocked;
}

double BrickMap::volume_m3(const Vector3& center_W, double edge_m) const noexcept {
  const Vector3 half = Vector3::Constant(0.5 * edge_m);
  const Vector3 low = (center_W - half).cwiseMax(config_.bounds_W.min_W);
  const Vector3 high = (center_W + half).cwiseMin(config_.bounds_W.max_W);
  return (high - low).cwiseMax(0.0).prod();
}

Aabb BrickMap::reach_W() const noexcept {
  const double rounding_m = finest_m();
  Vector3 low = cameras_.camera[0].p_WC;
  Vector3 high = low;
  for (std::size_t i = 0; i < cameras_.count; ++i) {
    const SightCamera& c = cameras_.camera[i];
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      const double ahead = static_cast<double>(c.range_m) * static_cast<double>(c.R_CW[k]);
      const double aside =
          static_cast<double>(c.range_m) *
          (static_cast<double>(c.tan_half_width) * static_cast<double>(std::fabs(c.R_CW[3 + k])) +
           static_cast<double>(c.tan_half_height) * static_cast<double>(std::fabs(c.R_CW[6 + k])));
      low[axis] = std::min(low[axis], c.p_WC[axis] + std::min(ahead - aside, 0.0) - rounding_m);
      high[axis] = std::max(high[axis], c.p_WC[axis] + std::max(ahead + aside, 0.0) + rounding_m);
    }
  }
  const Aabb& bounds = config_.bounds_W;
  return {low.cwiseMax(bounds.min_W).cwiseMin(bounds.max_W),
          high.cwiseMin(bounds.max_W).cwiseMax(bounds.min_W)};
}

std::size_t BrickMap::order_units(const IntegrationRequest& request) noexcept {
  const auto [low, high] = reach_W();
  // Where v0 cannot run out, larger steps give the same map sooner.
  const bool all = request.volume_m3 >= (high - low).prod();
  unit_level_ = all || request.level >= kBlockLevel ? kBlockLevel : kBrickLevel;
  const auto index = [this](double p_m, double corner_m, std::int32_t bricks) {
    return std::clamp(static_cast<std::int32_t>((p_m - corner_m) / size_m(unit_level_)), 0,
                      (bricks >> (unit_level_ - kBrickLevel)) - 1);
  };
  first_unit_ = {index(low.x(), corner_W_.x(), nx_), index(low.y(), corner_W_.y(), ny_),
                 index(low.z(), corner_W_.z(), nz_)};
  last_unit_ = {index(high.x(), corner_W_.x(), nx_), index(high.y(), corner_W_.y(), ny_),
                index(high.z(), corner_W_.z(), nz_)};

  // Counting sort by distance to the trajectory: bounded, stable, no comparison of doubles.
  constexpr std::size_t kBuckets = 256;
  std::array<std::uint32_t, kBuckets> start{};
  const auto key_of = [&request](const Vector3& center_W) {
    double nearest2 = std::numeric_limits<double>::infinity();
    for (const Vector3& p_W : request.trajectory_W)
      nearest2 = std::min(nearest2, (p_W - center_W).squaredNorm());
    return static_cast<std::uint16_t>(
        std::min(std::sqrt(nearest2) / kOrderStep_m, static_cast<double>(kBuckets - 1)));
  };
  const auto for_each_unit = [this](auto&& on_unit) {
    for (std::int32_t z = first_unit_.z; z <= last_unit_.z; ++z)
      for (std::int32_t y = first_unit_.y; y <= last_unit_.y; ++y)
        for (std::int32_t x = first_unit_.x; x <= last_unit_.x; ++x) on_unit(Position{x, y, z});
  };
  for_each_unit([&](const Position& unit) {
    const std::uint16_t key = key_of(unit_center_W(unit));
    order_key_[unit_index(unit)] = key;
    ++start[key];
  });
  std::uint32_t total = 0;
  for (std::uint32_t& s : start) {
    const std::uint32_t count = s;
    s = total;
    total += count;
  }
  for_each_unit([&](const Position& unit) { order_[start[order_key_[unit_index(unit)]]++] = packed(unit); });
  order_pool_->use(total);
  return total;
}

int BrickMap::finest_at(const Vector3& center_W, int finest) const noexcept {
  const double near_m = (center_W - vehicle_W_).norm() - brick_m();
  while (finest + 1 < kBrickLevel && size_m(finest + 1) <= least_pitch_ * near_m) ++finest;
  return finest;
}

void BrickMap::clear_brick(const Position& at, std::uint8_t cameras, int finest, core::Work& work) noexcept {
  const Vector3 center_W = brick_center_W(at.x, at.y, at.z);
  see_brick(cameras_, {center_W, kBrickLevel, cameras}, finest_at(center_W, finest), seen_);
  work.units += seen_.visited;
  work.volume_m3 += seen_.free_cells * volume_m3(center_W, brick_m()) / kCellsPerBrick;
  if (seen_.count == 0 || slot_[slot_of(at.x, at.y, at.z)] <= kFreeBrick) return;
  Brick* const brick = touch(at.x, at.y, at.z);
  if (brick == nullptr) return;  // pool full, and nothing farther away to give up
  const bool thin = counts_for_the_thin(at.x, at.y, at.z);
  for (std::size_t i = 0; i < seen_.count; ++i) {
    const FreeGroup& group = seen_.group[i];
    if (group.in_part != group.free)
      brick->add_free(group.level, group.parent, static_cast<std::uint8_t>(group.free & ~group.in_part),
                      {false, thin});
    if (group.in_part != 0) brick->add_free(group.level, group.parent, group.in_part, {true, thin});
  }
  refresh(*brick);  // while it is in the cache
}

bool BrickMap::clear_block(const Position& block, std::uint8_t cameras, int finest, core::StageBudget& budget,
                           core::Work& work) noexcept {
  const EightSeen eight = see_children(cameras_, {unit_center_W(block), kBlockLevel, cameras});
  ++work.units;
  for (std::int32_t child = 0; child < 8; ++child) {
    const Position at{2 * block.x + (child & 1), 2 * block.y + ((child >> 1) & 1),
                      2 * block.z + (child >> 2)};
    if (((eight.free >> child) & 1) != 0) {
      free_brick(at.x, at.y, at.z);
      work.volume_m3 += volume_m3(brick_center_W(at.x, at.y, at.z), brick_m());
    } else if (((eight.mixed >> child) & 1) != 0 && finest < kBrickLevel) {
      clear_brick(at, eight.cameras[static_cast<std::size_t>(child)], finest, work);
      if (budget.spent(work)) return false;
    }
  }
  return true;
}

bool BrickMap::clear_unit(const Position& unit, std::uint8_t cameras, int finest, core::StageBudget& budget,
                          core::Work& work) noexcept {
  if (unit_level_ == kBlockLevel) return clear_block(unit, cameras, finest, budget, work);
  clear_brick(unit, cameras, finest, work);
  return !budget.spent(work);
}

std::size_t BrickMap::clear_units(std::size_t count, const IntegrationRequest& request,
                                  core::StageBudget& budget, core::Work& work) noexcept {
  const int finest = std::max(request.level, 0);
  std::array<Vector3, BlocksSeen::kMost> center_W;
  for (std::size_t first = 0; first < count; first += BlocksSeen::kMost) {
    const std::size_t here = std::min(BlocksSeen::kMost, count - first);
    std::array<Position, BlocksSeen::kMost> unit_of;
    for (std::size_t i = 0; i < here; ++i) {
      unit_of[i] = unit_at(order_[first + i]);
      center_W[i] = unit_center_W(unit_of[i]);
    }
    const BlocksSeen seen = see_blocks(cameras_, unit_level_, std::span(center_W).first(here));
    work.units += (here + 7) / 8;
    for (std::size_t i = 0; i < here; ++i) {
      const Position& unit = unit_of[i];
      bool is_free = ((seen.free >> i) & 1U) != 0;
      const bool is_mixed = !is_free && ((seen.mixed >> i) & 1U) != 0;
      // Near blocks make a look at many at once a rough one. What is not divided is looked at once more, alone.
      if (is_mixed && finest >= unit_level_) {
        is_free = (see_blocks(cameras_, unit_level_, std::span(center_W).subspan(i, 1)).free & 1U) != 0;
        ++work.units;
      }
      if (is_free) {
        free_unit(unit);
        work.volume_m3 += volume_m3(center_W[i], size_m(unit_level_));
      } else if (is_mixed && finest < unit_level_) {
        if (!clear_unit(unit, seen.cameras[i], finest, budget, work))
          return first + i + 1;  // what was cleared in it needs its surfaces
      }
      if (work.volume_m3 >= request.volume_m3) return first + i + 1;
    }
    if (budget.spent(work)) return first + here;
  }
  return count;
}

void BrickMap::free_unit(const Position& unit) noexcept {
  if (unit_level_ == kBrickLevel) return free_brick(unit.x, unit.y, unit.z);
  for (std::int32_t child = 0; child < 8; ++child)
    free_brick(2 * unit.x + (child & 1), 2 * unit.y + ((child >> 1) & 1), 2 * unit.z + (child >> 2));
}

bool BrickMap::moved_nearby(std::span<const Vector3> moved_W, const Vector3& p_W) noexcept {
  return std::any_of(moved_W.begin(), moved_W.end(),
                     [&p_W](const Vector3& m_W) { return (m_W - p_W).squaredNorm() < kMoved_m * kMoved_m; });
}

Status BrickMap::integrate(const IntegrationRequest& request, core::StageBudget& budget,
                           IntegrationResult& result) noexcept {
  result = {};
  result.work.level = std::clamp(request.level, 0, kPrecisionLevels - 1);
  if (usable_frames(request, result) == 0 || request.trajectory_W.empty()) return Status::kInvalidArgument;
  ++counters_.scans;
  free_now_ = kFreeBrick - 1 - static_cast<std::int32_t>(counters_.scans % kFreeStamps);
  vehicle_W_ = cameras_.camera[0].p_WC - request.frames[frame_of_[0]].p_BC_W;
  double pitch = 0.0;
  least_pitch_ = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < cameras_.count; ++i) {
    const double across = 1.0 / static_cast<double>(cameras_.camera[i].columns_per_tan);
    const double along = 1.0 / static_cast<double>(cameras_.camera[i].rows_per_tan);
    pitch = std::max({pitch, across, along});
    least_pitch_ = std::min({least_pitch_, across, along});
  }
  thin_reach_m_ = std::ldexp(config_.thinnest_m / (kThinPatience * pitch),
                             std::countr_zero(counters_.scans | std::uint64_t{1} << 20U));
  const std::size_t count = order_units(request);
  const std::size_t done = clear_units(count, request, budget, result.work);
  reach_m_ = done < count ? 0.0 : std::numeric_limits<double>::infinity();
  if (done < count && done > 0) reach_m_ = order_key_[unit_index(unit_at(order_[done - 1]))] * kOrderStep_m;
  free_vehicle();
  if (!request.assumed_half_m.isZero(0.0)) assume_free(request.assumed_half_m);
  if (request.level >= kBrickLevel)
    for (std::size_t i = 0; i < dirty_count_; ++i) refresh(brick_[dirty_[i]]);  // add_tiles() reads mips
  add_surfaces(request, result.work);
  refresh_dirty();
  result.thin_pixels = thin_seen_;
  return done < count ? Status::kBudgetSpent : Status::kOk;
}

}  // namespace roborun::stages
