#include <algorithm>
#include <cmath>
#include <limits>

#include "stages/perception/brick_map.hpp"

namespace roborun::stages {

bool BrickMap::count_known(const Box& box, const Box& done, std::size_t& positions, KnownByDistance& known,
                           core::StageBudget& budget, core::Work& work) const noexcept {
  const auto is_late = [&] { return ++positions % 1024 == 0 && budget.spent(work); };
  for (std::int32_t bz = box.low.z; bz <= box.high.z; ++bz) {
    for (std::int32_t by = box.low.y; by <= box.high.y; ++by) {
      const std::int32_t* const row = &slot_[slot_of(0, by, bz)];
      const bool crosses = bz >= done.low.z && bz <= done.high.z && by >= done.low.y && by <= done.high.y;
      if (is_late()) return false;
      const Reach reach = row_reach_[row_of(by, bz)];
      const std::int32_t last = std::min(box.high.x, reach.last);
      for (std::int32_t bx = std::max(box.low.x, reach.first); bx <= last; ++bx) {
        if (crosses && bx >= done.low.x && bx <= done.high.x) {
          bx = done.high.x;
          continue;
        }
        if (is_late()) return false;
        const std::int32_t slot = row[bx];
        if (slot == kUnknownBrick || slot == kSurfaceBrick) continue;
        const std::size_t count =
            slot <= kFreeBrick ? kCellsPerBrick : known_count_[static_cast<std::size_t>(slot)];
        if (count == 0) continue;
        ++work.units;
        const double distance_m = (brick_center_W(bx, by, bz) - view_center_W_).norm();
        known[std::min(static_cast<std::size_t>(distance_m / kDistance_m), kDistances - 1)] += count;
      }
    }
  }
  return true;
}

Status BrickMap::export_view(const ExportRequest& request, core::StageBudget& budget,
                             core::Work& work) noexcept {
  work = {};
  work.level = std::clamp(request.level, 0, kPrecisionLevels - 1);
  if (!is_finite(request.center_W) || !(request.volume_m3 >= 0.0)) return Status::kInvalidArgument;
  view_level_ = work.level;
  view_center_W_ = request.center_W;

  // Histogram of known space over distance; the view ends with the last bucket that fits. What is counted is in a box around the
  // centre, which grows until the end is in it. It begins around a ball of v1: no view ends within that.
  KnownByDistance known{};
  const Vector3 centre = (view_center_W_ - corner_W_) / brick_m();
  const Box all{{0, 0, 0}, {nx_ - 1, ny_ - 1, nz_ - 1}};
  Box done{{0, 0, 0}, {-1, -1, -1}};
  constexpr double kBall = 4.18, kGrowth = 1.25, kMost_m = 1e5;
  double half_m = 2.0 * kDistance_m;
  std::size_t positions = 0;
  while (kBall * half_m * half_m * half_m < request.volume_m3 && half_m < kMost_m) half_m *= kGrowth;
  for (;; half_m *= kGrowth) {
    const double half = half_m / brick_m();
    const auto low = [half](double c, std::int32_t n) {
      return static_cast<std::int32_t>(std::clamp(std::floor(c - half), 0.0, n - 1.0));
    };
    const auto high = [half](double c, std::int32_t n) {
      return static_cast<std::int32_t>(std::clamp(std::floor(c + half), 0.0, n - 1.0));
    };
    const Box box{{low(centre.x(), nx_), low(centre.y(), ny_), low(centre.z(), nz_)},
                  {high(centre.x(), nx_), high(centre.y(), ny_), high(centre.z(), nz_)}};
    // Too late to know what fits: the radius of the view before stays, around the new centre. What is
    // known is as true as ever, v1 only saves the planner work.
    if (!count_known(box, done, positions, known, budget, work)) return Status::kBudgetSpent;
    done = box;
    const bool is_all = box == all;
    const std::size_t counted =
        is_all ? kDistances : std::min(static_cast<std::size_t>(half_m / kDistance_m), kDistances - 1);
    work.volume_m3 = 0.0;
    for (std::size_t i = 0; i < counted; ++i) {
      const double volume_m3 = static_cast<double>(known[i]) * finest_m3();
      if (work.volume_m3 + volume_m3 > request.volume_m3 && i > 1) {
        view_radius_m_ = static_cast<double>(i) * kDistance_m;
        return Status::kBudgetSpent;
      }
      work.volume_m3 += volume_m3;
    }
    if (!is_all) continue;
    view_radius_m_ = std::numeric_limits<double>::infinity();
    return Status::kOk;
  }
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
  const Brick* brick = brick_above(corner_W);
  if (brick == nullptr) return BlockContent::kUnknown;
  if (brick->flags(kBrickLevel, 0) == content::kFree) return BlockContent::kFree;
  if (brick == &surface_brick_) return BlockContent::kUnknown;
  lookups += brick->word.size();
  brick->read(cells);
  if (!mixes_) cells.sure = cells.occupied;
  return BlockContent::kMixed;
}

BlockContent BrickMap::read_doubled(const Vector3& corner_W, CellBlock& cells,
                                    std::uint64_t& lookups) const noexcept {
  constexpr std::uint64_t kWorkOfAMip = 256;  // its 64 words take half as long as the 512 of the cells
  std::size_t free = 0, unknown = 0;
  cells = {};
  for (std::size_t eighth = 0; eighth < 8; ++eighth) {
    ++lookups;
    const Brick* brick = brick_above(corner_W + brick_m() * corner_of_eighth(eighth));
    if (brick == nullptr || brick == &surface_brick_) {
      ++unknown;
      continue;
    }
    free += brick->flags(kBrickLevel, 0) == content::kFree ? 1U : 0U;
    lookups += brick == &free_brick_ ? 0 : kWorkOfAMip;
    brick->read_doubled(eighth, cells);
  }
  if (!mixes_) cells.sure = cells.occupied;
  if (free == 8) return BlockContent::kFree;
  return unknown == 8 ? BlockContent::kUnknown : BlockContent::kMixed;
}

const Brick* BrickMap::brick_above(const Vector3& corner_W) const noexcept {
  if (!is_finite(corner_W)) return nullptr;
  const Vector3 middle_W = corner_W + Vector3::Constant(0.5 * brick_m());
  const Vector3 local = (middle_W - corner_W_) / brick_m();
  return brick_within(
      static_cast<std::int32_t>(std::floor(local.x())), static_cast<std::int32_t>(std::floor(local.y())),
      static_cast<std::int32_t>(std::floor(local.z())), std::numeric_limits<double>::infinity());
}

std::uint64_t BrickMap::revision(const Vector3& corner_W) const noexcept {
  constexpr std::uint64_t kUnknownOne = 1, kFreeOne = 2, kFirst = 3;
  const Brick* brick = brick_above(corner_W);
  if (brick == nullptr || brick == &surface_brick_) return kUnknownOne;
  return brick == &free_brick_ ? kFreeOne : kFirst + brick->revision;
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
