// Stops: where an autopilot's leads when the vehicle hears no commands any more, how soon a vehicle that stands decides, and how it
// leaves a place without room.
#include <algorithm>

#include "platform/flight/decision_pipeline.hpp"
#include "platform/flight/flight_config.hpp"
#include "stages/perception/swept_ball.hpp"
#include "stages/planning/fenced_view.hpp"
#include "stages/planning/way_out.hpp"

namespace roborun::flight {

bool DecisionPipeline::stops_free(const Trajectory& trajectory, const stages::MapView& view,
                                  core::Work& work) const noexcept {
  constexpr double kEvery_s = 0.25;
  constexpr int kMost = 6;  // what is flown until a later plan has taken over, and more
  constexpr double kSlow_mps = 0.5;
  constexpr double kAtOnce_mps3 = 1e3;
  const StoppingModel model = stopping_model(config_.vehicle);
  for (int i = 0; i < kMost && i * kEvery_s < trajectory.duration_s(); ++i) {
    TrajectoryPoint point = trajectory.at(trajectory.start_time + from_seconds(i * kEvery_s));
    const double v_mps = point.v_W.norm();
    if (v_mps < kSlow_mps) continue;
    // As a stop that takes this distance.
    point.a_W.setZero();
    stages::MotionLimits straight = limits(v_mps);
    straight.acceleration_mps2 = 0.5 * v_mps * v_mps / model.distance_m(v_mps);
    straight.jerk_mps3 = kAtOnce_mps3;
    Trajectory stop;
    if (smoother_.brake(point, trajectory.start_time, straight, stop) != Status::kOk) return false;
    if (!stages::is_trajectory_free(view, stop, 0.0, config_.vehicle.radius_m, work.units)) return false;
  }
  return true;
}

void DecisionPipeline::hasten(const DecisionInput& in, DecisionOutput& out) const noexcept {
  constexpr double kReserve = 1.25;  // of the time for planner and smoother
  constexpr double kSearches = 3.0;  // of find_trajectory(), one of which is predicted
  constexpr int kSpareFrames = 4;
  if (in.climbing || out.decision.source == governor::BudgetSource::kFixed) return;
  // Where little is in view a search is predicted to take nothing.
  const double left_s = std::max(kSearches * out.decision.predicted_s[core::StageId::kPlanner],
                                 searched_s_[static_cast<std::size_t>(out.decision.point.p1_level)]) +
                        out.decision.predicted_s[core::StageId::kSmoother];
  const Nanos needed = out.latency + from_seconds(kReserve * left_s);
  const Nanos whole = config_.minor_frame * (needed / config_.minor_frame + kSpareFrames);
  const MonotonicTime stands = in.committed->start_time + from_seconds(in.committed->duration_s());
  if (in.now + whole < stands) return;
  out.decision.point.deadline = std::min(out.decision.point.deadline, whole);
}

void DecisionPipeline::leave(double room_m, core::StageBudget& budget, DecisionOutput& out) noexcept {
  constexpr double kLeaving_mps = 0.5;
  constexpr double kSamePlace_m = 2.0;  // as far as a way out leads
  constexpr int kTriesFiner = 4;        // failures: the governor asks for finer cells meanwhile
  // What is flown ends in a stop: from there.
  if (draft_.start.v_W.norm() > kAtRest_mps || draft_.start.a_W.norm() > kAtRest_mps) return;
  const stages::FencedView permitted(map_.view(), config_.fence);
  const stages::FinestView finest(permitted);
  // Where it stands again though it left, and only the cells are too coarse for the room that there is, finer ones are what lacks.
  const bool again = left_W_ && (draft_.start.p_W - *left_W_).norm() < kSamePlace_m;
  if (again && failures_ < kTriesFiner &&
      stages::is_ball_free(finest, draft_.start.p_W, room_m, draft_.smoother_work.units))
    return;
  stages::WayOutRequest request;
  request.start_W = draft_.start.p_W;
  request.start_time = draft_.takes_over;
  request.bounds_W = config_.flight_bounds_W;
  request.limits = limits(std::min(out.decision.point.speed_limit_mps, kLeaving_mps));
  request.body_m = config_.vehicle.radius_m;
  request.room_m = room_m;
  meter_.charge_to(core::StageId::kSmoother);
  draft_.leaves =
      stages::find_way_out(request, permitted, finest, budget, draft_.smoother_work, draft_.trajectory);
  out.smoother_status = draft_.leaves ? Status::kOk : Status::kNoPath;
}

}  // namespace roborun::flight
