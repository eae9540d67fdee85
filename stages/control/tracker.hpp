/// Follows a trajectory: cascaded PID, position -> velocity -> attitude -> rate -> motors.
#pragma once

#include <cstdint>

#include "core/geometry/vector.hpp"
#include "core/range.hpp"
#include "core/trajectory.hpp"
#include "core/vehicle_model.hpp"
#include "firmware_if/assert.hpp"
#include "firmware_if/motors.hpp"
#include "firmware_if/status.hpp"
#include "stages/control/estimator.hpp"
#include "stages/control/mixer.hpp"

namespace roborun::stages {

/// Attitude errors are geometric (Lee, Leok, McClamroch, "Geometric tracking control of a quadrotor UAV on
/// SE(3)", 2010).
class Tracker {
 public:
  struct Config {
    VehicleModel vehicle{};
    double position_gain_Hz{1.4};       ///< 1/s. (0, 10]
    double velocity_gain_Hz{2.8};       ///< 1/s. (0, 20]
    double velocity_integral_Hz2{0.9};  ///< 1/s2: takes up wind and drag. [0, 20]
    double integral_limit_mps2{2.5};    ///< Anti-windup: more than the drag at 8 m/s. (0, 10]
    double attitude_gain_Hz{7.0};       ///< 1/s. (0, 50]
    double rate_gain_Hz{14.0};          ///< 1/s; motor lag of 40 ms leaves a damping of 0.67. (0, 100]
    double correction_limit_mps{3.0};   ///< Of the position loop. (0, 20]
    double period_s{0.0025};            ///< The minor frame. (0, 0.1]
    [[nodiscard]] Status validate() const noexcept {
      const bool ok = out_of_bounds(vehicle) == nullptr && core::above(position_gain_Hz, 0.0, 10.0) &&
                      core::above(velocity_gain_Hz, 0.0, 20.0) &&
                      core::within(velocity_integral_Hz2, 0.0, 20.0) &&
                      core::above(integral_limit_mps2, 0.0, 10.0) &&
                      core::above(attitude_gain_Hz, 0.0, 50.0) && core::above(rate_gain_Hz, 0.0, 100.0) &&
                      core::above(correction_limit_mps, 0.0, 20.0) && core::above(period_s, 0.0, 0.1);
      return ok ? Status::kOk : Status::kInvalidArgument;
    }
  };
  /// The gains above belong to motors with a lag of 40 ms, which bounds what the inner loop can do: for others
  /// all loops are quicker or slower in the same ratio (from 0.4 to 2.5). The integral takes up the drag at
  /// full speed.
  [[nodiscard]] static Config config_for(const VehicleModel& vehicle, double period_s) noexcept;
  struct Input {
    EstimatedState state{};
    TrajectoryPoint reference{};
    double yaw_rad{0.0};
  };
  /// Never decrease.
  struct Counters {
    std::uint64_t steps{}, refused{}, tilt_limited{};
  };

  /// Precondition, asserted: config.validate() is kOk.
  explicit Tracker(const Config& config) noexcept : config_(config) {
    ROBORUN_ASSERT(config.validate() == Status::kOk);
  }

  /// RT-safe: O(1). A non-finite input is refused with kInvalidArgument, counted, and `out` stays as it was:
  /// the caller repeats the command before, which for one frame is the safest known.
  [[nodiscard]] Status step(const Input& in, firmware_if::MotorCommand& out) noexcept;
  /// Forgets the integral: on the ground, and when disarmed.
  void reset() noexcept { integral_W_mps2_.setZero(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] Vector3 acceleration_W(const Input& in) noexcept;

  Config config_;
  Counters counters_{};
  Vector3 integral_W_mps2_ = Vector3::Zero();
};

}  // namespace roborun::stages
