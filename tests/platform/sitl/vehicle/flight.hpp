/// Estimator, tracker, simulated sensors and vehicle in a closed loop, without decisions.
#pragma once

#include <algorithm>
#include <vector>

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
  explicit Flight(std::uint64_t seed, const sitl::WindConfig& wind = {}, const VehicleModel& model = {})
      : vehicle_(model, wind, Vector3::Zero(), seed), sensors_({}, seed), lane_(model, seconds(kFrame)) {
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

/// Beside walls that were drawn into the map `age` frames ago, with the errors of the estimator's position of then: how
/// far along one axis the vehicle is from where its trajectory says, at most. Flights there and back at this speed, in the wind that
/// settings give by default.
inline double worst_beside_walls_m(const VehicleModel& model, double speed_mps, std::uint64_t seeds,
                                   std::size_t age) {
  double worst_m = 0.0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    Flight flight(seed, {}, model);
    std::vector<Vector3> drawn_W;
    Vector3 way(4.0 + speed_mps * speed_mps, seed % 2 == 0 ? 0.0 : 3.0, seed % 3 == 0 ? 1.0 : 0.0);
    for (int leg = 0; leg < 4; ++leg, way = -way) {
      const Vector3 from_W = flight.lane().committed().end_W();
      const Trajectory line = straight(from_W, from_W + way, speed_mps, flight.now() + Flight::kFrame);
      flight.lane().offer(line);
      for (int k = 0; k < static_cast<int>((line.duration_s() + 1.0) * 400.0); ++k) {
        flight.step();
        const Vector3& p_WB = flight.truth().p_WB;
        stages::EstimatedState estimate;
        (void)flight.lane().estimator().state(estimate);
        drawn_W.push_back(p_WB - estimate.p_WB);
        if (drawn_W.size() <= age) continue;
        const Vector3 reference_W = flight.lane().committed().at(flight.now()).p_W;
        worst_m =
            std::max(worst_m, (p_WB - reference_W - drawn_W[drawn_W.size() - 1 - age]).cwiseAbs().maxCoeff());
      }
    }
  }
  return worst_m;
}

}  // namespace roborun::test
