/// Simulated IMU, GNSS receiver, odometry and barometer: bias, noise, rate, latency and dropouts; or the errors of products.
#pragma once

#include <array>
#include <cstdint>

#include "core/random/counter_rng.hpp"
#include "core/sensor_model.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "platform/sitl/sensors/delay_line.hpp"
#include "platform/sitl/sensors/navigation_models.hpp"
#include "platform/sitl/sensors/surface_lattice.hpp"
#include "platform/sitl/sensors/visual_odometry.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

/// The numbers are those of `clean`; the models have their own (navigation_models.hpp).
struct NavigationSensorsConfig {
  ImuModel imu{};
  GnssModel gnss{};
  OdometryModel odometry{};
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

/// Share of 16 directions, 20 and 50 degrees above the horizon, in which nothing stands within 80 m; 1 in the open.
[[nodiscard]] double sky_ratio(const World& world, const Vector3& p_W) noexcept;

class NavigationSensors final : public firmware_if::Imu,
                                public firmware_if::Gnss,
                                public firmware_if::Barometer,
                                public firmware_if::Odometry {
 public:
  NavigationSensors(const NavigationSensorsConfig& config, std::uint64_t seed) noexcept;

  /// What hides the sky from the receiver; null: nothing. It must outlive the sensors.
  void stand_in(const World* world) noexcept { world_ = world; }
  /// To be called once a minor frame with the true state.
  void sample(MonotonicTime now, const VehicleState& state) noexcept;
  [[nodiscard]] Status read(firmware_if::ImuSample& sample) noexcept override {
    return imu_.pop(sample, now_);
  }
  [[nodiscard]] Status read(firmware_if::GnssFix& fix) noexcept override { return gnss_.pop(fix, now_); }
  [[nodiscard]] Status read(firmware_if::BarometerSample& s) noexcept override {
    return barometer_.pop(s, now_);
  }
  [[nodiscard]] Status read(firmware_if::OdometrySample& s) noexcept override { return odometry_.read(s); }

 private:
  void sample_imu(const VehicleState& state) noexcept;
  void sample_gnss(const VehicleState& state) noexcept;
  void sample_barometer(const VehicleState& state) noexcept;
  void sample_product_imu(const VehicleState& state, firmware_if::ImuSample& sample) noexcept;
  void sample_product_gnss(const VehicleState& state) noexcept;
  [[nodiscard]] double compass_rad(const VehicleState& state) noexcept;

  /// What a product of this kind has for life.
  struct Build {
    Vector3 gyro_scale, accel_scale, gyro_misalignment, accel_misalignment;
    std::array<double, 3> compass_rad;  ///< Constant, by sine of the heading, by sine of twice the heading.
    std::array<double, 2> compass_phase_rad;
    double compass_current_rad;
    std::array<Vector3, 4> shake;  ///< Direction in which each rotor shakes, of length 1.
  };

  NavigationSensorsConfig config_;
  ImuErrors imu_errors_{};
  GnssErrors gnss_errors_{};
  const World* world_{nullptr};
  Build build_{};
  std::array<double, 4> rotor_rad_{};
  Vector3 drift_W_m_ = Vector3::Zero();
  Vector3 multipath_{Vector3::Zero()};  ///< Of sigma 1.
  double place_deg_{0.0};               ///< What the place does to the compass.
  SurfaceLattice lattice_;
  MonotonicTime last_imu_{};
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
  VisualOdometry odometry_;
};

}  // namespace roborun::sitl
