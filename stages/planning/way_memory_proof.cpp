#include <cmath>

#include "stages/planning/way_memory.hpp"

namespace roborun::stages {
namespace {

constexpr std::uint64_t kWorkOfAVisit = 8;  // lookups that a block counts as
constexpr std::uint32_t kVisitsPerPoll = 16;
constexpr std::uint32_t kMostVisits = 1U << 20U;
constexpr std::int32_t kNear = 2;  // cells: what counts as a place itself
constexpr std::int32_t kNearPlaces = (2 * kNear + 1) * (2 * kNear + 1) * (2 * kNear + 1);
constexpr std::size_t kRow = kBlockCells;

bool any(const CellRows& rows) noexcept {
  std::uint16_t all = 0;
  for (const std::uint16_t row : rows) all |= row;
  return all != 0;
}

/// Of a block's places those at one face, as the places of the block beyond it that they touch.
CellRows across(const CellRows& rows, std::size_t face) noexcept {
  CellRows beyond{};
  for (std::size_t i = 0; i < kRow; ++i) {
    for (std::size_t k = 0; k < kRow; ++k) {
      const std::size_t x_row = kRow * i + k;
      const std::size_t near = face % 2 == 0 ? 0 : kRow - 1, far = kRow - 1 - near;
      if (face / 2 == 0)
        beyond[x_row] = static_cast<std::uint16_t>(face == 0 ? rows[x_row] >> 15U : rows[x_row] << 15U);
      else if (face / 2 == 1 && k == near)
        beyond[kRow * i + near] = rows[kRow * i + far];
      else if (face / 2 == 2 && i == near)
        beyond[kRow * near + k] = rows[kRow * far + k];
    }
  }
  return beyond;
}

}  // namespace

CellRows WayMemory::find_passable(const Cell& block, const WayCells& cells, const WayCells& cells_if_sure,
                                  WayPlaces& places) const noexcept {
  WayPlaces cores;
  find_places(cells, cube_shape(core_width_), width_ - core_width_, cores);
  WayPlaces sure_cores = cores;
  if (cells_if_sure.only_sure)
    find_places(cells_if_sure, cube_shape(core_width_), width_ - core_width_, sure_cores);
  CellRows passable{};
  const std::array<std::int32_t, 3> first{kBlockCells * block.x + corner_.x,
                                          kBlockCells * block.y + corner_.y,
                                          kBlockCells * block.z + corner_.z};
  // Per axis the places whose vehicle may have its centre inside the bounds.
  std::array<unsigned, 3> inside{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<int>(axis);
    for (std::int32_t i = 0; i < kBlockCells; ++i) {
      const double centre_m = config_.finest_m * (first[axis] + i + 0.5 * core_width_);
      const bool is_inside = centre_m + 0.5 * config_.finest_m > config_.bounds_W.min_W[a] &&
                             centre_m - 0.5 * config_.finest_m < config_.bounds_W.max_W[a];
      inside[axis] |= is_inside ? 1U << static_cast<unsigned>(i) : 0U;
    }
  }
  for (unsigned i = 0; i < 256; ++i) {
    const bool is_inside = ((inside[1] >> (i % kRow)) & (inside[2] >> (i / kRow)) & 1U) != 0;
    const unsigned found = static_cast<unsigned>(sure_cores.known[i]) | sure_cores.open[i];
    unsigned row = is_inside ? found & inside[0] : 0U;
    for (unsigned bits = config_.fence.empty() ? 0U : row; bits != 0; bits &= bits - 1) {
      const int x = __builtin_ctz(bits);
      const Vector3 low(first[0] + x, first[1] + static_cast<int>(i % kRow),
                        first[2] + static_cast<int>(i / kRow));
      const Aabb cube_W{config_.finest_m * low, config_.finest_m * (low + Vector3::Constant(core_width_))};
      if (!config_.fence.allows(cube_W)) row &= ~(1U << static_cast<unsigned>(x));
    }
    places.open[i] = static_cast<std::uint16_t>(places.open[i] | (row & cores.open[i] & ~places.known[i]));
    passable[i] = static_cast<std::uint16_t>(row | places.known[i] | places.open[i]);
    places.doubtful[i] =
        static_cast<std::uint16_t>(row & sure_cores.open[i] & ~places.known[i] & ~places.open[i]);
  }
  return passable;
}

void WayMemory::pass_into(const Cell& block, const CellRows& rows, const Cell& goal) noexcept {
  const std::uint32_t position = position_of(block);
  const std::int32_t kind = kind_at(position);
  if (kind == kClosed) return;
  Node& n = node_[node_of(position, 0)];
  const bool is_new = n.reached != search_;
  if (kind < 0) {
    if (!is_new || !any(rows)) return;
  } else {
    Block& b = block_[static_cast<std::size_t>(kind)];
    if (is_new) b.passed = {};
    std::uint16_t more = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto added = static_cast<std::uint16_t>(rows[i] & b.passable[i] & ~b.passed[i]);
      b.passed[i] = static_cast<std::uint16_t>(b.passed[i] | added);
      more |= added;
    }
    if (is_new) n = {kFar, kNowhere, {}, search_, n.settled};
    if (more == 0) return;
  }
  const bool waits = !is_new && n.cost == 0;
  n = {0, kNowhere, {}, search_, n.settled};
  if (waits) return;
  const Vector3 away(block.x - goal.x, block.y - goal.y, block.z - goal.z);
  const auto blocks = static_cast<std::uint64_t>(std::fmin(away.cwiseAbs().sum(), 1e9));
  if (!reached_.push((blocks << 32U) | position)) overflown_ = true;
}

