#include "platform/sitl/sensors/navigation_sensors.hpp"

#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::sitl {
namespace {

// One draw a statement: the order of evaluation of arguments is not fixed.
Vector3 normal3(core::CounterRng& rng, double sigma) noexcept {
  Vector3 result;
  for (int i = 0; i < 3; ++i) result[i] = sigma * rng.normal();
  return result;
}

double wander(double value, double sigma, double correlation_s, double dt_s, core::CounterRng& rng) noexcept {
  const double decay = core::exp(-dt_s / correlation_s);
  return decay * value + std::sqrt(1.0 - decay * decay) * sigma * rng.normal();
}

std::array<double, 3> to_array(const Vector3& v) noexcept { return {v.x(), v.y(), v.z()}; }

}  // namespace

NavigationSensors::NavigationSensors(const NavigationSensorsConfig& config, std::uint64_t seed) noexcept
    : config_(config), imu_rng_(seed, 3), gnss_rng_(seed, 4), barometer_rng_(seed, 5) {
  gyro_bias_B_radps_ = normal3(imu_rng_, config.gyro_bias_radps);
  accel_bias_B_mps2_ = normal3(imu_rng_, config.accel_bias_mps2);
}

void NavigationSensors::sample(MonotonicTime now, const VehicleState& state) noexcept {
  now_ = now;
  sample_imu(state);
  if (now >= next_gnss_) {
    next_gnss_ = now + from_seconds(1.0 / config_.gnss_rate_Hz);
    sample_gnss(state);
  }
  if (now >= next_barometer_) {
    next_barometer_ = now + from_seconds(1.0 / config_.barometer_rate_Hz);
    sample_barometer(state);
  }
}

void NavigationSensors::sample_imu(const VehicleState& state) noexcept {
  firmware_if::ImuSample s;
  s.stamp = now_;
  s.sequence = ++imu_sequence_;
  const Vector3 force_W = state.a_WB + Vector3(0.0, 0.0, core::kGravity_mps2);
  const Vector3 gyro = state.w_WB_B + gyro_bias_B_radps_ + normal3(imu_rng_, config_.gyro_noise_radps);
  const Vector3 force = state.q_WB.toRotationMatrix().transpose() * force_W + accel_bias_B_mps2_ +
                        normal3(imu_rng_, config_.accel_noise_mps2);
  s.angular_rate_B_radps = to_array(gyro);
  s.specific_force_B_mps2 = to_array(force);
  imu_.push(s, now_);
}

void NavigationSensors::sample_gnss(const VehicleState& state) noexcept {
  for (int i = 0; i < 3; ++i) {
    gnss_wander_W_m_[i] =
        wander(gnss_wander_W_m_[i], config_.gnss_wander_m, 60.0, 1.0 / config_.gnss_rate_Hz, gnss_rng_);
  }
  firmware_if::GnssFix fix;
  fix.stamp = now_;
  fix.sequence = ++gnss_sequence_;
  Vector3 noise_W_m = normal3(gnss_rng_, config_.gnss_horizontal_m);
  noise_W_m.z() *= config_.gnss_vertical_m / config_.gnss_horizontal_m;
  const Vector3 speed_noise_W_mps = normal3(gnss_rng_, config_.gnss_speed_mps);
  const double heading_noise_rad = config_.gnss_heading_rad * gnss_rng_.normal();
  const bool lost = gnss_rng_.uniform() < config_.gnss_dropout_ratio;
  fix.p_WB_m = to_array(state.p_WB + gnss_wander_W_m_ + noise_W_m);
  fix.v_WB_mps = to_array(state.v_WB + speed_noise_W_mps);
  const Matrix3 R_WB = state.q_WB.toRotationMatrix();
  fix.heading_rad = core::wrap_angle(core::atan2(R_WB(1, 0), R_WB(0, 0)) + heading_noise_rad);
  fix.sigma_horizontal_m = config_.gnss_horizontal_m;
  fix.sigma_vertical_m = config_.gnss_vertical_m;
  fix.sigma_speed_mps = config_.gnss_speed_mps;
  fix.sigma_heading_rad = config_.gnss_heading_rad;
  if (!lost) gnss_.push(fix, now_ + from_seconds(config_.gnss_latency_s));
}

void NavigationSensors::sample_barometer(const VehicleState& state) noexcept {
  barometer_wander_m_ = wander(barometer_wander_m_, config_.barometer_wander_m, 120.0,
                               1.0 / config_.barometer_rate_Hz, barometer_rng_);
  firmware_if::BarometerSample s;
  s.stamp = now_;
  s.sequence = ++barometer_sequence_;
  s.altitude_m = state.p_WB.z() + barometer_wander_m_ + config_.barometer_noise_m * barometer_rng_.normal();
  barometer_.push(s, now_ + from_seconds(config_.barometer_latency_s));
}

}  // namespace roborun::sitl
