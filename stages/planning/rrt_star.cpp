#include "stages/planning/rrt_star.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::stages {
namespace {

constexpr double kVisitedCell_m = 4.8;
constexpr double kVisitedCell_m3 = kVisitedCell_m * kVisitedCell_m * kVisitedCell_m;
constexpr double kGoalBias = 0.15;
constexpr double kShortEdge_m = 0.3;  // a node nearer than this to another adds nothing
constexpr double kEscape_m = 2.0;
constexpr double kLookAhead_m = 12.0;  // beyond a path's end
constexpr double kDetour_m =
    10.0;  // what a surface right ahead of a path's end costs: the way around a pillar

Vector3 towards_goal(const PlanRequest& request) noexcept {
  const Vector3 way = request.goal_W - request.start_W;
  const double distance_m = way.norm();
  return distance_m <= request.horizon_m ? request.goal_W
                                         : Vector3(request.start_W + way * (request.horizon_m / distance_m));
}

}  // namespace

RrtStar::RrtStar(const Config& config, core::Arena& arena) noexcept
    : config_(config),
      node_(arena.take<Node>(config.max_nodes, "planner nodes")),
      node_pool_(arena.last_pool()),
      visited_(arena.take<std::uint64_t>(kVisited, "planner visited cells")) {}

double RrtStar::promise_m(const Node& node, const Vector3& goal_W) const noexcept {
  return node.cost_m + kUnknownWeight * (goal_W - node.p_W).norm();
}

double RrtStar::detour_m(const PlanRequest& request, const MapView& view, const Vector3& p_W,
                         std::uint64_t& lookups) const noexcept {
  const Vector3 way = request.goal_W - p_W;
  const double distance_m = way.norm();
  if (distance_m < kShortEdge_m) return 0.0;
  const Vector3 ahead = way / distance_m;
  const Vector3 side = request.radius_m * Vector3(-ahead.y(), ahead.x(), 0.0);
  const double reach_m = std::fmin(kLookAhead_m, distance_m);
  const double step_m = std::fmax(2.0 * kFinestCell_m, 0.5 * view.cell_m());
  for (double at_m = request.radius_m; at_m < reach_m; at_m += step_m) {
    for (const double share : {-1.0, 0.0, 1.0}) {
      if (view.at(p_W + at_m * ahead + share * side, lookups) != CellState::kOccupied) continue;
      return kDetour_m * (1.0 - at_m / kLookAhead_m);
    }
  }
  return 0.0;
}

Vector3 RrtStar::sample(const PlanRequest& request, core::CounterRng& rng) const noexcept {
  const double kind = rng.uniform();
  const double x = rng.uniform(-1.0, 1.0);
  const double y = rng.uniform(-1.0, 1.0);
  const double z = rng.uniform(-1.0, 1.0);
  Vector3 p_W = request.start_W + request.horizon_m * Vector3(x, y, z);
  // The flight band is thin: height is drawn inside it, not inside the sphere.
  p_W.z() = request.bounds_W.min_W.z() +
            0.5 * (z + 1.0) * (request.bounds_W.max_W.z() - request.bounds_W.min_W.z());
  if (kind < kGoalBias) p_W = towards_goal(request) + 3.0 * Vector3(x, y, z);
  return p_W.cwiseMax(request.bounds_W.min_W).cwiseMin(request.bounds_W.max_W);
}

void RrtStar::add_node(const Vector3& p_W, std::int32_t parent, double cost_m, core::Work& work) noexcept {
  node_[count_++] = {p_W, cost_m, parent};
  node_pool_.use(count_);
  std::uint64_t key = 1;
  for (int i = 0; i < 3; ++i) {
    const double index = std::clamp(std::floor(p_W[i] / kVisitedCell_m), -1e6, 1e6);
    key = (key << 21U) | static_cast<std::uint64_t>(static_cast<std::int64_t>(index) + 1048576);
  }
  std::size_t slot = core::mix64(key) % kVisited;
  // At most max_nodes keys; a table that fills up counts a cell twice, which ends the search earlier, not
  // later.
  for (std::size_t probe = 0; probe < 16; ++probe, slot = (slot + 1) % kVisited) {
    if (visited_[slot] == key) return;
    if (visited_[slot] == 0) {
      visited_[slot] = key;
      break;
    }
  }
  work.volume_m3 += kVisitedCell_m3;
}

std::size_t RrtStar::neighbours_of(const Vector3& p_W, double radius_m,
                                   std::array<Neighbour, kNeighbours>& found) const noexcept {
  // The nearest kNeighbours within the radius, nearest first; found[0] is the nearest node even if outside.
  std::size_t count = 0;
  const double radius2 = radius_m * radius_m;
  double worst2 = 1e300;
  Neighbour nearest{0, 1e300};
  for (std::size_t i = 0; i < count_; ++i) {
    const double d2 = (node_[i].p_W - p_W).squaredNorm();
    if (d2 < nearest.distance_m) nearest = {static_cast<std::int32_t>(i), d2};
    if (d2 > radius2 || (count == kNeighbours && d2 >= worst2)) continue;
    std::size_t at = count < kNeighbours ? count++ : kNeighbours - 1;
    while (at > 0 && found[at - 1].distance_m > d2) {
      found[at] = found[at - 1];
      --at;
    }
    found[at] = {static_cast<std::int32_t>(i), d2};
    worst2 = found[count - 1].distance_m;
  }
  if (count == 0) found[count++] = nearest;
  for (std::size_t i = 0; i < count; ++i) found[i].distance_m = std::sqrt(found[i].distance_m);
  return count;
}

