/// Where the vehicle is: an error-state Kalman filter over IMU, GNSS and barometer.
/// Source: J. Sola, "Quaternion kinematics for the error-state Kalman filter" (2017), attitude error in the
/// world frame.
#pragma once

#include <cstdint>

#include "core/geometry/vector.hpp"
#include "firmware_if/assert.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "firmware_if/status.hpp"
#include "stages/control/past_states.hpp"

namespace roborun::stages {

struct EstimatedState {
  MonotonicTime stamp{};
  Vector3 p_WB = Vector3::Zero();
  Vector3 v_WB = Vector3::Zero();
  Quaternion q_WB = Quaternion::Identity();
  Vector3 w_WB_B = Vector3::Zero();
  double position_sigma_m{};  ///< Largest standard deviation of the three axes.
};

/// 15 error states: position, velocity, attitude, gyro bias, accelerometer bias. A fix that arrives late is
/// compared with the state at its own instant and its correction applied to the present: at 100 ms and these
/// rates the error of doing so is far below the receiver's noise.
class Estimator {
 public:
  struct Config {
    double gyro_noise_radps{0.0012};    ///< One sigma a sample. (0, 1]
    double accel_noise_mps2{0.05};      ///< One sigma a sample, vibration included. (0, 10]
    double gyro_bias_walk_radps{2e-5};  ///< Per sqrt(s). (0, 1]
    double accel_bias_walk_mps2{2e-4};  ///< Per sqrt(s). (0, 1]
    double barometer_sigma_m{0.6};      ///< Noise and drift of the sensor. (0, 100]
    double gate_sigma{6.0};             ///< Innovations beyond this are refused. [3, 20]
    Nanos imu_lost_after{25'000'000};   ///< Ten samples at 400 Hz.
    Nanos oldest_fix{450'000'000};      ///< What the ring of past states covers.
    [[nodiscard]] constexpr Status validate() const noexcept {
      const bool ok = gyro_noise_radps > 0 && gyro_noise_radps <= 1 && accel_noise_mps2 > 0 &&
                      accel_noise_mps2 <= 10 && gyro_bias_walk_radps > 0 && gyro_bias_walk_radps <= 1 &&
                      accel_bias_walk_mps2 > 0 && accel_bias_walk_mps2 <= 1 && barometer_sigma_m > 0 &&
                      barometer_sigma_m <= 100 && gate_sigma >= 3 && gate_sigma <= 20 &&
                      imu_lost_after > Nanos{0} && oldest_fix > Nanos{0};
      return ok ? Status::kOk : Status::kInvalidArgument;
    }
  };
  /// Never decrease.
  struct Counters {
    std::uint64_t imu{}, gnss{}, barometer{};  ///< Accepted.
    std::uint64_t refused_not_finite{}, refused_stamp{}, refused_gate{};
    std::uint64_t resets{};  ///< A NaN got inside: started again from the next fix.
  };

  /// Precondition, asserted: config.validate() is kOk.
  explicit Estimator(const Config& config) noexcept : config_(config), past_(config.oldest_fix) {
    ROBORUN_ASSERT(config.validate() == Status::kOk);
  }

  /// One IMU sample, in order. Refused (kInvalidArgument, kStale) if not finite or not newer than the one
  /// before. RT-safe: O(1), about 2 us, every fourth call 5 us more for the covariance.
  [[nodiscard]] Status predict(const firmware_if::ImuSample& sample) noexcept;
  /// A fix, possibly late. The first one, once IMU samples flow, starts the filter (at rest, level).
  /// kNotReady before.
  [[nodiscard]] Status update(const firmware_if::GnssFix& fix) noexcept;
  [[nodiscard]] Status update(const firmware_if::BarometerSample& sample) noexcept;

  /// kNotReady before the first fix.
  [[nodiscard]] Status state(EstimatedState& out) const noexcept;
  /// As estimated then: a late fix corrects the present only.
  [[nodiscard]] const PastStates& past() const noexcept { return past_; }
  /// True if no IMU sample came for config.imu_lost_after.
  [[nodiscard]] bool imu_lost(MonotonicTime now) const noexcept {
    return now - state_.stamp > config_.imu_lost_after;
  }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  static constexpr int kStates = 15;
  using Covariance = Eigen::Matrix<double, kStates, kStates>;

  void start(const firmware_if::GnssFix& fix) noexcept;
  void propagate_covariance(double dt_s) noexcept;
  /// One scalar measurement of error state `index`; false if gated out.
  bool correct(int index, double innovation, double sigma) noexcept;
  /// All measurements of a fix, given its innovations of position and velocity and the yaw estimated then;
  /// false if one of them is gated out.
  bool correct_by(const firmware_if::GnssFix& fix, const Vector3& dp, const Vector3& dv,
                  double yaw_rad) noexcept;
  void reset_if_broken() noexcept;

  Config config_;
  Counters counters_{};
  bool started_{false};
  EstimatedState state_{};
  Vector3 gyro_bias_B_ = Vector3::Zero();
  Vector3 accel_bias_B_ = Vector3::Zero();
  Vector3 force_W_ = Vector3::Zero();
  Vector3 last_force_B_ = Vector3::Zero();
  Covariance P_ = Covariance::Zero();
  int since_covariance_{0};
  double covariance_dt_s_{0.0};
  MonotonicTime last_gnss_{};
  MonotonicTime last_barometer_{};
  PastStates past_;
};

}  // namespace roborun::stages
