#include "stages/planning/lattice_search.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::stages {
namespace {

// A node's state: bit 0 blocked, bit 1 closed, bit 2 by the goal's side, bits 3 and 4 opened by either side, bits 5 to 7
// the move that led to it.
constexpr std::uint8_t kBlocked = 1, kClosed = 2, kGoalSide = 4, kOpened = 8;
constexpr unsigned kMoveShift = 5;
constexpr std::uint8_t kRoot = 6;  // no move: straight from the end
/// Moves along x, y, z, there and back: m and m ^ 1 are opposite.
constexpr std::array<std::array<std::int32_t, 3>, 6> kMove{
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
constexpr double kUnit_m = 1e-3;
constexpr std::uint64_t kWeight = 2;  // of what is left
constexpr unsigned kIndexBits = 24;
constexpr std::uint32_t kPollEvery = 64;
constexpr double kPhase_m = 1e-6;
constexpr double kAroundNarrow_m = 2.0;
constexpr int kLongestRun = 1024;

std::uint32_t units(double length_m) noexcept {
  return static_cast<std::uint32_t>(std::fmin(length_m / kUnit_m + 0.5, 4e9));
}

}  // namespace

LatticeSearch::LatticeSearch(std::size_t max_nodes, core::Arena& arena) noexcept
    : state_(arena.take<std::uint8_t>(max_nodes, "lattice states")),
      state_pool_(arena.last_pool()),
      cost_(arena.take<std::uint32_t>(max_nodes, "lattice costs")),
      cost_pool_(arena.last_pool()),
      side_{Side{{kHeap, "lattice heap, start", arena}}, Side{{kHeap, "lattice heap, goal", arena}}} {
  // Most flights need none of it.
  state_pool_.use(0);
  cost_pool_.use(0);
}

bool LatticeSearch::lay_out(const PlanRequest& request, double finest_m, int cells) noexcept {
  step_m_ = cells * finest_m;
  if (cells > 1 && step_m_ > 2.0 * request.radius_m) return false;
  // Of the finest cells so many as there is room for, around the start.
  const double to_goal_m = (request.goal_W - request.start_W).cwiseAbs().maxCoeff();
  double reach_m = request.horizon_m;
  // Cells below the published ones are for what is narrow and near.
  if (step_m_ < kPublishedCell_m) reach_m = std::fmin(reach_m, 1.5 * to_goal_m + kAroundNarrow_m);
  while (!fit(request, finest_m, reach_m)) {
    reach_m *= 0.75;
    if (cells > 1 || !(reach_m > to_goal_m)) return false;
  }
  const auto nodes = static_cast<std::size_t>(size_.z) * static_cast<std::size_t>(size_.y) *
                     static_cast<std::size_t>(size_.x);
  std::fill_n(state_.begin(), nodes, std::uint8_t{0});
  for (Side& side : side_) side.opened.clear();
  side_[0].from_W = side_[1].to_W = request.start_W;
  side_[1].from_W = side_[0].to_W = request.goal_W;
  overflown_ = false;
  return true;
}

bool LatticeSearch::fit(const PlanRequest& request, double finest_m, double reach_m) noexcept {
  std::array<std::int32_t, 3> count{};
  double nodes = 1.0;
  for (int i = 0; i < 3; ++i) {
    const double low = std::fmax(request.bounds_W.min_W[i], request.start_W[i] - reach_m);
    const double high = std::fmin(request.bounds_W.max_W[i], request.start_W[i] + reach_m);
    // The vehicle in the middle of the cells that it touches, the low side of its box inside one.
    const double touched_m = std::ceil(2.0 * request.radius_m / finest_m - kPhase_m) * finest_m;
    const double phase = std::fmax(0.5 * touched_m, request.radius_m + kPhase_m);
    corner_W_[i] = std::ceil((low - phase) / finest_m) * finest_m + phase;
    const double steps = std::fmin(std::floor((high - corner_W_[i]) / step_m_), 1e6);
    if (!(steps >= 0.0)) return false;
    count[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(steps) + 1;
    nodes *= steps + 1.0;
  }
  if (nodes > static_cast<double>(state_.size())) return false;
  size_ = {count[0], count[1], count[2]};
  state_pool_.use(static_cast<std::size_t>(nodes));
  cost_pool_.use(static_cast<std::size_t>(nodes));
  return true;
}

void LatticeSearch::push(int side, std::uint32_t index, std::uint32_t cost, std::uint8_t move) noexcept {
  Side& s = side_[static_cast<std::size_t>(side)];
  const auto opened = static_cast<std::uint8_t>(kOpened << static_cast<unsigned>(side));
  std::uint8_t& state = state_[index];
  if ((state & (kBlocked | kClosed | opened)) != 0) return;
  const std::uint64_t promise = cost + kWeight * units((s.to_W - at_W(index)).norm());
  if (s.opened.push((((promise << kIndexBits) | index) << 3U) | move))
    state |= opened;
  else
    overflown_ = true;
}

void LatticeSearch::seed(const Task& task, int side) noexcept {
  const Vector3& from_W = side_[static_cast<std::size_t>(side)].from_W;
  const Vector3 local = (from_W - corner_W_) / step_m_;
  const Cell low{static_cast<std::int32_t>(std::floor(local.x())),
                 static_cast<std::int32_t>(std::floor(local.y())),
                 static_cast<std::int32_t>(std::floor(local.z()))};
  for (int corner = 0; corner < 8; ++corner) {
    const Cell c{low.x + (corner & 1), low.y + ((corner >> 1) & 1), low.z + (corner >> 2)};
    if (!inside(c)) continue;
    const Vector3 p_W = at_W(index_of(c));
    if (is_segment_free(task.view, from_W, p_W, task.request.radius_m, task.work.units))
      push(side, index_of(c), units((p_W - from_W).norm()), kRoot);
  }
}

bool LatticeSearch::is_free(const Task& task, const Vector3& p_W) const noexcept {
  const double radius_m = task.request.radius_m;
  if (task.view.is_free(Aabb::around(p_W, radius_m), task.work.units)) return true;
  // The ball is in the three boxes that are as long as it along one axis and not along the others.
  constexpr double kInscribed = 0.70711;                      // no less than the root of a half
  const bool is_fine = step_m_ < 2.5 * task.view.finest_m();  // as the cells of the memory of ways may be
  if (!is_fine || step_m_ > 2.0 * kInscribed * radius_m) return false;
  for (int axis = 0; axis < 3; ++axis) {
    Vector3 half_m = Vector3::Constant(kInscribed * radius_m);
    half_m[axis] = radius_m;
    if (!task.view.is_free({p_W - half_m, p_W + half_m}, task.work.units)) return false;
  }
  return true;
}

bool LatticeSearch::step(const Task& task, int side) noexcept {
  Side& s = side_[static_cast<std::size_t>(side)];
  const std::uint64_t entry = s.opened.pop();
  const auto move = static_cast<std::uint8_t>(entry & 7U);
  const auto at = static_cast<std::uint32_t>((entry >> 3U) & ((1U << kIndexBits) - 1U));
  std::uint8_t& state = state_[at];
  if ((state & (kBlocked | kClosed)) != 0) return false;
  const Vector3 p_W = at_W(at);
  if ((p_W - task.request.start_W).norm() > task.request.horizon_m || !is_free(task, p_W)) {
    state |= kBlocked;
    return false;
  }
  const auto bit = static_cast<std::uint8_t>(side == 1 ? kGoalSide : 0);
  state = static_cast<std::uint8_t>(state | kClosed | bit | (move << kMoveShift));
  const Cell cell = cell_of(at);
  if (move == kRoot) {
    cost_[at] = units((p_W - s.from_W).norm());
  } else {
    const auto& m = kMove[move];
    cost_[at] = cost_[index_of({cell.x - m[0], cell.y - m[1], cell.z - m[2]})] + units(step_m_);
  }
  for (std::size_t next = 0; next < kMove.size(); ++next) {
    const Cell to{cell.x + kMove[next][0], cell.y + kMove[next][1], cell.z + kMove[next][2]};
    if (!inside(to)) continue;
    const std::uint32_t index = index_of(to);
    if ((state_[index] & kClosed) != 0 && (state_[index] & kGoalSide) != bit) {
      met_[static_cast<std::size_t>(side)] = at;
      met_[static_cast<std::size_t>(1 - side)] = index;
      return true;
    }
    push(side, index, cost_[at] + units(step_m_), static_cast<std::uint8_t>(next));
  }
  return false;
}

Status LatticeSearch::run(const Task& task) noexcept {
  for (std::uint32_t i = 1; !side_[0].opened.empty() && !side_[1].opened.empty(); ++i) {
    if (i % kPollEvery == 0 && task.budget.spent(task.work)) return Status::kBudgetSpent;
    if (step(task, static_cast<int>(i % 2))) return Status::kOk;
  }
  return overflown_ ? Status::kBudgetSpent : Status::kNoPath;
}

std::uint32_t LatticeSearch::before(std::uint32_t index, int moves) const noexcept {
  Cell c = cell_of(index);
  for (; moves > 0 && state_[index] >> kMoveShift != kRoot; --moves) {
    const auto& m = kMove[static_cast<std::size_t>(state_[index] >> kMoveShift)];
    c = {c.x - m[0], c.y - m[1], c.z - m[2]};
    index = index_of(c);
  }
  return index;
}

bool LatticeSearch::walk_back(const Task& task, std::uint32_t at, int side, Path& path_W) const noexcept {
  const Vector3& end_W = side_[static_cast<std::size_t>(side)].from_W;
  const auto reaches = [&](const Vector3& p_W) {
    return is_segment_free(task.view, path_W.back(), p_W, task.request.radius_m, task.work.units);
  };
  while (state_[at] >> kMoveShift != kRoot) {
    // Straight back as far as doubled numbers of moves reach, then halved ones.
    std::uint32_t next = before(at, 1);
    int moves = 1;
    for (; moves < kLongestRun && state_[next] >> kMoveShift != kRoot; moves *= 2) {
      const std::uint32_t farther = before(next, moves);
      if (!reaches(at_W(farther))) break;
      next = farther;
    }
    for (moves /= 2; moves > 0 && state_[next] >> kMoveShift != kRoot; moves /= 2) {
      const std::uint32_t farther = before(next, moves);
      if (reaches(at_W(farther))) next = farther;
    }
    if (state_[next] >> kMoveShift == kRoot && reaches(end_W)) break;
    if (!path_W.push_back(at_W(next))) return false;
    at = next;
  }
  return path_W.push_back(end_W);
}

void LatticeSearch::extract(const Task& task, Path& path_W) noexcept {
  Path back_W;
  (void)back_W.push_back(at_W(met_[0]));
  path_W.clear();
  if (!walk_back(task, met_[0], 0, back_W)) return;
  for (std::size_t i = back_W.size(); i-- > 0;) (void)path_W.push_back(back_W[i]);
  if (!path_W.push_back(at_W(met_[1])) || !walk_back(task, met_[1], 1, path_W)) path_W.clear();
}

Status LatticeSearch::connect(const PlanRequest& request, const MapView& view, core::StageBudget& budget,
                              core::Work& work, Path& path_W) noexcept {
  const Task task{request, view, budget, work};
  path_W.clear();
  for (const int cells : kSteps) {
    if (!lay_out(request, view.finest_m(), cells)) continue;
    seed(task, 0);
    seed(task, 1);
    const Status status = run(task);
    if (status == Status::kOk) extract(task, path_W);
    if (status == Status::kBudgetSpent || path_W.size() > 1) return status;
  }
  return Status::kNoPath;
}

}  // namespace roborun::stages