void RrtStar::try_extend(const PlanRequest& request, const MapView& view, const Vector3& sample_W,
                         core::Work& work) noexcept {
  std::array<Neighbour, kNeighbours> near{};
  (void)neighbours_of(sample_W, 0.0, near);
  const Vector3 from_W = node_[static_cast<std::size_t>(near[0].node)].p_W;
  const double distance_m = near[0].distance_m;
  if (distance_m < kShortEdge_m) return;
  const Vector3 p_W = distance_m <= config_.step_m
                          ? sample_W
                          : Vector3(from_W + (sample_W - from_W) * (config_.step_m / distance_m));
  if ((p_W - request.start_W).norm() > request.horizon_m) return;
  if (!view.is_free(Aabb::around(p_W, request.radius_m), work.units)) return;

  const double n = static_cast<double>(count_ + 1);
  const double shrink =
      std::sqrt(std::sqrt(core::log(n) / n));  // at least the (log n / n)^(1/3) of RRT* asks for
  const double radius_m = std::fmax(config_.rewire_m * std::fmin(1.0, 1.5 * shrink), 1.5);
  const std::size_t count = neighbours_of(p_W, std::fmax(radius_m, (p_W - from_W).norm() + 1e-9), near);
  std::int32_t parent = -1;
  double cost_m = 1e300;
  std::array<bool, kNeighbours> reachable{};
  for (std::size_t i = 0; i < count; ++i) {
    const Node& candidate = node_[static_cast<std::size_t>(near[i].node)];
    if (near[i].distance_m < kShortEdge_m) return;
    if (candidate.cost_m + near[i].distance_m >= cost_m) continue;
    reachable[i] = is_segment_free(view, candidate.p_W, p_W, request.radius_m, work.units);
    if (reachable[i]) {
      parent = near[i].node;
      cost_m = candidate.cost_m + near[i].distance_m;
    }
  }
  if (parent < 0 || node_pool_.exhausted()) return;
  const auto self = static_cast<std::int32_t>(count_);
  add_node(p_W, parent, cost_m, work);
  for (std::size_t i = 0; i < count; ++i) {
    Node& other = node_[static_cast<std::size_t>(near[i].node)];
    // Costs below a rewired node are left to be corrected by extract(): they only ever get smaller.
    if (near[i].node == parent || cost_m + near[i].distance_m >= other.cost_m - 1e-9) continue;
    if (!reachable[i] && !is_segment_free(view, p_W, other.p_W, request.radius_m, work.units)) continue;
    other.parent = self;
    other.cost_m = cost_m + near[i].distance_m;
  }
}

void RrtStar::extract(const PlanRequest& request, const MapView& view, std::int32_t node,
                      PlanResult& result) noexcept {
  constexpr std::size_t kMost = PlanResult::kMaxWaypoints;
  std::array<Vector3, kMost> raw{};
  std::size_t count = 0;
  for (std::int32_t i = node; i >= 0 && count < kMost; i = node_[static_cast<std::size_t>(i)].parent) {
    raw[count++] = node_[static_cast<std::size_t>(i)].p_W;
  }
  if (raw[count - 1] != request.start_W) return;  // longer than a path may be: never seen with 6 m edges
  // From the start, always on to the farthest point that can be reached straight.
  std::size_t at = count - 1;
  (void)result.path_W.push_back(raw[at]);
  while (at > 0) {
    std::size_t next = at - 1;
    for (std::size_t far = 0; far < at - 1; ++far) {
      if (is_segment_free(view, raw[at], raw[far], request.radius_m, result.work.units)) {
        next = far;
        break;
      }
    }
    result.cost_m += (raw[next] - raw[at]).norm();
    (void)result.path_W.push_back(raw[next]);
    at = next;
  }
}

Status RrtStar::escape(const PlanRequest& request, const MapView& view, PlanResult& result) const noexcept {
  // The start box touches something that is not free: the nearest free place that can be reached without
  // touching an occupied cell, in a fixed order of directions.
  constexpr std::array<std::array<int, 3>, 10> kDirection{{{0, 0, 1},
                                                           {1, 0, 0},
                                                           {-1, 0, 0},
                                                           {0, 1, 0},
                                                           {0, -1, 0},
                                                           {1, 1, 0},
                                                           {1, -1, 0},
                                                           {-1, 1, 0},
                                                           {-1, -1, 0},
                                                           {0, 0, -1}}};
  for (double distance_m = kFinestCell_m; distance_m <= kEscape_m; distance_m += kFinestCell_m) {
    for (const auto& d : kDirection) {
      const Vector3 direction = Vector3(d[0], d[1], d[2]).normalized();
      const Vector3 end_W = request.start_W + distance_m * direction;
      if (!request.bounds_W.contains(end_W) ||
          !view.is_free(Aabb::around(end_W, request.radius_m), result.work.units))
        continue;
      bool clear = true;
      for (double at_m = 0.0; at_m < distance_m && clear; at_m += 0.5 * kFinestCell_m) {
        clear = view.at(request.start_W + at_m * direction, result.work.units) != CellState::kOccupied;
      }
      if (!clear) continue;
      (void)result.path_W.push_back(request.start_W);
      (void)result.path_W.push_back(end_W);
      result.cost_m = distance_m;
      return Status::kStartBlocked;
    }
  }
  return Status::kStartBlocked;
}

