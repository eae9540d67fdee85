#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "stages/planning/rrt_star.hpp"

namespace roborun::stages {
namespace {

constexpr std::uint32_t kFirstRounds = 24;  // of sampling, without a way to the goal
constexpr std::uint32_t kSidestepRounds = 24;
constexpr double kSlack = 1.03;  // a path of the tree may be so much longer than one pulled tight
constexpr double kReach_m = 30.0;
constexpr int kFirstTries = 40;  // of shortening
constexpr int kTries = 16;
constexpr std::uint32_t kShortenEvery = 32;  // samples
constexpr std::uint32_t kSpliceEvery = 2;
constexpr std::uint64_t kLatticeLookups = 400'000;

/// A budget that is spent after so many lookups, too.
class Share final : public core::StageBudget {
 public:
  Share(core::StageBudget& whole, std::uint64_t until) noexcept : whole_(whole), until_(until) {}
  [[nodiscard]] bool spent(const core::Work& done) noexcept override {
    return done.units >= until_ || whole_.spent(done);
  }

 private:
  core::StageBudget& whole_;
  std::uint64_t until_;
};

}  // namespace

std::int32_t RrtStar::advance(Search& s, std::int32_t from) noexcept {
  const Vector3& goal_W = s.request.goal_W;
  // Every step is shorter than the way that is left by the step's length, or ends at the goal.
  while (may_add()) {
    const Vector3 way = goal_W - node(from).p_W;
    const double to_goal_m = way.norm();
    if (to_goal_m <= config_.step_m) {
      if (is_segment_free(s.view, node(from).p_W, goal_W, s.request.radius_m, s.work.units))
        goal_ = add_node(goal_W, from, s.work);
      return from;
    }
    bool moved = false;
    for (double step_m = config_.step_m; step_m > 0.3 * config_.step_m && !moved; step_m *= 0.5) {
      const Vector3 p_W = node(from).p_W + way * (step_m / to_goal_m);
      if (!is_segment_free(s.view, node(from).p_W, p_W, s.request.radius_m, s.work.units)) continue;
      from = add_node(p_W, from, s.work);
      moved = step_m == config_.step_m;
      if (!moved) return from;
    }
    if (!moved) return from;
  }
  return from;
}

bool RrtStar::find_first(Search& s) noexcept {
  const PlanRequest& request = s.request;
  // Where the way straight on is blocked, of all such places the one nearest to the goal.
  std::int32_t front = advance(s, 0);
  std::uint32_t failures = 0;
  for (std::uint32_t i = 0; i < kFirstRounds && goal_ < 0 && !full(); ++i) {
    if (is_over(s)) return false;
    const double kind = s.rng.uniform();
    const double x = s.rng.uniform();
    const double y = s.rng.uniform();
    const double z = s.rng.uniform(-1.0, 1.0);
    std::int32_t from = front;
    Vector3 p_W;
    if (kind < (failures < kSidestepRounds ? 0.85 : 0.3)) {
      const Vector3 way = request.goal_W - node(front).p_W;
      const double level_m = core::hypot2(way.x(), way.y());
      const Vector3 ahead = level_m > kShortEdge_m ? Vector3(way.x() / level_m, way.y() / level_m, 0.0)
                                                   : Vector3::UnitX().eval();
      const double spread_m = 0.5 * config_.step_m + 0.5 * failures;
      const double side_m = (failures % 2 == 0 ? 1.0 : -1.0) * (0.3 + y) * spread_m;
      p_W = node(front).p_W + x * config_.step_m * ahead + side_m * Vector3(-ahead.y(), ahead.x(), 0.0) +
            Vector3(0.0, 0.0, 0.15 * z * spread_m);
    } else {
      p_W = request.bounds_W.min_W + Vector3(x, y, 0.5 * (z + 1.0)).cwiseProduct(request.bounds_W.size());
      const NodeGrid::Near nearest = grid_.nearest(p_W);
      from = nearest.index;
      const double most_m = 2.0 * config_.step_m;
      if (nearest.distance_m > most_m)
        p_W = node(from).p_W + (p_W - node(from).p_W) * (most_m / nearest.distance_m);
    }
    p_W = p_W.cwiseMax(request.bounds_W.min_W).cwiseMin(request.bounds_W.max_W);
    ++failures;
    if ((p_W - node(from).p_W).norm() < kShortEdge_m || (p_W - request.start_W).norm() > request.horizon_m ||
        !is_segment_free(s.view, node(from).p_W, p_W, request.radius_m, s.work.units) || !may_add())
      continue;
    const std::int32_t end = advance(s, add_node(p_W, from, s.work));
    const double gain_m = (request.goal_W - node(front).p_W).norm() - (request.goal_W - node(end).p_W).norm();
    if (gain_m < 0.5) continue;
    front = end;
    failures = 0;
  }
  return goal_ >= 0;
}

bool RrtStar::path_to(std::int32_t index, Path& path_W) const noexcept {
  path_W.clear();
  for (std::int32_t i = index; i >= 0; i = node_[static_cast<std::size_t>(i)].parent) {
    if (!path_W.push_back(node_[static_cast<std::size_t>(i)].p_W)) return false;
  }
  std::reverse(path_W.begin(), path_W.end());
  return true;
}

void RrtStar::add_path(const Path& path_W, core::Work& work) noexcept {
  std::int32_t parent = 0;
  for (std::size_t i = 1; i + 1 < path_W.size() && may_add(); ++i) parent = add_node(path_W[i], parent, work);
  const double cost_m = node(parent).cost_m + (node(goal_).p_W - node(parent).p_W).norm();
  if (parent > 0 && node(parent).p_W == path_W[path_W.size() - 2] && cost_m < node(goal_).cost_m)
    reparent(goal_, parent, cost_m);
}

Vector3 RrtStar::informed_sample(Search& s, double bound_m) const noexcept {
  // Uniform in the prolate spheroid whose foci are start and goal. Source: Gammell et al. (2014).
  const Aabb& bounds_W = s.request.bounds_W;
  const Vector3 way = s.request.goal_W - s.request.start_W;
  const double least_m = way.norm();
  const Vector3 a = way / least_m;
  const Vector3 b = a.cross(std::fabs(a.z()) < 0.9 ? Vector3::UnitZ() : Vector3::UnitX()).normalized();
  const Vector3 c = a.cross(b);
  const double major_m = 0.5 * bound_m;
  const double minor_m = 0.5 * std::sqrt(std::fmax(bound_m * bound_m - least_m * least_m, 0.0));
  const Vector3 center_W = 0.5 * (s.request.start_W + s.request.goal_W);
  Vector3 p_W = center_W;
  for (int attempt = 0; attempt < 32; ++attempt) {
    const double x = s.rng.uniform(-1.0, 1.0);
    const double y = s.rng.uniform(-1.0, 1.0);
    const double z = s.rng.uniform(-1.0, 1.0);
    if (x * x + y * y + z * z > 1.0) continue;
    p_W = center_W + major_m * x * a + minor_m * (y * b + z * c);
    if (bounds_W.contains(p_W)) return p_W;
  }
  return p_W.cwiseMax(bounds_W.min_W).cwiseMin(bounds_W.max_W);
}

bool RrtStar::splice(Search& s, std::int32_t from, const Path& best_W, double bound_m,
                     Path& candidate_W) const noexcept {
  const Vector3& from_W = node_[static_cast<std::size_t>(from)].p_W;
  // On from the first way-point that is nearer to the goal.
  double rest_m = length_m(best_W);
  std::size_t at = 0;
  const double to_goal_m = (s.request.goal_W - from_W).norm();
  for (; at + 1 < best_W.size() && (s.request.goal_W - best_W[at]).norm() > to_goal_m - kShortEdge_m; ++at)
    rest_m -= (best_W[at + 1] - best_W[at]).norm();
  const double total_m = node_[static_cast<std::size_t>(from)].cost_m + (best_W[at] - from_W).norm() + rest_m;
  if (total_m > bound_m || !path_to(from, candidate_W) ||
      !is_segment_free(s.view, from_W, best_W[at], s.request.radius_m, s.work.units))
    return false;
  for (; at < best_W.size(); ++at) {
    if (!candidate_W.push_back(best_W[at])) return false;
  }
  return true;
}

std::int32_t RrtStar::grow(Search& s, double best_m) noexcept {
  const std::int32_t added = try_extend(s, informed_sample(s, best_m), kSlack * best_m);
  if (added < 0 || full()) return added;
  const Vector3& goal_W = s.request.goal_W;
  const double to_goal_m = (goal_W - node(added).p_W).norm();
  const double cost_m = node(added).cost_m + to_goal_m;
  if (to_goal_m <= config_.step_m && cost_m < node(goal_).cost_m &&
      is_segment_free(s.view, node(added).p_W, goal_W, s.request.radius_m, s.work.units))
    reparent(goal_, added, cost_m);
  return added;
}

Status RrtStar::improve(Search& s, double best_m, Path& best_W) noexcept {
  const PlanRequest& request = s.request;
  const double straight_m = (request.goal_W - request.start_W).norm();
  Patience patience(best_m, config_.patience);
  for (std::uint32_t i = 0; i < config_.max_samples && !full(); ++i) {
    // Good enough, or as short as any path can be.
    if (best_m <= std::fmax(request.satisfied_m, straight_m * 1.0001)) break;
    if (is_over(s)) return Status::kBudgetSpent;
    const double before_m = node(goal_).cost_m;
    const std::int32_t added = grow(s, best_m);
    // A path to pull tight: the tree's new one, or one around the other side of an obstacle, or once in a while
    // the best one again, with other draws.
    Path candidate_W;
    const bool other =
        node(goal_).cost_m < before_m - 1e-6
            ? path_to(goal_, candidate_W)
            : added >= 0 && i % kSpliceEvery == 0 && splice(s, added, best_W, kSlack * best_m, candidate_W);
    if (other || i % kShortenEvery == 0) {
      if (!other) candidate_W = best_W;
      const double candidate_m =
          shorten(s.view, request.radius_m, kReach_m, kTries, s.rng, candidate_W, s.work.units);
      if (candidate_m < best_m - 1e-9) {
        best_m = candidate_m;
        best_W = candidate_W;
        if (best_m < node(goal_).cost_m - 1e-3) add_path(best_W, s.work);
      }
    }
    if (patience.is_over(best_m, i)) break;
  }
  return Status::kOk;
}

Status RrtStar::search_lattice(Search& s, const PlanRequest& request, Path& path_W) noexcept {
  if (request.ways == nullptr) return lattice_.connect(request, s.view, s.budget, s.work, path_W);
  Share share(s.budget, s.work.units + kLatticeLookups);
  return lattice_.connect(request, s.view, share, s.work, path_W);
}

bool RrtStar::find_on_lattice(Search& s) noexcept {
  Path path_W;
  clear(s);
  if (search_lattice(s, s.request, path_W) != Status::kOk || path_W.size() + 1 > node_.size()) return false;
  std::int32_t parent = 0;
  for (std::size_t i = 1; i < path_W.size() && may_add(); ++i) parent = add_node(path_W[i], parent, s.work);
  if (node(parent).p_W != s.request.goal_W) return false;
  goal_ = parent;
  return true;
}

Status RrtStar::connect(Search& s, PlanResult& result) noexcept {
  if (find_first(s) || find_on_lattice(s)) return tighten(s, result);
  clear(s);
  return Status::kNoPath;
}

Status RrtStar::tighten(Search& s, PlanResult& result) noexcept {
  const PlanRequest& request = s.request;
  Path best_W;
  if (!path_to(goal_, best_W)) {
    clear(s);
    return Status::kNoPath;
  }
  Status status = Status::kOk;
  if (!(node(goal_).cost_m <= request.satisfied_m)) {
    const double best_m =
        shorten(s.view, request.radius_m, kReach_m, kFirstTries, s.rng, best_W, s.work.units);
    add_path(best_W, s.work);
    status = improve(s, best_m, best_W);
  }
  result.path_W = best_W;
  result.cost_m = length_m(best_W);
  result.reaches_goal = true;
  return status;
}

}  // namespace roborun::stages