void WayMemory::pass_on(const Cell& block, const Cell& goal) noexcept {
  const std::int32_t kind = kind_at(position_of(block));
  CellRows all;
  all.fill(0xFFFF);
  if (kind >= 0) {
    Block& b = block_[static_cast<std::size_t>(kind)];
    flood(b.passable, b.passed);
    all = b.passed;
  }
  for (std::size_t face = 0; face < kFaces; ++face) {
    const Cell next{block.x + kStep[face].x, block.y + kStep[face].y, block.z + kStep[face].z};
    if (in_search(next)) pass_into(next, across(all, face), goal);
  }
}

bool WayMemory::has_passed(const Cell& place) const noexcept {
  const Cell block{place.x >> 4, place.y >> 4, place.z >> 4};
  if (!has(block)) return false;
  const std::uint32_t position = position_of(block);
  if (node_[node_of(position, 0)].reached != search_) return false;
  const std::int32_t kind = kind_at(position);
  const auto row = kRow * static_cast<std::size_t>(place.z & 15) + static_cast<std::size_t>(place.y & 15);
  return kind < 0 ||
         ((block_[static_cast<std::size_t>(kind)].passed[row] >> static_cast<unsigned>(place.x & 15)) & 1) !=
             0;
}

WayMemory::Cell WayMemory::core_at(const Vector3& p_W) const noexcept {
  const auto axis = [this](double p, std::int32_t corner) {
    return static_cast<std::int32_t>(std::floor(p / config_.finest_m - 0.5 * core_width_ + 0.5)) - corner;
  };
  return {axis(p_W.x(), corner_.x), axis(p_W.y(), corner_.y), axis(p_W.z(), corner_.z)};
}

bool WayMemory::passes_beyond(const Cell& block) const noexcept {
  const auto ends = [](std::int32_t b, std::int32_t low, std::int32_t high, std::int32_t size) {
    return (b == low && b > 0) || (b == high && b < size - 1);
  };
  return ends(block.x, low_.x, high_.x, size_.x) || ends(block.y, low_.y, high_.y, size_.y) ||
         ends(block.z, low_.z, high_.z, size_.z);
}

WayMemory::Cell WayMemory::near(const Cell& place, std::int32_t k) noexcept {
  constexpr std::int32_t kAcross = 2 * kNear + 1;
  return {place.x + k % kAcross - kNear, place.y + k / kAcross % kAcross - kNear,
          place.z + k / (kAcross * kAcross) - kNear};
}

bool WayMemory::begin_at(const Cell& place, const Cell& to) noexcept {
  const Cell block{place.x >> 4, place.y >> 4, place.z >> 4};
  if (!in_search(block)) return false;
  CellRows rows{};
  rows[kRow * static_cast<std::size_t>(place.z & 15) + static_cast<std::size_t>(place.y & 15)] =
      static_cast<std::uint16_t>(1U << static_cast<unsigned>(place.x & 15));
  pass_into(block, rows, {to.x >> 4, to.y >> 4, to.z >> 4});
  return true;
}

void WayMemory::begin_again() noexcept {
  ++search_;
  reached_.clear();
  overflown_ = false;
}

Status WayMemory::spread_to(const Cell& place, core::StageBudget& budget, core::Work& work) noexcept {
  const Cell last{place.x >> 4, place.y >> 4, place.z >> 4};
  for (std::uint32_t i = 1; !reached_.empty(); ++i) {
    if (i > kMostVisits || (i % kVisitsPerPoll == 0 && budget.spent(work))) return Status::kBudgetSpent;
    const auto position = static_cast<std::uint32_t>(reached_.pop());
    work.units += kWorkOfAVisit;
    const Cell block = block_at(position);
    if (passes_beyond(block)) return Status::kNotReady;
    node_[node_of(position, 0)].cost = kFar;
    pass_on(block, last);
    for (std::int32_t k = 0; k < kNearPlaces; ++k)
      if (has_passed(near(place, k))) return Status::kInfeasible;
  }
  return overflown_ ? Status::kBudgetSpent : Status::kNoPath;
}

Status WayMemory::may_lead(const Vector3& from_W, const Vector3& goal_W, core::StageBudget& budget,
                           core::Work& work) noexcept {
  const Cell start = core_at(from_W), goal = core_at(goal_W);
  begin_again();
  if (!begin_at(start, goal) || !has_passed(start)) return Status::kInfeasible;  // it is where nothing can be
  // The goal's side first: a shell around it is seen sooner than everything around the vehicle.
  begin_again();
  bool inside = true;
  for (std::int32_t k = 0; k < kNearPlaces; ++k) inside = begin_at(near(goal, k), start) && inside;
  const Status status = inside ? spread_to(start, budget, work) : Status::kNotReady;
  if (status != Status::kNotReady) return status;
  begin_again();
  (void)begin_at(start, goal);
  const Status other = spread_to(goal, budget, work);
  return other == Status::kNotReady ? Status::kInfeasible : other;
}

}  // namespace roborun::stages
