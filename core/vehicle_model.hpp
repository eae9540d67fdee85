/// The vehicle: its body, its propulsion, its limits. The only place where they are written down; whatever
/// needs one of these numbers is made from this struct. One table names, bounds and explains every number: it
/// drives the reader of vehicle files, the check, and the reference.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "core/geometry/vector.hpp"
#include "core/precision.hpp"
#include "core/stopping_model.hpp"

namespace roborun {

/// A quadrotor in X. Defaults: the vehicle of the paper's evaluation, 1.2 m wide (RoboRun: 1.2 m vehicle in a
/// 1.8 m aisle), which hovers at about 515 W.
struct VehicleModel {
  double radius_m{0.6};
  double tracking_error_m{0.3};  ///< Measured in tests/platform/sitl/vehicle/closed_loop_test.cpp.
  double slow_error_m{0.0};
  double mass_kg{4.5};
  double inertia_x_kgm2{0.080};
  double inertia_y_kgm2{0.080};
  double inertia_z_kgm2{0.140};
  double arm_m{0.30};

  double max_thrust_N{24.5};  ///< Thrust to weight 2.2.
  double yaw_torque_m{0.018};
  double motor_lag_s{0.040};  ///< 15 inch propeller on an ESC with closed-loop speed.
  double rotor_radius_m{0.19};
  double efficiency_ratio{0.54};

  double drag_linear_Nspm{0.30};
  double drag_quadratic_Ns2pm2{0.055};  ///< 0.5 * 1.225 kg/m3 * 0.09 m2.
  double drag_angular_Nms{0.02};

  double avionics_W{15.0};
  double battery_J{2.2e6};  ///< 611 Wh: the longest mission of the static design, 1,200 m at 0.5 m/s.

  double speed_mps{6.0};  ///< RoboRun Table "Knob values".
  double acceleration_mps2{4.0};
  double jerk_mps3{20.0};  ///< On short hops the tilt overshot by 6 degrees without it.
  double tilt_rad{0.60};   ///< 34 degrees: 6.7 m/s2 sideways.
  double slow_speed_mps{1.0};
  double climb_mps{6.0};
  double descent_mps{6.0};
  double yaw_rate_radps{1.5};
  double finest_cell_m{kPublishedCell_m};
  double thinnest_m{0.02};  ///< A washing line, a bare cable.

  /// Measured, of a vehicle that has been flown; none: derived from the limits.
  std::optional<StoppingModel> measured_stopping{kSitlQuadrotorStopping};

