// Stops: where an autopilot's leads when the vehicle hears no commands any more, and how soon a vehicle that stands decides.
#include <algorithm>

#include "platform/flight/decision_pipeline.hpp"

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

}  // namespace roborun::flight
