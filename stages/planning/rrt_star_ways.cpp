#include <algorithm>
#include <cmath>

#include "stages/perception/swept_ball.hpp"
#include "stages/planning/rrt_star.hpp"
#include "stages/planning/ways.hpp"

namespace roborun::stages {
namespace {

constexpr double kKnownReach_m = 15.0;
constexpr double kShortest_m = 1.0;  // of a way worth going
constexpr std::size_t kAhead = 6;    // corners that are tried from one of them
constexpr int kChained = 12;         // searches between corners
constexpr int kSampled = 4;          // searches of the whole way
constexpr double kAround_m = 2.5;    // between two corners a way bends no farther than that
constexpr double kApart_m = 0.01;
constexpr int kShortenings = 40;  // of shortening

}  // namespace

bool RrtStar::follow_ways(Search& s, const MapView& map, double below_m, PlanResult& result) noexcept {
  std::array<Vector3, kMaxWaypoints> way_W;
  // What is known may be farther away than sensors reach.
  const double reach_m = std::fmax(s.request.horizon_m, kKnownReach_m);
  const std::size_t count = s.request.ways->known_way(s.request.start_W, reach_m - 1.0, way_W);
  const auto rest_m = [&s](const Vector3& p_W) { return kUnknownWeight * s.request.ways->to_goal_m(p_W); };
  // Nearer to the goal than the start in any case: who goes there does not come back.
  const double nearer_m = rest_m(s.request.start_W) - map.cell_m();
  const auto pays = [&](const Vector3& p_W, double length_m) {
    const double to_goal_m = rest_m(p_W);
    return to_goal_m < nearer_m && length_m + to_goal_m < below_m;
  };
  int rounds = 0;
  for (std::size_t i = count; i-- > 0 && rounds < kSampled;) {
    const double straight_m = (way_W[i] - s.request.start_W).norm();
    if (straight_m < kShortest_m || !pays(way_W[i], straight_m) ||
        !is_ball_free(map, way_W[i], s.request.radius_m, s.work.units))
      continue;
    PlanRequest request = s.request;
    request.goal_W = way_W[i];
    request.horizon_m = reach_m;
    Search to_it{request, s.view, s.budget, s.work, s.rng};
    clear(to_it);
    PlanResult found;
    ++rounds;
    if (find_first(to_it)) {
      (void)tighten(to_it, found);
    } else {
      found.path_W = chain(to_it, std::span(way_W).first(i + 1));
      found.cost_m =
          shorten(s.view, request.radius_m, reach_m, kShortenings, s.rng, found.path_W, s.work.units);
      rounds = kSampled;
    }
    if (found.path_W.size() < 2 || found.cost_m < kShortest_m || !pays(found.path_W.back(), found.cost_m))
      continue;
    result.path_W = found.path_W;
    result.cost_m = found.cost_m;
    return true;
  }
  return false;
}

Path RrtStar::chain(Search& s, std::span<const Vector3> way_W) noexcept {
  const double radius_m = s.request.radius_m;
  Path path_W;
  (void)path_W.push_back(s.request.start_W);
  int searches = 0;
  for (std::size_t at = 0; at < way_W.size();) {
    const std::size_t end = std::min(at + kAhead, way_W.size());
    std::size_t next = end;
    while (next > at && !is_segment_free(s.view, path_W.back(), way_W[next - 1], radius_m, s.work.units))
      --next;
    if (next > at) {
      const bool is_apart = (way_W[next - 1] - path_W.back()).norm() > kApart_m;
      if (is_apart && !path_W.push_back(way_W[next - 1])) return path_W;
      at = next;
      continue;
    }
    // To the next corner that has room, or else to one after it.
    Path piece_W;
    for (next = at; next < end && piece_W.empty(); ++next) {
      PlanRequest piece = s.request;
      piece.start_W = path_W.back();
      piece.goal_W = way_W[next];
      piece.horizon_m = (piece.goal_W - piece.start_W).norm() + kAround_m;
      const Vector3 around = Vector3::Constant(kAround_m);
      piece.bounds_W.min_W = s.request.bounds_W.min_W.cwiseMax(piece.start_W.cwiseMin(piece.goal_W) - around);
      piece.bounds_W.max_W = s.request.bounds_W.max_W.cwiseMin(piece.start_W.cwiseMax(piece.goal_W) + around);
      if (!is_ball_free(s.view, piece.goal_W, radius_m, s.work.units)) continue;
      if (++searches > kChained || search_lattice(s, piece, piece_W) == Status::kBudgetSpent) return path_W;
    }
    if (piece_W.size() < 2 || path_W.size() + piece_W.size() > Path::capacity()) return path_W;
    for (std::size_t i = 1; i < piece_W.size(); ++i) (void)path_W.push_back(piece_W[i]);
    at = next;
  }
  return path_W;
}

}  // namespace roborun::stages
