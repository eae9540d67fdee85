/// Estimator, tracker, simulated sensors and vehicle in a closed loop, without decisions.
#pragma once

#include "platform/flight/flight_control.hpp"
#include "platform/sitl/sensors/navigation_sensors.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"
#include "stages/planning/smoother.hpp"

namespace roborun::test {

/// From rest to rest along a straight line, fastest in the middle.
inline Trajectory straight(const Vector3& from_W, const Vector3& to_W, double speed_mps,
                           MonotonicTime start) {
  Trajectory t;
  t.start_time = start;
  (void)stages::append_rest_to_rest(from_W, to_W, {speed_mps, 3.0}, t);
  return t;
}

class Flight {
 public:
  static constexpr Nanos kFrame{2'500'000};
  explicit Flight(std::uint64_t seed, const sitl::WindConfig& wind = {})
      : vehicle_({}, wind, Vector3::Zero(), seed), sensors_({}, seed), lane_({}, seconds(kFrame)) {
    lane_.set_cruise_height(5.0);
    while (!lane_.airborne()) step();
  }
  void step() {
    now_ += kFrame;
    sensors_.sample(now_, vehicle_.state());
    lane_.step(now_, sensors_, vehicle_);
    vehicle_.step(kFrame);
  }
  [[nodiscard]] MonotonicTime now() const { return now_; }
  [[nodiscard]] flight::FlightControl& lane() { return lane_; }
  [[nodiscard]] const sitl::VehicleState& truth() const { return vehicle_.state(); }

 private:
  MonotonicTime now_{};
  sitl::Vehicle vehicle_;
  sitl::NavigationSensors sensors_;
  flight::FlightControl lane_;
};

}  // namespace roborun::test
