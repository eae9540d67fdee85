#include "stages/planning/way_out.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "stages/perception/polled_view.hpp"
#include "stages/perception/swept_ball.hpp"

namespace roborun::stages {
namespace {

constexpr double kDistance_m = 0.1;  // from one try to the next: two surfaces may leave less than a cell
constexpr int kDistances = 20;
constexpr double kStep_m = 0.05;  // between two looks at the distance to a cell: it is off by 2 mm at most
constexpr double kInside_m = 1e-6;
// Level ones first, and none downwards before all others.
constexpr std::array<std::array<int, 3>, 26> kDirection{
    {{0, 0, 1},   {1, 0, 0},   {-1, 0, 0},  {0, 1, 0},   {0, -1, 0},  {1, 1, 0},   {1, -1, 0},
     {-1, 1, 0},  {-1, -1, 0}, {1, 0, 1},   {-1, 0, 1},  {0, 1, 1},   {0, -1, 1},  {1, 1, 1},
     {1, -1, 1},  {-1, 1, 1},  {-1, -1, 1}, {0, 0, -1},  {1, 0, -1},  {-1, 0, -1}, {0, 1, -1},
     {0, -1, -1}, {1, 1, -1},  {1, -1, -1}, {-1, 1, -1}, {-1, -1, -1}}};

/// One straight piece.
struct Piece {
  Vector3 from_W, direction_W;
  double length_m;
  [[nodiscard]] Vector3 at_W(double at_m) const noexcept { return from_W + at_m * direction_W; }
};

double distance_m(const Vector3& p_W, const Aabb& box_W) noexcept {
  return (p_W - p_W.cwiseMax(box_W.min_W).cwiseMin(box_W.max_W)).norm();
}

/// What is in the cell comes no nearer to a body of this radius than the radius, or than it is at the start.
bool keeps_off(const Piece& piece, const Aabb& cell_W, double body_m) noexcept {
  const Vector3 low = cell_W.min_W - piece.from_W, high = cell_W.max_W - piece.from_W;
  const Vector3& d = piece.direction_W;
  const double ahead_m = low.cwiseProduct(d).cwiseMax(high.cwiseProduct(d)).sum();
  if (ahead_m <= 0.0) return true;  // all of it is behind
  for (double at_m = 0.0; at_m < piece.length_m; at_m += kStep_m)
    if (distance_m(piece.at_W(at_m), cell_W) < body_m) return false;
  return true;
}

/// Of all cells that the body's box touches and that are not free.
bool keeps_off_all(const Piece& piece, const MapView& known, double body_m, std::uint64_t& lookups) noexcept {
  const Aabb box_W = Aabb::around(piece.from_W, body_m);
  const Vector3 inside = Vector3::Constant(kInside_m);
  const double cell_m = known.finest_m();
  const auto first = [cell_m](double p) { return std::floor(p / cell_m); };
  for (double z = first(box_W.min_W.z()); z <= first(box_W.max_W.z()); ++z) {
    for (double y = first(box_W.min_W.y()); y <= first(box_W.max_W.y()); ++y) {
      for (double x = first(box_W.min_W.x()); x <= first(box_W.max_W.x()); ++x) {
        const Vector3 corner_W = cell_m * Vector3(x, y, z);
        const Aabb cell_W{corner_W, corner_W + Vector3::Constant(cell_m)};
        if (known.is_free_at_finest({cell_W.min_W + inside, cell_W.max_W - inside}, lookups)) continue;
        if (!keeps_off(piece, cell_W, body_m)) return false;
      }
    }
  }
  return true;
}

}  // namespace

bool StandingView::is_rest_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept {
  if (!is_finite(box_W.min_W) || !is_finite(box_W.max_W) || (box_W.min_W.array() > box_W.max_W.array()).any())
    return false;
  // What sticks out of its six faces, one after the other.
  Aabb rest_W = box_W;
  for (int i = 0; i < 3; ++i) {
    if (rest_W.min_W[i] < standing_W_.min_W[i]) {
      Aabb low_W = rest_W;
      low_W.max_W[i] = std::min(rest_W.max_W[i], standing_W_.min_W[i]);
      if (!view_.is_free(low_W, lookups)) return false;
      rest_W.min_W[i] = standing_W_.min_W[i];
    }
    if (rest_W.max_W[i] > standing_W_.max_W[i]) {
      Aabb high_W = rest_W;
      high_W.min_W[i] = std::max(rest_W.min_W[i], standing_W_.max_W[i]);
      if (!view_.is_free(high_W, lookups)) return false;
      rest_W.max_W[i] = standing_W_.max_W[i];
    }
    if (rest_W.min_W[i] > rest_W.max_W[i]) return true;  // nothing is left
  }
  return true;
}

bool find_way_out(const WayOutRequest& request, const MapView& view, const MapView& known,
                  core::StageBudget& budget, core::Work& work, Trajectory& out) noexcept {
  const PolledView polled(view, budget, work);
  const PolledView polled_known(known, budget, work);
  const Aabb body_W = Aabb::around(request.start_W, request.body_m);
  const StandingView standing(polled_known, body_W);
  const bool touches = !polled_known.is_free(body_W, work.units);
  const auto is_out = [&](const Vector3& end_W, bool with_room) {
    return with_room ? is_ball_free(polled, end_W, request.room_m, work.units)
                     : is_ball_free(polled_known, end_W, request.body_m, work.units);
  };
  for (const bool with_room : {true, false}) {
    if (!with_room && !touches) return false;
    for (int i = 1; i <= kDistances; ++i) {
      for (const auto& d : kDirection) {
        if (polled.spent()) return false;
        const Piece piece{request.start_W, Vector3(d[0], d[1], d[2]).normalized(), kDistance_m * i};
        const Vector3 end_W = piece.at_W(piece.length_m);
        Trajectory line;
        line.start_time = request.start_time;
        if (!request.bounds_W.contains(end_W) || !is_out(end_W, with_room) ||
            !append_rest_to_rest(request.start_W, end_W, request.limits, line) ||
            !is_trajectory_free(standing, line, 0.0, request.body_m, work.units) ||
            (touches && !keeps_off_all(piece, polled_known, request.body_m, work.units)))
          continue;
        out = line;
        return true;
      }
    }
  }
  return false;
}

}  // namespace roborun::stages
