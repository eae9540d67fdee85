#include <algorithm>
#include <cmath>
#include <limits>

#include "stages/perception/brick_map.hpp"

namespace roborun::stages {

Status BrickMap::export_view(const ExportRequest& request, core::StageBudget& budget,
                             core::Work& work) noexcept {
  work = {};
  work.level = std::clamp(request.level, 0, kPrecisionLevels - 1);
  if (!is_finite(request.center_W) || !(request.volume_m3 >= 0.0)) return Status::kInvalidArgument;
  view_level_ = work.level;
  view_center_W_ = request.center_W;

  // Histogram of known space over distance; the view ends with the last bucket that fits.
  constexpr std::size_t kBuckets = 512;
  constexpr double kBucket_m = 2.4;
  std::array<std::uint64_t, kBuckets> known{};
  std::size_t position = 0;
  for (std::int32_t bz = 0; bz < nz_; ++bz) {
    for (std::int32_t by = 0; by < ny_; ++by) {
      for (std::int32_t bx = 0; bx < nx_; ++bx, ++position) {
        // Too late to know what fits: the radius of the view before stays, around the new centre. What is
        // known is as true as ever, v1 only saves the planner work.
        if (position % 1024 == 1023 && budget.spent(work)) return Status::kBudgetSpent;
        const std::int32_t slot = slot_[position];
        const std::size_t count = slot <= kFreeBrick ? kCellsPerBrick
                                  : slot >= 0        ? known_count_[static_cast<std::size_t>(slot)]
                                                     : 0;
        if (count == 0) continue;
        ++work.units;
        const double distance_m = (brick_center_W(bx, by, bz) - view_center_W_).norm();
        known[std::min(static_cast<std::size_t>(distance_m / kBucket_m), kBuckets - 1)] += count;
      }
    }
  }
  Status status = Status::kOk;
  view_radius_m_ = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kBuckets; ++i) {
    const double volume_m3 = static_cast<double>(known[i]) * finest_m3();
    if (work.volume_m3 + volume_m3 > request.volume_m3 && i > 1) {
      view_radius_m_ = static_cast<double>(i) * kBucket_m;
      status = Status::kBudgetSpent;
      break;
    }
    work.volume_m3 += volume_m3;
  }
  return status;
}

const Brick* BrickMap::brick_within(std::int32_t bx, std::int32_t by, std::int32_t bz,
                                    double radius_m) const noexcept {
  if (bx < 0 || by < 0 || bz < 0 || bx >= nx_ || by >= ny_ || bz >= nz_) return nullptr;
  const Brick* brick = brick_at(slot_of(bx, by, bz));
  if (brick == nullptr) return nullptr;
  const double distance2 = (brick_center_W(bx, by, bz) - view_center_W_).squaredNorm();
  if (distance2 >= radius_m * radius_m) return nullptr;
  return brick;
}

bool BrickMap::brick_range_free(const Brick& brick, const Cell& low, const Cell& high, int finest,
                                std::uint64_t& lookups) const noexcept {
  std::array<Node, 7 * kBrickLevel + 1> stack{};
  std::size_t depth = 0;
  stack[depth++] = {kBrickLevel, 0, 0, 0};
  while (depth > 0) {
    const Node node = stack[--depth];
    ++lookups;
    const std::uint8_t flags = brick.flags(node.level, morton3(node.x, node.y, node.z));
    if (flags == content::kFree) continue;
    if (node.level <= finest) return false;
    const auto level = static_cast<unsigned>(node.level - 1);
    for (std::uint32_t child = 0; child < 8; ++child) {
      const Node next{node.level - 1, 2 * node.x + (child & 1U), 2 * node.y + ((child >> 1U) & 1U),
                      2 * node.z + (child >> 2U)};
      const auto outside = [level](std::uint32_t index, std::int32_t from, std::int32_t to) {
        const auto first = static_cast<std::int32_t>(index << level);
        return first > to || first + (1 << level) - 1 < from;
      };
      if (outside(next.x, low.x, high.x) || outside(next.y, low.y, high.y) || outside(next.z, low.z, high.z))
        continue;
      stack[depth++] = next;
    }
  }
  return true;
}

