#include "platform/board/stopping_sweep.hpp"

#include <algorithm>

#include "core/geometry/inverse.hpp"
#include "platform/flight/decision_pipeline.hpp"
#include "platform/flight/flight_control.hpp"
#include "platform/sitl/sensors/navigation_sensors.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"
#include "stages/planning/smoother.hpp"

namespace roborun::board {
namespace {

constexpr Nanos kMinorFrame{2'500'000};

double stopping_distance_m(double speed_mps, std::uint64_t seed) {
  sitl::Vehicle vehicle({}, {}, Vector3::Zero(), seed);
  sitl::NavigationSensors sensors({}, seed);
  flight::FlightControl lane({}, seconds(kMinorFrame));
  const auto line = [](const Vector3& from_W, const Vector3& to_W, double top_mps, MonotonicTime start) {
    Trajectory t;
    t.start_time = start;
    (void)stages::append_rest_to_rest(from_W, to_W, {top_mps, 3.0}, t);
    return t;
  };
  lane.set_cruise_height(5.0);
  MonotonicTime now{};
  const auto step = [&] {
    now += kMinorFrame;
    sensors.sample(now, vehicle.state());
    lane.step(now, sensors, vehicle);
    vehicle.step(kMinorFrame);
  };
  while (!lane.airborne()) step();
  const Vector3 from_W = lane.committed().end_W();
  const Trajectory cruise =
      line(from_W, from_W + Vector3(10.0 * speed_mps, 0.0, 0.0), speed_mps, now + kMinorFrame);
  lane.offer(cruise);
  const MonotonicTime begin = cruise.start_time + from_seconds(0.5 * cruise.duration_s());
  while (now < begin) step();
  Trajectory brake;
  const stages::Smoother smoother;
  const auto [acceleration_mps2, jerk_mps3] = followed_limits(VehicleModel{});
  if (smoother.brake(cruise.at(begin), begin, {30.0, acceleration_mps2, jerk_mps3}, brake) != Status::kOk)
    return 0.0;
  lane.offer(brake);
  const Vector3 at_W = vehicle.state().p_WB;
  double farthest_m = 0.0;
  const MonotonicTime end = now + from_seconds(brake.duration_s() + 3.0);
  while (now < end) {
    step();
    farthest_m = std::max(farthest_m, (vehicle.state().p_WB - at_W).norm());
  }
  return farthest_m;
}

}  // namespace

std::vector<StoppingPoint> stopping_sweep(std::span<const double> speeds_mps, int runs,
                                          const std::function<void(double)>& progress) {
  std::vector<StoppingPoint> points;
  points.reserve(speeds_mps.size());
  for (const double speed_mps : speeds_mps) {
    StoppingPoint point{speed_mps, 0.0};
    for (int run = 1; run <= runs; ++run)
      point.distance_m =
          std::max(point.distance_m, stopping_distance_m(speed_mps, static_cast<std::uint64_t>(run)));
    points.push_back(point);
    if (progress) progress(static_cast<double>(points.size()) / static_cast<double>(speeds_mps.size()));
  }
  return points;
}

StoppingFit fit_stopping(std::span<const StoppingPoint> points) {
  Matrix3 normal = Matrix3::Zero();
  Vector3 right = Vector3::Zero();
  for (const StoppingPoint& p : points) {
    const Vector3 row = Vector3(p.speed_mps * p.speed_mps, p.speed_mps, 1.0) / p.distance_m;
    normal += row * row.transpose();
    right += row;
  }
  const Vector3 x = core::inverse<3>(normal) * right;
  StoppingFit fit{{x[0], x[1], x[2]}, 0.0};
  for (const StoppingPoint& p : points) {
    const double error = fit.model.distance_m(p.speed_mps) / p.distance_m - 1.0;
    fit.mean_squared_relative += error * error / static_cast<double>(points.size());
  }
  return fit;
}

}  // namespace roborun::board
