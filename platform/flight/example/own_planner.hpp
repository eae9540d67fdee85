/// A planner of your own: straight towards the goal, and where that is blocked, the best of a fan of directions.
/// Good enough for pillars, caught by every dead end.
#pragma once

#include <algorithm>

#include "core/geometry/math.hpp"
#include "stages/perception/swept_ball.hpp"
#include "stages/planning/planner.hpp"

namespace example {

/// Keeps the contract of stages::Planner (stages/planning/planner.hpp): nothing but known free space is flown
/// through, and the answer is the point from which the goal promises to be nearest.
class StraightPlanner final : public roborun::stages::Planner {
 public:
  [[nodiscard]] roborun::Status plan(const roborun::stages::PlanRequest& request,
                                     const roborun::stages::MapView& view, roborun::core::StageBudget& budget,
                                     roborun::stages::PlanResult& result) noexcept override {
    using namespace roborun;
    result = {};
    if (!is_finite(request.start_W) || !is_finite(request.goal_W) ||
        !((request.bounds_W.size().array() > 0.0).all()))
      return Status::kInvalidArgument;
    if (!stages::is_ball_free(view, request.start_W, request.radius_m, result.work.units))
      return Status::kStartBlocked;
    const Vector3 to_goal = request.goal_W - request.start_W;
    if (to_goal.norm() < view.cell_m()) return Status::kNoPath;  // there already

    // What nobody has seen may hide a detour: a metre of it counts as two.
    double best_m = stages::kUnknownWeight * to_goal.norm();
    Vector3 best_W = request.start_W;
    for (int turn = 0; turn <= 12 && best_m > to_goal.norm() * 1.001; ++turn) {
      for (const double side : {1.0, -1.0}) {
        // The stage is anytime: it asks often, and goes with the best so far. Virtual time charges `work`.
        if (budget.spent(result.work)) break;
        const Vector3 direction = turned(to_goal.normalized(), side * turn * core::kPi / 24.0);
        const Vector3 end_W = end_of(request, view, direction, to_goal.norm(), result.work);
        const double cost_m =
            (end_W - request.start_W).norm() + stages::kUnknownWeight * (request.goal_W - end_W).norm();
        if (cost_m < best_m - 0.01) {
          best_m = cost_m;
          best_W = end_W;
        }
      }
    }
    if (best_W == request.start_W) return Status::kNoPath;
    (void)result.path_W.push_back(request.start_W);
    (void)result.path_W.push_back(best_W);
    result.cost_m = (best_W - request.start_W).norm();
    result.reaches_goal = (request.goal_W - best_W).norm() <= view.cell_m();
    return Status::kOk;
  }

 private:
  [[nodiscard]] static roborun::Vector3 turned(const roborun::Vector3& v, double angle_rad) {
    const double c = roborun::core::cos(angle_rad), s = roborun::core::sin(angle_rad);
    return {c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z()};
  }
  /// How far the vehicle gets in this direction: inside the bounds, at most to the horizon or the goal.
  [[nodiscard]] static roborun::Vector3 end_of(const roborun::stages::PlanRequest& r,
                                               const roborun::stages::MapView& view,
                                               const roborun::Vector3& direction, double goal_m,
                                               roborun::core::Work& work) {
    double m = roborun::stages::free_distance_m(view, r.start_W, direction, r.radius_m,
                                                std::min(r.horizon_m, goal_m), work.units);
    work.volume_m3 += 4.0 * r.radius_m * r.radius_m * m;
    const auto fits = [&](const roborun::Vector3& p_W) {
      return r.bounds_W.contains(p_W) &&
             roborun::stages::is_segment_free(view, r.start_W, p_W, r.radius_m, work.units);
    };
    for (; m > view.cell_m(); m -= view.cell_m()) {
      if (fits(r.start_W + m * direction)) return r.start_W + m * direction;
    }
    return r.start_W;
  }
};

}  // namespace example