bool BrickMap::box_free(const Aabb& box_W, int level, double radius_m,
                        std::uint64_t& lookups) const noexcept {
  Cell low{};
  Cell high{};
  const bool ordered = (box_W.min_W.array() <= box_W.max_W.array()).all();
  if (!ordered || !cell_of(box_W.min_W, low) || !cell_of(box_W.max_W, high)) return false;
  // Widened to whole cells of the level.
  const std::int32_t mask = (1 << level) - 1;
  low = {low.x & ~mask, low.y & ~mask, low.z & ~mask};
  high = {high.x | mask, high.y | mask, high.z | mask};
  for (std::int32_t bz = low.z >> kBrickLevel; bz <= high.z >> kBrickLevel; ++bz) {
    for (std::int32_t by = low.y >> kBrickLevel; by <= high.y >> kBrickLevel; ++by) {
      for (std::int32_t bx = low.x >> kBrickLevel; bx <= high.x >> kBrickLevel; ++bx) {
        ++lookups;
        const Brick* brick = brick_within(bx, by, bz, radius_m);
        if (brick == nullptr) return false;
        if (brick->flags(kBrickLevel, 0) == content::kFree) continue;
        const Cell from{low.x - bx * kBrickCells, low.y - by * kBrickCells, low.z - bz * kBrickCells};
        const Cell to{high.x - bx * kBrickCells, high.y - by * kBrickCells, high.z - bz * kBrickCells};
        if (!brick_range_free(*brick, from, to, level, lookups)) return false;
      }
    }
  }
  return true;
}

BlockContent BrickMap::read(const Vector3& corner_W, double cell_m, CellBlock& cells,
                            std::uint64_t& lookups) const noexcept {
  static_assert(kBlockCells == kBrickCells);
  if (cell_m != finest_m()) return read_cell_by_cell(*this, corner_W, cell_m, cells, lookups);
  ++lookups;
  Cell corner{};
  if (!is_finite(corner_W)) return BlockContent::kUnknown;
  const Vector3 middle_W = corner_W + Vector3::Constant(0.5 * brick_m());
  const Vector3 local = (middle_W - corner_W_) / brick_m();
  corner = {static_cast<std::int32_t>(std::floor(local.x())),
            static_cast<std::int32_t>(std::floor(local.y())),
            static_cast<std::int32_t>(std::floor(local.z()))};
  const Brick* brick = brick_within(corner.x, corner.y, corner.z, std::numeric_limits<double>::infinity());
  if (brick == nullptr) return BlockContent::kUnknown;
  if (brick->flags(kBrickLevel, 0) == content::kFree) return BlockContent::kFree;
  if (brick == &surface_brick_) return BlockContent::kUnknown;
  lookups += brick->word.size();
  brick->read(cells);
  return BlockContent::kMixed;
}

CellState BrickMap::at(const Vector3& p_W, std::uint64_t& lookups) const noexcept {
  Cell cell{};
  ++lookups;
  if (!cell_of(p_W, cell)) return CellState::kUnknown;
  std::uint8_t flags = 0;
  const std::int32_t bx = cell.x >> kBrickLevel, by = cell.y >> kBrickLevel, bz = cell.z >> kBrickLevel;
  if (view_level_ <= kBrickLevel) {
    const Brick* brick = brick_within(bx, by, bz, view_radius_m_);
    if (brick == nullptr) return CellState::kUnknown;
    const auto inside = [this](std::int32_t c) {
      return static_cast<std::uint32_t>(c & (kBrickCells - 1)) >> static_cast<unsigned>(view_level_);
    };
    flags = brick->flags(view_level_, morton3(inside(cell.x), inside(cell.y), inside(cell.z)));
  } else {
    for (std::int32_t child = 0; child < 8; ++child) {
      const Brick* brick = brick_within((bx & ~1) + (child & 1), (by & ~1) + ((child >> 1) & 1),
                                        (bz & ~1) + (child >> 2), view_radius_m_);
      flags = static_cast<std::uint8_t>(
          flags | (brick == nullptr ? content::kUnknown : brick->flags(kBrickLevel, 0)));
    }
  }
  if ((flags & content::kOccupied) != 0) return CellState::kOccupied;
  return (flags & content::kUnknown) != 0 ? CellState::kUnknown : CellState::kFree;
}

}  // namespace roborun::stages
