#include "stages/planning/rrt_star.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/math.hpp"
#include "firmware_if/assert.hpp"
#include "stages/perception/polled_view.hpp"
#include "stages/perception/swept_ball.hpp"

namespace roborun::stages {
namespace {

constexpr double kVisitedCell_m = 4.8;
constexpr double kVisitedCell_m3 = kVisitedCell_m * kVisitedCell_m * kVisitedCell_m;
constexpr double kGoalBias = 0.15;
constexpr std::uint64_t kSpare = 4096;  // lookups that are granted whatever the budget says
constexpr double kLookAhead_m = 12.0;   // beyond a path's end
// What a surface right ahead of a path's end costs: the way around a pillar.
constexpr double kDetour_m = 10.0;
// The memory's lengths are a metre or two off, for they lead through its places. Where nothing is known to stand beyond the straight
// way, another one has to save this share of it: a fast vehicle brakes for each path that is a little shorter than the one before.
constexpr double kOpenShare = 0.5;

Vector3 towards_goal(const PlanRequest& request) noexcept {
  const Vector3 way = request.goal_W - request.start_W;
  const double distance_m = way.norm();
  return distance_m <= request.horizon_m ? request.goal_W
                                         : Vector3(request.start_W + way * (request.horizon_m / distance_m));
}

/// False if the ways to the goal lead elsewhere: a step straight at it should save half its length of them.
bool leads_on(const PlanRequest& request, const Vector3& target_W) noexcept {
  if (request.ways == nullptr) return true;
  const double saved_m = request.ways->to_goal_m(request.start_W) - request.ways->to_goal_m(target_W);
  return saved_m >= 0.5 * (target_W - request.start_W).norm();
}

/// False if a path to the goal in known space would have to wind: it is no shorter than the ways are. A search for one that is
/// not there takes all the time there is.
bool may_be_known(const PlanRequest& request) noexcept {
  constexpr double kMostHorizons = 4.0;
  const double way_m = request.ways != nullptr ? request.ways->to_goal_m(request.start_W) : 0.0;
  return way_m <= kMostHorizons * request.horizon_m || std::isinf(way_m);
}

using Samples = core::StaticVector<Vector3, 2 * kMaxWaypoints>;

/// Points along a path inside the bounds, none farther than a step from the one before.
Samples in_steps(const Path& path_W, double step_m, const Aabb& bounds_W) noexcept {
  Samples points_W;
  for (std::size_t i = 0; i + 1 < path_W.size(); ++i) {
    const Vector3 way = path_W[i + 1] - path_W[i];
    const int steps = std::max(static_cast<int>(std::fmin(std::ceil(way.norm() / step_m), 64.0)), 1);
    for (int k = 1; k <= steps; ++k) {
      const Vector3 p_W = path_W[i] + way * (static_cast<double>(k) / steps);
      if (bounds_W.contains(p_W)) (void)points_W.push_back(p_W);
    }
  }
  return points_W;
}

bool is_well_posed(const PlanRequest& request) noexcept {
  const Vector3 size = request.bounds_W.size();
  return is_finite(request.start_W) && is_finite(request.goal_W) && size.minCoeff() > 0.0 &&
         is_finite(size) && request.radius_m > 0.0 && request.horizon_m > 0.0;
}

/// A fixed number of lookups.
class Spare final : public core::StageBudget {
 public:
  explicit Spare(const core::Work& work) noexcept : until_(work.units + kSpare) {}
  [[nodiscard]] bool spent(const core::Work& done) noexcept override { return done.units >= until_; }

