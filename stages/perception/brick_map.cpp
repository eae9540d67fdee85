#include "stages/perception/brick_map.hpp"

#include <algorithm>
#include <cmath>

#include "core/range.hpp"
#include "core/record/state_hash.hpp"
#include "firmware_if/assert.hpp"

namespace roborun::stages {
namespace {

constexpr double kMaxPositions = 4e6;

double coarsest_m(const BrickMap::Config& config) noexcept {
  return config.lattice.cell_size_m(kPrecisionLevels - 1);
}

std::int32_t even_bricks(const BrickMap::Config& config, double length_m) noexcept {
  return 2 * static_cast<std::int32_t>(std::ceil(length_m / coarsest_m(config)));
}

Vector3 corner_of(const BrickMap::Config& config) noexcept {
  Vector3 corner;
  for (int i = 0; i < 3; ++i)
    corner[i] = std::floor(config.bounds_W.min_W[i] / coarsest_m(config)) * coarsest_m(config);
  return corner;
}

std::size_t row_count(const BrickMap::Config& config) noexcept {
  const Vector3 size = config.bounds_W.max_W - corner_of(config);
  return static_cast<std::size_t>(even_bricks(config, size.y())) *
         static_cast<std::size_t>(even_bricks(config, size.z()));
}

std::size_t position_count(const BrickMap::Config& config) noexcept {
  const double length_m = config.bounds_W.max_W.x() - corner_of(config).x();
  return static_cast<std::size_t>(even_bricks(config, length_m)) * row_count(config);
}

}  // namespace

Status BrickMap::Config::validate() const noexcept {
  const Vector3 size = bounds_W.size();
  const bool bounds_ok = is_finite(bounds_W.min_W) && is_finite(bounds_W.max_W) && size.minCoeff() > 0.0 &&
                         size.maxCoeff() <= 40e3;
  if (!bounds_ok || !core::within(lattice.finest_m, 0.05, 0.3)) return Status::kInvalidArgument;
  const Vector3 count = size / coarsest_m(*this);
  const double positions =
      8.0 * std::ceil(count.x() + 1) * std::ceil(count.y() + 1) * std::ceil(count.z() + 1);
  const bool ok = positions <= kMaxPositions && core::within<std::size_t>(max_bricks, 64, 200000) &&
                  core::within<std::size_t>(max_frames, 1, kMaxCameras) && all_around_frames <= max_frames &&
                  core::within<std::size_t>(max_image_width, 8, kMaxImageSide) &&
                  core::within<std::size_t>(max_image_height, 8, kMaxImageSide) &&
                  core::within(vehicle_radius_m, 0.0, 2.0) && core::within(thinnest_m, 0.005, 1.0);
  return ok ? Status::kOk : Status::kInvalidArgument;
}

std::size_t BrickMap::arena_bytes(const Config& config) noexcept {
  const std::size_t positions = position_count(config);
  return positions * (2 * sizeof(std::uint32_t) + sizeof(std::uint16_t)) + row_count(config) * sizeof(Reach) +
         config.max_bricks * (sizeof(Brick) + 2 * sizeof(std::uint32_t) + sizeof(std::uint16_t)) +
         config.max_frames * DepthPyramid::arena_bytes(config.max_image_width, config.max_image_height) +
         ScanHistory::arena_bytes(config.max_frames, config.max_image_width, config.max_image_height) +
         config.max_image_width * config.max_image_height * sizeof(float) + 16 * alignof(std::max_align_t);
}

BrickMap::BrickMap(const Config& config, core::Arena& arena) noexcept
    // Before the bounds become whole numbers.
    : config_((ROBORUN_ASSERT(config.validate() == Status::kOk), config)),
      corner_W_(corner_of(config)),
      nx_(even_bricks(config, config.bounds_W.max_W.x() - corner_W_.x())),
      ny_(even_bricks(config, config.bounds_W.max_W.y() - corner_W_.y())),
      nz_(even_bricks(config, config.bounds_W.max_W.z() - corner_W_.z())),
      history_(arena, config.max_frames, config.max_image_width, config.max_image_height) {
  const std::size_t positions = position_count(config);
  // Tables with a place for each position, and the list of free bricks, are in use as a whole from now on.
  slot_ = arena.take<std::int32_t>(positions, "map positions");
  arena.last_pool().use(slot_.size());
  order_ = arena.take<std::uint32_t>(positions, "map order");
  order_pool_ = &arena.last_pool();
  order_key_ = arena.take<std::uint16_t>(positions, "map order keys");
  arena.last_pool().use(order_key_.size());
  row_reach_ = arena.take<Reach>(row_count(config), "map rows");
  arena.last_pool().use(row_reach_.size());
  brick_ = arena.take<Brick>(config.max_bricks, "map bricks");
  brick_pool_ = &arena.last_pool();
  free_list_ = arena.take<std::uint32_t>(config.max_bricks, "map free list");
  arena.last_pool().use(free_list_.size());
  dirty_ = arena.take<std::uint32_t>(config.max_bricks, "map dirty list");
  dirty_pool_ = &arena.last_pool();
  known_count_ = arena.take<std::uint16_t>(config.max_bricks, "map known counts");
  known_pool_ = &arena.last_pool();
  filled_ = arena.take<float>(config.max_image_width * config.max_image_height, "map filled image");
  arena.last_pool().use(filled_.size());
  cameras_.lattice = config.lattice;
  free_brick_.fill(evidence::kFree);
  surface_brick_.fill(evidence::kUnknown);
  surface_brick_.mip.back() |= content::kOccupied;
  const auto cell_at = [this](const Vector3& p_W) {
    const Vector3 local = (p_W - corner_W_) / finest_m();
    return Cell{static_cast<std::int32_t>(local.x()), static_cast<std::int32_t>(local.y()),
                static_cast<std::int32_t>(local.z())};
  };
  low_ = cell_at(config.bounds_W.min_W);
  high_ = cell_at(config.bounds_W.max_W);
  high_ = {std::min(high_.x, nx_ * kBrickCells - 1), std::min(high_.y, ny_ * kBrickCells - 1),
           std::min(high_.z, nz_ * kBrickCells - 1)};
  forget();
  for (std::size_t i = 0; i < config.max_frames; ++i)
    pyramid_[i].emplace(arena, config.max_image_width, config.max_image_height);
}

void BrickMap::forget() noexcept {
  std::fill(slot_.begin(), slot_.end(), kUnknownBrick);
  std::fill(row_reach_.begin(), row_reach_.end(), Reach{nx_, -1});
  // Highest slot first, so that slots are handed out from 0 up.
  for (std::size_t i = 0; i < free_list_.size(); ++i) {
    free_list_[i] = static_cast<std::uint32_t>(free_list_.size() - 1 - i);
  }
  free_count_ = free_list_.size();
  dirty_count_ = 0;
  known_cells_ = 0;
  view_radius_m_ = 0.0;
  history_.forget();
}

const Brick* BrickMap::brick_at(std::size_t position) const noexcept {
  const std::int32_t slot = slot_[position];
  if (slot >= 0) return &brick_[static_cast<std::size_t>(slot)];
  if (slot <= kFreeBrick) return &free_brick_;
  return slot == kSurfaceBrick ? &surface_brick_ : nullptr;
}

Vector3 BrickMap::brick_center_W(std::int32_t bx, std::int32_t by, std::int32_t bz) const noexcept {
  return corner_W_ + brick_m() * Vector3(bx + 0.5, by + 0.5, bz + 0.5);
}

bool BrickMap::cell_of(const Vector3& p_W, Cell& cell) const noexcept {
  if (!config_.bounds_W.contains(p_W)) return false;  // also refuses NaN
  const Vector3 local = (p_W - corner_W_) / finest_m();
  cell = {static_cast<std::int32_t>(std::floor(local.x())), static_cast<std::int32_t>(std::floor(local.y())),
          static_cast<std::int32_t>(std::floor(local.z()))};
  return cell.x < nx_ * kBrickCells && cell.y < ny_ * kBrickCells && cell.z < nz_ * kBrickCells;
}

Brick* BrickMap::touch(std::int32_t bx, std::int32_t by, std::int32_t bz) noexcept {
  std::int32_t& slot = slot_[slot_of(bx, by, bz)];
  if (slot < 0) {
    const bool was_free = slot <= kFreeBrick;
    if (brick_pool_->exhausted() || (free_count_ == 0 && !give_up_farthest())) {
      // What cannot be kept any more is unknown: never free by want of memory.
      if (was_free) known_cells_ -= kCellsPerBrick;
      slot = kUnknownBrick;
      ++counters_.bricks_refused;
      return nullptr;
    }
    slot = static_cast<std::int32_t>(free_list_[--free_count_]);
    reach_to(bx, by, bz);
    brick_pool_->use(brick_.size() - free_count_);
    known_pool_->use(brick_.size() - free_count_);
    Brick& fresh = brick_[static_cast<std::size_t>(slot)];
    fresh.fill(was_free ? evidence::kFree : evidence::kUnknown);
    fresh.x = bx;
    fresh.y = by;
    fresh.z = bz;
    fresh.dirty = false;
    fresh.cleared = 0;
    fresh.revision = ++revision_;
    known_count_[static_cast<std::size_t>(slot)] = fresh.known_count;
  }
  Brick& brick = brick_[static_cast<std::size_t>(slot)];
  if (!brick.dirty && dirty_count_ < dirty_.size()) {
    dirty_[dirty_count_++] = static_cast<std::uint32_t>(slot);
    brick.dirty = true;
  }
  return &brick;
}

void BrickMap::free_brick(std::int32_t bx, std::int32_t by, std::int32_t bz) noexcept {
  std::int32_t& slot = slot_[slot_of(bx, by, bz)];
  if (slot < 0) {
    if (slot > kFreeBrick) known_cells_ += kCellsPerBrick;
    slot = free_now_;
    reach_to(bx, by, bz);
  } else if (Brick* brick = touch(bx, by, bz)) {
    brick->add_free(kBrickLevel, 0, 1U, {false, counts_for_the_thin(bx, by, bz)});
    brick->cleared = free_now_;
  }
}

void BrickMap::free_vehicle() noexcept {
  const double r_m = config_.vehicle_radius_m;
  const int n = static_cast<int>(std::ceil(r_m / finest_m()));
  for (int dz = -n; dz <= n; ++dz) {
    for (int dy = -n; dy <= n; ++dy) {
      for (int dx = -n; dx <= n; ++dx) {
        const Vector3 offset = finest_m() * Vector3(dx, dy, dz);
        Cell cell{};
        if (offset.norm() > r_m || !cell_of(vehicle_W_ + offset, cell)) continue;
        const std::int32_t bx = cell.x >> kBrickLevel, by = cell.y >> kBrickLevel, bz = cell.z >> kBrickLevel;
        if (slot_[slot_of(bx, by, bz)] <= kFreeBrick) continue;
        Brick* brick = touch(bx, by, bz);
        if (brick == nullptr) continue;
        const std::uint32_t morton = morton3(in_brick(cell.x), in_brick(cell.y), in_brick(cell.z));
        brick->add_free(0, morton / 8, static_cast<std::uint8_t>(1U << (morton % 8)), {false, true});
      }
    }
  }
}

void BrickMap::assume_free(const Vector3& half_m) noexcept {
  const auto cells = [&half_m, this](int axis) {
    return static_cast<int>(std::clamp(half_m[axis], 0.0, 10.0) / finest_m());
  };
  const int nx = cells(0), ny = cells(1), nz = cells(2);
  for (int dz = -nz; dz <= nz; ++dz) {
    for (int dy = -ny; dy <= ny; ++dy) {
      for (int dx = -nx; dx <= nx; ++dx) {
        Cell cell{};
        if (!cell_of(vehicle_W_ + finest_m() * Vector3(dx, dy, dz), cell)) continue;
        const std::int32_t bx = cell.x >> kBrickLevel, by = cell.y >> kBrickLevel, bz = cell.z >> kBrickLevel;
        if (slot_[slot_of(bx, by, bz)] <= kFreeBrick) continue;
        Brick* brick = touch(bx, by, bz);
        if (brick == nullptr) continue;
        const std::uint32_t morton = morton3(in_brick(cell.x), in_brick(cell.y), in_brick(cell.z));
        if (evidence::is_occupied(brick->cell(morton))) continue;
        brick->add_free(0, morton / 8, static_cast<std::uint8_t>(1U << (morton % 8)));
      }
    }
  }
}

bool BrickMap::give_up_farthest() noexcept {
  // The farthest 1/16 at once, so that the walk over all bricks is paid rarely. Only bricks beyond the reach
  // of the cameras of this scan may go: they are not dirty.
  constexpr std::size_t kBuckets = 512;
  constexpr double kBucket_m = 8.0;
  std::array<std::uint32_t, kBuckets> histogram{};
  const auto bucket = [this](const Brick& b) {
    const double distance_m = (brick_center_W(b.x, b.y, b.z) - vehicle_W_).norm();
    return std::min(static_cast<std::size_t>(distance_m / kBucket_m), kBuckets - 1);
  };
  const auto in_use = [this](std::size_t i) {
    const Brick& b = brick_[i];
    return slot_[slot_of(b.x, b.y, b.z)] == static_cast<std::int32_t>(i);
  };
  for (std::size_t i = 0; i < brick_.size(); ++i) {
    if (in_use(i)) ++histogram[bucket(brick_[i])];
  }
  std::size_t threshold = kBuckets - 1;
  std::size_t count = histogram[threshold];
  while (threshold > 1 && count < brick_.size() / 16) count += histogram[--threshold];
  std::size_t given_up = 0;
  for (std::size_t i = 0; i < brick_.size(); ++i) {
    Brick& b = brick_[i];
    if (!in_use(i) || b.dirty || bucket(b) < threshold) continue;
    slot_[slot_of(b.x, b.y, b.z)] = kUnknownBrick;
    known_cells_ -= b.known_count;
    b.known_count = 0;
    free_list_[free_count_++] = static_cast<std::uint32_t>(i);
    ++given_up;
  }
  counters_.bricks_given_up += given_up;
  return given_up > 0;
}

void BrickMap::refresh(Brick& brick) noexcept {
  if (!brick.stale) return;
  known_cells_ -= brick.known_count;
  brick.refresh();
  brick.revision = ++revision_;
  known_cells_ += brick.known_count;
  known_count_[static_cast<std::size_t>(&brick - brick_.data())] = brick.known_count;
}

void BrickMap::refresh_dirty() noexcept {
  dirty_pool_->use(dirty_count_);
  for (std::size_t i = 0; i < dirty_count_; ++i) {
    Brick& b = brick_[dirty_[i]];
    refresh(b);
    b.dirty = false;
    if (b.flags(kBrickLevel, 0) != content::kFree) continue;
    slot_[slot_of(b.x, b.y, b.z)] = kFreeBrick;
    free_list_[free_count_++] = dirty_[i];
  }
  dirty_count_ = 0;
}

double BrickMap::known_volume_m3() const noexcept {
  return static_cast<double>(known_cells_) * finest_m() * finest_m() * finest_m();
}

std::size_t BrickMap::bytes() const noexcept { return arena_bytes(config_); }

std::size_t BrickMap::used_bytes() const noexcept {
  std::size_t known_positions = 0;
  for (const std::int32_t slot : slot_) known_positions += slot != kUnknownBrick ? 1U : 0U;
  return (brick_.size() - free_count_) * sizeof(Brick) + known_positions * sizeof(std::int32_t);
}

std::uint64_t BrickMap::digest() const noexcept {
  core::StateHash hash;
  for (std::size_t position = 0; position < slot_.size(); ++position) {
    const Brick* brick = brick_at(position);
    if (brick == nullptr) continue;
    hash.add(static_cast<std::uint64_t>(position));
    hash.add(std::uint64_t{brick->mip.back()});
    for (const std::uint64_t word : brick->word) hash.add(word);
  }
  return hash.value();
}

}  // namespace roborun::stages
