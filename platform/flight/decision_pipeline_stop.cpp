// Where an autopilot stops a vehicle that hears no commands any more.
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

}  // namespace roborun::flight