 private:
  std::uint64_t until_;
};

}  // namespace

RrtStar::RrtStar(const Config& config, core::Arena& arena) noexcept
    : config_(config),
      node_(arena.take<Node>(config.max_nodes, "planner nodes")),
      node_pool_(arena.last_pool()),
      visited_(arena.take<std::uint64_t>(kVisited, "planner visited cells")),
      visited_pool_(arena.last_pool()),
      grid_(config.max_nodes, arena),
      lattice_(config.lattice_nodes, arena) {
  ROBORUN_ASSERT(config.validate() == Status::kOk);
}

double RrtStar::promise_m(const Node& node, const PlanRequest& request) const noexcept {
  if (request.ways != nullptr) return node.cost_m + kUnknownWeight * request.ways->to_goal_m(node.p_W);
  return node.cost_m + kUnknownWeight * (request.goal_W - node.p_W).norm();
}

double RrtStar::detour_m(const PlanRequest& request, const MapView& view, const Vector3& p_W,
                         std::uint64_t& lookups) const noexcept {
  if (request.ways != nullptr) return 0.0;  // they know
  const double free_m = free_ahead_m(request, view, p_W, lookups);
  return free_m < kLookAhead_m ? kDetour_m * (1.0 - free_m / kLookAhead_m) : 0.0;
}

double RrtStar::free_ahead_m(const PlanRequest& request, const MapView& view, const Vector3& p_W,
                             std::uint64_t& lookups) noexcept {
  const Vector3 way = request.goal_W - p_W;
  const double distance_m = way.norm();
  if (distance_m < kShortEdge_m) return kLookAhead_m;
  const Vector3 ahead = way / distance_m;
  const Vector3 side = request.radius_m * Vector3(-ahead.y(), ahead.x(), 0.0);
  const double reach_m = std::fmin(kLookAhead_m, distance_m);
  // Of a wall only the first layer of cells may be known.
  const double step_m = std::fmax(view.finest_m(), 0.5 * view.cell_m());
  for (double at_m = request.radius_m; at_m < reach_m; at_m += step_m) {
    for (const double share : {-1.0, 0.0, 1.0}) {
      if (view.at(p_W + at_m * ahead + share * side, lookups) == CellState::kOccupied) return at_m;
    }
  }
  return kLookAhead_m;
}

Vector3 RrtStar::sample(Search& s) const noexcept {
  const PlanRequest& request = s.request;
  core::CounterRng& rng = s.rng;
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

std::int32_t RrtStar::add_node(const Vector3& p_W, std::int32_t parent, core::Work& work) noexcept {
  const auto index = static_cast<std::int32_t>(count_);
  node_[count_++] = {p_W, 0.0, parent, -1, -1};
  node_pool_.use(count_);
  grid_.insert(p_W);
  if (parent >= 0) {
    Node& self = node_[count_ - 1];
    self.cost_m = node(parent).cost_m + (p_W - node(parent).p_W).norm();
    self.next_sibling = node(parent).first_child;
    node(parent).first_child = index;
  }
  std::uint64_t key = 1;
  for (int i = 0; i < 3; ++i) {
    const double cell = std::clamp(std::floor(p_W[i] / kVisitedCell_m), -1e6, 1e6);
    key = (key << 21U) | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + 1048576);
  }
  std::size_t slot = core::mix64(key) % kVisited;
  // At most max_nodes keys; a table that fills up counts a cell twice, which ends the search earlier, not
  // later.
  for (std::size_t probe = 0; probe < 16; ++probe, slot = (slot + 1) % kVisited) {
    if (visited_[slot] == key) return index;
    if (visited_[slot] == 0) {
      visited_[slot] = key;
      visited_pool_.use(++visited_count_);
      break;
    }
  }
  work.volume_m3 += kVisitedCell_m3;
  return index;
}

void RrtStar::reparent(std::int32_t child, std::int32_t parent, double cost_m) noexcept {
  std::int32_t* link = &node(node(child).parent).first_child;
  while (*link != child) link = &node(*link).next_sibling;
  *link = node(child).next_sibling;
  node(child).parent = parent;
  node(child).next_sibling = node(parent).first_child;
  node(parent).first_child = child;
  const double gain_m = node(child).cost_m - cost_m;
  // The subtree in depth-first order; the links themselves say where to go on.
  for (std::int32_t at = child;;) {
    node(at).cost_m -= gain_m;
    if (node(at).first_child >= 0) {
      at = node(at).first_child;
      continue;
    }
    while (at != child && node(at).next_sibling < 0) at = node(at).parent;
    if (at == child) return;
    at = node(at).next_sibling;
  }
}

std::int32_t RrtStar::try_extend(Search& s, const Vector3& sample_W, double bound_m) noexcept {
  const PlanRequest& request = s.request;
  const NodeGrid::Near nearest = grid_.nearest(sample_W);
  const Vector3 from_W = node(nearest.index).p_W;
  if (nearest.distance_m < kShortEdge_m) return -1;
  const Vector3 p_W = nearest.distance_m <= config_.step_m
                          ? sample_W
                          : Vector3(from_W + (sample_W - from_W) * (config_.step_m / nearest.distance_m));
  const double from_start_m = (p_W - request.start_W).norm();
  const double to_goal_m = (request.goal_W - p_W).norm();
  if (from_start_m > request.horizon_m || from_start_m + to_goal_m >= bound_m) return -1;
  if (!is_ball_free(s.view, p_W, request.radius_m, s.work.units)) return -1;

  const double n = static_cast<double>(count_ + 1);
  // At least the (log n / n)^(1/3) that RRT* asks for.
  const double shrink = std::sqrt(std::sqrt(core::log(n) / n));
  const double radius_m = std::fmax(config_.rewire_m * std::fmin(1.0, 1.5 * shrink), 1.5);
  Neighbours near{};
  const std::size_t count = grid_.within(p_W, std::fmax(radius_m, (p_W - from_W).norm() + 1e-9), near);
  if (count == 0 || near[0].distance_m < kShortEdge_m) return -1;
  // By cost: the first one that can be reached is the best parent, and no other one is checked.
  std::array<std::size_t, kNeighbours> order{};
  const auto cost_by = [&](std::size_t i) { return node(near[i].index).cost_m + near[i].distance_m; };
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t at = i;
    for (; at > 0 && cost_by(order[at - 1]) > cost_by(i); --at) order[at] = order[at - 1];
    order[at] = i;
  }
  std::int32_t self = -1;
  std::size_t tried = 0;
  for (; tried < count && self < 0; ++tried) {
    const NodeGrid::Near& candidate = near[order[tried]];
    if (cost_by(order[tried]) + to_goal_m >= bound_m) return -1;
    if (!is_segment_free(s.view, node(candidate.index).p_W, p_W, request.radius_m, s.work.units)) continue;
    if (!may_add()) return -1;
    self = add_node(p_W, candidate.index, s.work);
  }
  if (self < 0) return -1;
  const double cost_m = node(self).cost_m;
  for (std::size_t i = tried; i < count; ++i) {
    const NodeGrid::Near& other = near[order[i]];
    if (cost_m + other.distance_m >= node(other.index).cost_m - 1e-9) continue;
    if (is_segment_free(s.view, p_W, node(other.index).p_W, request.radius_m, s.work.units))
      reparent(other.index, self, cost_m + other.distance_m);
  }
  return self;
}

