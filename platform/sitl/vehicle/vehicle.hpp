/// A simulated quadrotor: rigid body, motor lag, drag, wind, ground and battery.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/vector.hpp"
#include "core/random/counter_rng.hpp"
#include "firmware_if/motors.hpp"
#include "firmware_if/time.hpp"

namespace roborun::sitl {

struct VehicleConfig {
  double mass_kg{4.5};                        ///< [0.5, 50]. With the span below: hovers at about 515 W.
  Vector3 inertia_kgm2{0.080, 0.080, 0.140};  ///< About the body axes.
  double arm_m{0.30};                         ///< Motor offset from the centre along x and along y.
  double max_thrust_N{24.5};                  ///< One motor; thrust to weight 2.2.
  double yaw_torque_m{0.018};                 ///< Reaction torque per newton of thrust.
  double motor_lag_s{0.040};            ///< First order. 15 inch propeller on an ESC with closed-loop speed.
  double drag_linear_Nspm{0.30};        ///< Rotor drag.
  double drag_quadratic_Ns2pm2{0.055};  ///< 0.5 * 1.225 kg/m3 * 0.09 m2.
  double angular_drag_Nms{0.02};
  double rotor_radius_m{0.19};    ///< Momentum theory: four discs.
  double efficiency_ratio{0.54};  ///< Figure of merit times motor and ESC efficiency.
  double avionics_W{15.0};        ///< Companion computer, sensors, autopilot.
  double battery_J{2.2e6};        ///< 611 Wh: the longest mission of the static design, 1,200 m at 0.5 m/s.
};

/// Steady wind plus first-order Gauss-Markov gusts on each axis.
struct WindConfig {
  Vector3 mean_W_mps{1.5, 1.0, 0.0};
  double gust_mps{0.8};  ///< One sigma an axis, half of it vertically.
  double correlation_s{3.0};
};

struct VehicleState {
  Vector3 p_WB = Vector3::Zero();
  Vector3 v_WB = Vector3::Zero();
  Vector3 a_WB = Vector3::Zero();  ///< True acceleration in the world frame, gravity included.
  Quaternion q_WB = Quaternion::Identity();
  Vector3 w_WB_B = Vector3::Zero();
  std::array<double, 4> thrust_ratio{};
  double power_W{};
  double energy_J{};
  double battery_ratio{1.0};
  bool on_ground{true};
};

/// Deterministic: own random numbers, no libm. One minor frame costs well under 2 us.
class Vehicle final : public firmware_if::Motors {
 public:
  Vehicle(const VehicleConfig& config, const WindConfig& wind, const Vector3& p_WB,
          std::uint64_t seed) noexcept;

  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override;
  /// Advances by dt in substeps of at most 1.25 ms. An empty battery gives no thrust.
  void step(Nanos dt) noexcept;
  [[nodiscard]] const VehicleState& state() const noexcept { return state_; }
  /// From now on; gusts go on where they are.
  void set_mean_wind(const Vector3& mean_W_mps) noexcept { wind_.mean_W_mps = mean_W_mps; }
  [[nodiscard]] Pose X_WB() const noexcept { return {state_.q_WB.toRotationMatrix(), state_.p_WB}; }
  /// Air speed of the wind, world frame, now.
  [[nodiscard]] const Vector3& wind_W_mps() const noexcept { return wind_W_mps_; }

 private:
  void substep(double dt_s) noexcept;
  [[nodiscard]] double electrical_power_W(double thrust_N, double axial_mps) const noexcept;

  VehicleConfig config_;
  WindConfig wind_;
  VehicleState state_;
  firmware_if::MotorCommand command_{};
  Vector3 gust_W_mps_ = Vector3::Zero();
  Vector3 wind_W_mps_ = Vector3::Zero();
  core::CounterRng rng_;
};

}  // namespace roborun::sitl