  [[nodiscard]] Vector3 inertia_kgm2() const noexcept {
    return {inertia_x_kgm2, inertia_y_kgm2, inertia_z_kgm2};
  }
};

/// One number of a vehicle file.
struct VehicleKey {
  const char* table;
  const char* key;  ///< With its unit.
  double VehicleModel::*value;
  double low, high;  ///< Both allowed.
  const char* text;
  std::optional<double> left_out{};  ///< What counts if a file leaves it out; none: it must not.
};

// clang-format off
inline constexpr std::array<VehicleKey, 28> kVehicleKeys = [] {
  using V = VehicleModel;
  return std::array<VehicleKey, 28>{{
    {"body", "radius_m", &V::radius_m, 0.05, 2.0, "of the sphere around everything that must not touch, propellers included"},
    {"body", "tracking_error_m", &V::tracking_error_m, 0.02, 2.0, "largest distance from the reference in flight: added to the radius for planning"},
    {"body", "slow_error_m", &V::slow_error_m, 0.0, 2.0, "the same at limits.slow_speed_mps or less, beside what the cameras saw: narrow places are flown so; 0: never", 0.0},
    {"body", "mass_kg", &V::mass_kg, 0.05, 100.0, "at take-off, load included"},
    {"body", "inertia_x_kgm2", &V::inertia_x_kgm2, 1e-6, 100.0, "about the forward axis"},
    {"body", "inertia_y_kgm2", &V::inertia_y_kgm2, 1e-6, 100.0, "about the left axis"},
    {"body", "inertia_z_kgm2", &V::inertia_z_kgm2, 1e-6, 100.0, "about the upward axis"},
    {"body", "arm_m", &V::arm_m, 0.02, 3.0, "offset of a motor from the centre, forward and to the side alike"},
    {"propulsion", "max_thrust_N", &V::max_thrust_N, 0.1, 1000.0, "of one motor of the four"},
    {"propulsion", "yaw_torque_m", &V::yaw_torque_m, 1e-4, 0.5, "reaction torque per newton of thrust"},
    {"propulsion", "motor_lag_s", &V::motor_lag_s, 0.005, 0.5, "time constant of a motor's thrust"},
    {"propulsion", "rotor_radius_m", &V::rotor_radius_m, 0.01, 2.0, "of one propeller: what hovering costs"},
    {"propulsion", "efficiency_ratio", &V::efficiency_ratio, 0.05, 1.0, "figure of merit times motor and ESC"},
    {"drag", "linear_Nspm", &V::drag_linear_Nspm, 0.0, 20.0, "rotor drag per m/s of air speed"},
    {"drag", "quadratic_Ns2pm2", &V::drag_quadratic_Ns2pm2, 0.0, 5.0, "body drag per (m/s)2: half of density times area"},
    {"drag", "angular_Nms", &V::drag_angular_Nms, 0.0, 5.0, "torque per rad/s of rotation"},
    {"power", "avionics_W", &V::avionics_W, 0.0, 2000.0, "companion computer, sensors, autopilot"},
    {"power", "battery_J", &V::battery_J, 1e3, 1e9, "usable energy of a full battery"},
    {"limits", "speed_mps", &V::speed_mps, 0.5, 30.0, "fastest flight of the design aware"},
    {"limits", "acceleration_mps2", &V::acceleration_mps2, 0.2, 30.0, "along a whole trajectory, braking included"},
    {"limits", "jerk_mps3", &V::jerk_mps3, 1.0, 1000.0, "along a whole trajectory"},
    {"limits", "tilt_rad", &V::tilt_rad, 0.05, 1.2, "of the thrust against the vertical"},
    {"limits", "slow_speed_mps", &V::slow_speed_mps, 0.1, 30.0, "fastest where it is narrow", 1.0},
    {"limits", "climb_mps", &V::climb_mps, 0.2, 30.0, "fastest climb"},
    {"limits", "descent_mps", &V::descent_mps, 0.2, 30.0, "fastest descent"},
    {"limits", "yaw_rate_radps", &V::yaw_rate_radps, 0.05, 10.0, "fastest turn about the vertical"},
    {"limits", "finest_cell_m", &V::finest_cell_m, 0.05, 0.3, "edge of the map's finest cells, for the design aware: smaller ones let it through narrower gaps, and cost more; never less than a 17th of body.radius_m and slow_error_m together", kPublishedCell_m},
    {"limits", "thinnest_m", &V::thinnest_m, 0.005, 1.0, "the thinnest pole or wire that it must not fly into", 0.02},
  }};
}();
// clang-format on

/// The first number that is not within its bounds (NaN never is), or null: all are.
[[nodiscard]] constexpr const VehicleKey* out_of_bounds(const VehicleModel& vehicle) noexcept {
  for (const VehicleKey& key : kVehicleKeys) {
    const double value = vehicle.*key.value;
    if (!(value >= key.low && value <= key.high)) return &key;
  }
  return nullptr;
}

/// What trajectories get of the limits of acceleration and jerk, which they are at most of the time: a fifth of the tilt is the
/// controller's, and what holds against drag at the top speed is not there for turns (it stands across them). Jerk turns the thrust at
/// j / g; the loop of rates, which is as quick as the motors allow (Tracker::config_for), and the motors are 2.8 of their lags late: with
/// j lag = 0.6 m/s2 the attitude is 10 degrees behind (paper 36 degrees at most of 38 allowed, 41 with 0.8; racer loses its attitude with
/// 1.2). RT-safe: O(1).
struct FollowedLimits {
  double acceleration_mps2, jerk_mps3;
};
[[nodiscard]] FollowedLimits followed_limits(const VehicleModel& vehicle) noexcept;
/// Fastest level flight in still air: beyond it drag leaves less than 0.2 m/s2 of the acceleration that the tilt limit gives to trajectories.
/// +infinity without drag, 0 where the tilt gives less than that at rest. RT-safe: O(1).
[[nodiscard]] double level_speed_mps(const VehicleModel& vehicle) noexcept;
/// With what the speed may rise up to `speed_mps`: drag there is against it. RT-safe: O(1).
[[nodiscard]] double speeding_up_mps2(const VehicleModel& vehicle, double speed_mps) noexcept;
/// How far it travels until it stands, as trajectories end: measured, or derived from followed_limits().
///
/// A trajectory ends in a stop of constant jerk j up to the deceleration a, constant deceleration, and constant jerk
/// back. It takes T = v/a + a/j, or less where v < a^2/j and a is not reached, over the distance v T / 2: d = v^2/2a +
/// v a/2j. Before it brakes, motors take their lag to tilt the vehicle; after it, it stands as far beside its
/// reference as the tracking error allows.
/// RT-safe: O(1).
[[nodiscard]] StoppingModel stopping_model(const VehicleModel& vehicle) noexcept;
/// Sideways acceleration at the tilt limit, without losing height.
[[nodiscard]] double tilt_acceleration_mps2(const VehicleModel& vehicle) noexcept;
/// All four motors' thrust over the weight.
[[nodiscard]] double thrust_to_weight_ratio(const VehicleModel& vehicle) noexcept;
/// What pushes back at this air speed, as an acceleration.
[[nodiscard]] double drag_mps2(const VehicleModel& vehicle, double speed_mps) noexcept;
/// Distance that plans keep from everything.
[[nodiscard]] inline double planned_radius_m(const VehicleModel& vehicle) noexcept {
  return vehicle.radius_m + vehicle.tracking_error_m;
}

/// The same where it flies at most slow_speed_mps.
[[nodiscard]] inline double slow_radius_m(const VehicleModel& vehicle) noexcept {
  const bool flies_slowly = vehicle.slow_error_m > 0.0 && vehicle.slow_error_m < vehicle.tracking_error_m;
  return vehicle.radius_m + (flies_slowly ? vehicle.slow_error_m : vehicle.tracking_error_m);
}

/// What makes a vehicle that no flight is possible with, in words, or null. Precondition: out_of_bounds() is
/// null. `visible_m` is how far its sensors see.
[[nodiscard]] const char* cannot_fly(const VehicleModel& vehicle, double visible_m) noexcept;

}  // namespace roborun