Status RrtStar::plan(const PlanRequest& request, const MapView& view, core::StageBudget& budget,
                     PlanResult& result) noexcept {
  result = {};
  const Vector3 size = request.bounds_W.size();
  if (!is_finite(request.start_W) || !is_finite(request.goal_W) || !(size.minCoeff() > 0.0) ||
      !is_finite(size) || !(request.radius_m > 0.0) || !(request.horizon_m > 0.0)) {
    return Status::kInvalidArgument;
  }
  core::Work& work = result.work;
  if (!view.is_free(Aabb::around(request.start_W, request.radius_m), work.units))
    return escape(request, view, result);
  const bool goal_bad = !request.bounds_W.contains(request.goal_W) ||
                        view.at(request.goal_W, work.units) == CellState::kOccupied;

  count_ = 0;
  std::fill(visited_.begin(), visited_.end(), 0U);
  add_node(request.start_W, -1, 0.0, work);
  const Vector3 target_W = towards_goal(request);
  const double to_target_m = (target_W - request.start_W).norm();
  std::int32_t best = 0;
  if (to_target_m > kShortEdge_m) {
    const double free_m = free_distance_m(view, request.start_W, target_W - request.start_W, request.radius_m,
                                          to_target_m, work.units);
    if (free_m > 1.0) {
      add_node(request.start_W + (target_W - request.start_W) * (free_m / to_target_m), 0, free_m, work);
      best = 1;
    }
    if (free_m >= to_target_m) {
      if (request.bounds_W.contains(target_W)) {
        extract(request, view, best, result);
        result.reaches_goal = target_W == request.goal_W;
        return goal_bad ? Status::kGoalBlocked : Status::kOk;
      }
    }
  }

  core::CounterRng rng(request.seed, 7);
  Status status = Status::kOk;
  double best_m = promise_m(node_[static_cast<std::size_t>(best)], request.goal_W) +
                  detour_m(request, view, node_[static_cast<std::size_t>(best)].p_W, work.units);
  double mark_m = best_m;
  std::uint32_t mark = 0;
  for (std::uint32_t i = 0; i < config_.max_samples && count_ < node_.size(); ++i) {
    if (work.volume_m3 >= request.volume_m3 || budget.spent(work)) {
      status = Status::kBudgetSpent;
      break;
    }
    const Vector3 sample_W = sample(request, rng);
    // Nothing that starts out longer than the best promise can become better than it.
    if ((sample_W - request.start_W).norm() > best_m) continue;
    const std::size_t before = count_;
    try_extend(request, view, sample_W, work);
    if (count_ > before) {
      double promise = promise_m(node_[count_ - 1], request.goal_W);
      if (promise < best_m) promise += detour_m(request, view, node_[count_ - 1].p_W, work.units);
      if (promise < best_m) {
        best_m = promise;
        best = static_cast<std::int32_t>(count_ - 1);
      }
      // The goal itself, when it comes within reach.
      const Vector3 way = request.goal_W - node_[count_ - 1].p_W;
      if (way.norm() <= config_.step_m && way.norm() > kShortEdge_m && count_ < node_.size() && !goal_bad &&
          (request.goal_W - request.start_W).norm() <= request.horizon_m &&
          is_segment_free(view, node_[count_ - 1].p_W, request.goal_W, request.radius_m, work.units)) {
        const double cost_m = node_[count_ - 1].cost_m + way.norm();
        if (cost_m < best_m) {
          add_node(request.goal_W, static_cast<std::int32_t>(count_ - 1), cost_m, work);
          best = static_cast<std::int32_t>(count_ - 1);
          best_m = cost_m;
        }
      }
    }
    if (best_m < 0.99 * mark_m) {
      mark_m = best_m;
      mark = i;
    }
    if (i - mark > config_.patience) break;
  }

  // Better than standing still by at least one cell of the view.
  const double stay_m =
      promise_m(node_[0], request.goal_W) + detour_m(request, view, request.start_W, work.units);
  if (best == 0 || best_m > stay_m - view.cell_m()) return goal_bad ? Status::kGoalBlocked : Status::kNoPath;
  extract(request, view, best, result);
  if (result.path_W.size() < 2) return Status::kNoPath;
  result.reaches_goal = (result.path_W.back() - request.goal_W).norm() <= view.cell_m();
  return goal_bad ? Status::kGoalBlocked : status;
}

}  // namespace roborun::stages