void RrtStar::extract(const PlanRequest& request, const MapView& view, std::int32_t node,
                      PlanResult& result) noexcept {
  constexpr std::size_t kMost = kMaxWaypoints;
  std::array<Vector3, kMost> raw;
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

void RrtStar::clear(Search& s) noexcept {
  const PlanRequest& request = s.request;
  count_ = 0;
  goal_ = -1;
  std::fill(visited_.begin(), visited_.end(), 0U);
  visited_count_ = 0;
  const Vector3 reach = Vector3::Constant(request.horizon_m);
  grid_.reset({request.bounds_W.min_W.cwiseMax(request.start_W - reach),
               request.bounds_W.max_W.cwiseMin(request.start_W + reach)});
  add_node(request.start_W, -1, s.work);
}

Status RrtStar::plan(const PlanRequest& request, const MapView& map, core::StageBudget& budget,
                     PlanResult& result) noexcept {
  result = {};
  if (!is_well_posed(request)) return Status::kInvalidArgument;
  core::Work& work = result.work;
  const PolledView view(map, budget, work);
  Spare spare(work);
  const PolledView spare_view(map, spare, work);
  if (!is_ball_free(map, request.start_W, request.radius_m, work.units)) return Status::kStartBlocked;
  const bool goal_bad = !request.bounds_W.contains(request.goal_W) ||
                        view.at(request.goal_W, work.units) == CellState::kOccupied;

  Search s{request, view, budget, work, core::CounterRng(request.seed, 7)};
  clear(s);
  const Vector3 target_W = towards_goal(request);
  const double to_target_m = (target_W - request.start_W).norm();
  // 1. The goal is known free space: a path that ends there.
  if (to_target_m > kShortEdge_m && target_W == request.goal_W && !goal_bad && may_be_known(request) &&
      is_ball_free(view, target_W, request.radius_m, work.units)) {
    const Status status = connect(s, result);
    if (status != Status::kNoPath) return status;
  }
  // 2. The straight way, if it is free to its end; otherwise its free part is the first branch of the tree.
  std::int32_t best = 0;
  if (to_target_m > kShortEdge_m) {
    const double free_m = free_distance_m(spare_view, request.start_W, target_W - request.start_W,
                                          request.radius_m, to_target_m, work.units);
    if (free_m > 1.0) {
      const Vector3 end_W = request.start_W + (target_W - request.start_W) * (free_m / to_target_m);
      // Checked once more: this is an edge, and its samples lie elsewhere.
      if (is_segment_free(spare_view, request.start_W, end_W, request.radius_m, work.units) && may_add())
        best = add_node(end_W, 0, work);
    }
    if (best > 0 && free_m >= to_target_m && request.bounds_W.contains(target_W) &&
        leads_on(request, target_W)) {
      extract(request, spare_view, best, result);
      result.reaches_goal = target_W == request.goal_W;
      return goal_bad ? Status::kGoalBlocked : Status::kOk;
    }
  }
  // 3. As near to the goal as known free space reaches.
  return explore(s, map, goal_bad, best, result);
}

RrtStar::Branch RrtStar::prefer_straight(Search& s, const MapView& map, double moves_m,
                                         const Branch& straight, const Branch& best) noexcept {
  if (straight.node == 0 || straight.promise_m > moves_m) return best;
  const double open_m = std::fmax(kOpenShare * node(straight.node).cost_m, straight.margin_m);
  if (best.promise_m <= straight.promise_m - open_m) return best;
  Spare spare(s.work);
  const PolledView view(map, spare, s.work);
  if (free_ahead_m(s.request, view, node(straight.node).p_W, s.work.units) < kLookAhead_m) return best;
  return {straight.node, straight.promise_m, open_m};
}

Status RrtStar::explore(Search& s, const MapView& map, bool goal_bad, std::int32_t best,
                        PlanResult& result) noexcept {
  const PlanRequest& request = s.request;
  const MapView& view = s.view;
  core::Work& work = s.work;
  Status status = Status::kOk;
  double best_m = promise_m(node(best), request) + detour_m(request, view, node(best).p_W, work.units);
  const Branch straight{best, best_m, view.cell_m()};
  Patience patience(best_m, config_.patience);
  const Samples kept_W = in_steps(request.kept_W, config_.step_m, request.bounds_W);
  for (std::uint32_t i = 0; i < config_.max_samples && !full(); ++i) {
    if (is_over(s)) {
      status = Status::kBudgetSpent;
      break;
    }
    const Vector3 sample_W = i < kept_W.size() ? kept_W[i] : sample(s);
    // Nothing that starts out longer than the best promise can become better than it.
    if ((sample_W - request.start_W).norm() > best_m) continue;
    const std::int32_t added = try_extend(s, sample_W, std::numeric_limits<double>::infinity());
    if (added >= 0) {
      double promise = promise_m(node(added), request);
      if (promise < best_m) promise += detour_m(request, view, node(added).p_W, work.units);
      if (promise < best_m) {
        best_m = promise;
        best = added;
      }
    }
    if (patience.is_over(best_m, i)) break;
  }

  // Better than standing still by at least one cell of the view.
  const double stay_m = promise_m(node(0), request) + detour_m(request, view, request.start_W, work.units);
  const double moves_m = stay_m - view.cell_m();
  const Branch chosen = prefer_straight(s, map, moves_m, straight, {best, best_m, view.cell_m()});
  const bool moves = chosen.node != 0 && chosen.promise_m <= moves_m;
  // A known way is as long as its corners are apart, and may wind much more: where nothing else leads on it need not pay.
  const double below_m = moves ? chosen.promise_m - chosen.margin_m : std::numeric_limits<double>::infinity();
  if (request.ways != nullptr && follow_ways(s, map, below_m, result))
    return goal_bad ? Status::kGoalBlocked : Status::kOk;
  if (!moves) return goal_bad ? Status::kGoalBlocked : Status::kNoPath;
  Spare spare(work);
  extract(request, PolledView(map, spare, work), chosen.node, result);
  if (result.path_W.size() < 2) return Status::kNoPath;
  result.reaches_goal = (result.path_W.back() - request.goal_W).norm() <= view.cell_m();
  return goal_bad ? Status::kGoalBlocked : status;
}

}  // namespace roborun::stages
