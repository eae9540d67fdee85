/// A simulated quadrotor: rigid body, motor lag, drag, wind, ground and battery.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/vector.hpp"
#include "core/random/counter_rng.hpp"
#include "core/vehicle_model.hpp"
#include "firmware_if/motors.hpp"
#include "firmware_if/time.hpp"

namespace roborun::sitl {

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
  Vehicle(const VehicleModel& model, const WindConfig& wind, const Vector3& p_WB,
          std::uint64_t seed) noexcept;

  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override;
  /// Advances by dt in substeps of at most 1.25 ms. An empty battery gives no thrust.
  void step(Nanos dt) noexcept;
  [[nodiscard]] const VehicleState& state() const noexcept { return state_; }
  /// What its motors were told last.
  [[nodiscard]] const firmware_if::MotorCommand& commanded() const noexcept { return command_; }
  /// Height of the surface below it, on which it can stand; 0 until then.
  void set_ground(double ground_m) noexcept { ground_m_ = ground_m; }
  [[nodiscard]] double ground_m() const noexcept { return ground_m_; }
  /// From now on; gusts go on where they are.
  void set_mean_wind(const Vector3& mean_W_mps) noexcept { wind_.mean_W_mps = mean_W_mps; }
  [[nodiscard]] Pose X_WB() const noexcept { return {state_.q_WB.toRotationMatrix(), state_.p_WB}; }
  /// Air speed of the wind, world frame, now.
  [[nodiscard]] const Vector3& wind_W_mps() const noexcept { return wind_W_mps_; }

 private:
  void substep(double dt_s) noexcept;

  VehicleModel model_;
  WindConfig wind_;
  VehicleState state_;
  double ground_m_{0.0};
  firmware_if::MotorCommand command_{};
  Vector3 gust_W_mps_ = Vector3::Zero();
  Vector3 wind_W_mps_ = Vector3::Zero();
  core::CounterRng rng_;
};

}  // namespace roborun::sitl
