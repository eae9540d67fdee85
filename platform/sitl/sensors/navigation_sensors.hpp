/// Simulated IMU, GNSS receiver and barometer: bias, noise, rate, latency and dropouts.
#pragma once

#include <cstdint>

#include "core/random/counter_rng.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "platform/sitl/sensors/delay_line.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"

namespace roborun::sitl {

struct NavigationSensorsConfig {
  // IMU: an industrial MEMS part (ADIS16470 class), one sample a minor frame.
  double gyro_noise_radps{0.0012};  ///< One sigma a sample at 400 Hz.
  double gyro_bias_radps{0.002};    ///< One sigma at switch-on.
  double accel_noise_mps2{0.03};
  double accel_bias_mps2{0.03};
  // GNSS: two-antenna RTK receiver.
  double gnss_rate_Hz{10.0};
  double gnss_latency_s{0.100};
  double gnss_horizontal_m{0.015};
  double gnss_vertical_m{0.03};
  double gnss_speed_mps{0.03};
  double gnss_heading_rad{0.01};
  double gnss_wander_m{0.02};  ///< Slow bias, one sigma, correlated over 60 s.
  double gnss_dropout_ratio{0.01};
  // Barometer.
  double barometer_rate_Hz{50.0};
  double barometer_latency_s{0.020};
  double barometer_noise_m{0.10};
  double barometer_wander_m{0.30};  ///< Slow drift, one sigma, correlated over 120 s.
};

class NavigationSensors final : public firmware_if::Imu,
                                public firmware_if::Gnss,
                                public firmware_if::Barometer {
 public:
  NavigationSensors(const NavigationSensorsConfig& config, std::uint64_t seed) noexcept;

  /// To be called once a minor frame with the true state.
  void sample(MonotonicTime now, const VehicleState& state) noexcept;
  [[nodiscard]] Status read(firmware_if::ImuSample& sample) noexcept override {
    return imu_.pop(sample, now_);
  }
  [[nodiscard]] Status read(firmware_if::GnssFix& fix) noexcept override { return gnss_.pop(fix, now_); }
  [[nodiscard]] Status read(firmware_if::BarometerSample& s) noexcept override {
    return barometer_.pop(s, now_);
  }

 private:
  void sample_imu(const VehicleState& state) noexcept;
  void sample_gnss(const VehicleState& state) noexcept;
  void sample_barometer(const VehicleState& state) noexcept;

  NavigationSensorsConfig config_;
  core::CounterRng imu_rng_;
  core::CounterRng gnss_rng_;
  core::CounterRng barometer_rng_;
  Vector3 gyro_bias_B_radps_;
  Vector3 accel_bias_B_mps2_;
  Vector3 gnss_wander_W_m_ = Vector3::Zero();
  double barometer_wander_m_{0.0};
  MonotonicTime now_{};
  MonotonicTime next_gnss_{};
  MonotonicTime next_barometer_{};
  std::uint32_t imu_sequence_{0};
  std::uint32_t gnss_sequence_{0};
  std::uint32_t barometer_sequence_{0};
  DelayLine<firmware_if::ImuSample, 16> imu_;
  DelayLine<firmware_if::GnssFix, 16> gnss_;
  DelayLine<firmware_if::BarometerSample, 16> barometer_;
};

}  // namespace roborun::sitl
