#include "platform/sitl/sensors/navigation_sensors.hpp"

#include <cmath>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "platform/sitl/sensors/draws.hpp"
#include "platform/sitl/sensors/exposures.hpp"

namespace roborun::sitl {
namespace {

double wander(double value, double sigma, double correlation_s, double dt_s, core::CounterRng& rng) noexcept {
  const double decay = core::exp(-dt_s / correlation_s);
  return decay * value + std::sqrt(1.0 - decay * decay) * sigma * rng.normal();
}

std::array<double, 3> to_array(const Vector3& v) noexcept { return {v.x(), v.y(), v.z()}; }

}  // namespace

double sky_ratio(const World& world, const Vector3& p_W) noexcept {
  constexpr double kFar_m = 80.0;
  int open = 0;
  for (const double elevation_rad : {20.0 * core::kDegree, 50.0 * core::kDegree}) {
    for (int i = 0; i < 8; ++i) {
      const double azimuth_rad = 0.25 * core::kPi * (i + 0.5), level = core::cos(elevation_rad);
      const Vector3 toward_W(level * core::cos(azimuth_rad), level * core::sin(azimuth_rad),
                             core::sin(elevation_rad));
      open += world.hit_distance_m(p_W, toward_W, kFar_m) < kFar_m ? 0 : 1;
    }
  }
  return open / 16.0;
}

NavigationSensors::NavigationSensors(const NavigationSensorsConfig& config, std::uint64_t seed) noexcept
    : config_(config),
      lattice_(seed),
      imu_rng_(seed, 3),
      gnss_rng_(seed, 4),
      barometer_rng_(seed, 5),
      odometry_(config.odometry, seed) {
  const bool product = config.imu != ImuModel::kClean;
  gyro_bias_B_radps_ = normal3(imu_rng_, product ? imu_errors_.gyro_bias_radps : config.gyro_bias_radps);
  accel_bias_B_mps2_ = normal3(imu_rng_, product ? imu_errors_.accel_bias_mps2 : config.accel_bias_mps2);
  core::CounterRng made(seed, 6);
  build_.gyro_scale = normal3(made, imu_errors_.scale_ratio);
  build_.accel_scale = normal3(made, imu_errors_.scale_ratio);
  build_.gyro_misalignment = normal3(made, imu_errors_.misalignment_ratio);
  build_.accel_misalignment = normal3(made, imu_errors_.misalignment_ratio);
  const GnssErrors& g = gnss_errors_;
  build_.compass_rad = {core::kDegree * g.compass_bias_deg * made.normal(),
                        core::kDegree * g.compass_iron_deg * made.normal(),
                        core::kDegree * g.compass_iron_deg * made.normal()};
  for (double& phase_rad : build_.compass_phase_rad) phase_rad = 2.0 * core::kPi * made.uniform();
  build_.compass_current_rad = core::kDegree * g.compass_current_deg * made.normal();
  for (Vector3& direction : build_.shake) direction = normal3(made, 1.0).normalized();
  for (double& angle_rad : rotor_rad_) angle_rad = 2.0 * core::kPi * made.uniform();
  // Drift and multipath began long before.
  drift_W_m_ = normal3(made, g.drift_m);
  drift_W_m_.z() *= g.up_ratio;
  multipath_ = normal3(made, 1.0);
}

void NavigationSensors::sample(MonotonicTime now, const VehicleState& state) noexcept {
  now_ = now;
  sample_imu(state);
  odometry_.sample(now, state);
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
  if (config_.imu != ImuModel::kClean) return sample_product_imu(state, s);
  const Vector3 force_W = state.a_WB + Vector3(0.0, 0.0, core::kGravity_mps2);
  const Vector3 gyro = state.w_WB_B + gyro_bias_B_radps_ + normal3(imu_rng_, config_.gyro_noise_radps);
  const Vector3 force = state.q_WB.toRotationMatrix().transpose() * force_W + accel_bias_B_mps2_ +
                        normal3(imu_rng_, config_.accel_noise_mps2);
  s.angular_rate_B_radps = to_array(gyro);
  s.specific_force_B_mps2 = to_array(force);
  imu_.push(s, now_);
}

void NavigationSensors::sample_product_imu(const VehicleState& state, firmware_if::ImuSample& s) noexcept {
  const ImuErrors& e = imu_errors_;
  const double dt_s = imu_sequence_ > 1 ? seconds(now_ - last_imu_) : 0.0;
  last_imu_ = now_;
  const double root_s = std::sqrt(dt_s);
  gyro_bias_B_radps_ += normal3(imu_rng_, e.gyro_walk_radps * root_s);
  accel_bias_B_mps2_ += normal3(imu_rng_, e.accel_walk_mps2 * root_s);
  Vector3 shaken_mps2 = Vector3::Zero(), shaken_radps = Vector3::Zero();
  for (std::size_t i = 0; i < rotor_rad_.size(); ++i) {
    // Thrust goes with the turning rate squared.
    const double thrust = state.thrust_ratio[i];
    rotor_rad_[i] = core::wrap_angle(rotor_rad_[i] + 2.0 * core::kPi * e.rotor_Hz * std::sqrt(thrust) * dt_s);
    const double wave = thrust * core::sin(rotor_rad_[i]);
    shaken_mps2 += e.vibration_mps2 * wave * build_.shake[i];
    shaken_radps += e.vibration_radps * wave * build_.shake[i];
  }
  const auto distort = [](const Vector3& x, const Vector3& scale, const Vector3& misalignment) -> Vector3 {
    return x + scale.cwiseProduct(x) + misalignment.cross(x);
  };
  const Vector3 force_B =
      state.q_WB.toRotationMatrix().transpose() * (state.a_WB + Vector3(0.0, 0.0, core::kGravity_mps2));
  const Vector3 gyro = distort(state.w_WB_B, build_.gyro_scale, build_.gyro_misalignment) +
                       gyro_bias_B_radps_ + shaken_radps + normal3(imu_rng_, e.gyro_noise_radps);
  const Vector3 force = distort(force_B, build_.accel_scale, build_.accel_misalignment) + accel_bias_B_mps2_ +
                        shaken_mps2 + normal3(imu_rng_, e.accel_noise_mps2);
  s.angular_rate_B_radps = to_array(gyro);
  s.specific_force_B_mps2 = to_array(force);
  imu_.push(s, now_);
}

double NavigationSensors::compass_rad(const VehicleState& state) noexcept {
  const Matrix3 R_WB = state.q_WB.toRotationMatrix();
  const double heading_rad = core::yaw_of(R_WB);
  double throttle = 0.0;
  for (const double ratio : state.thrust_ratio) throttle += 0.25 * ratio;
  const double place = bounded_normal(lattice_.bits(SurfaceLattice::turn() * state.p_WB, 4.0)) *
                       gnss_errors_.compass_place_deg;
  // It goes from one place to the next in a second.
  place_deg_ += (1.0 - core::exp(-1.0 / config_.gnss_rate_Hz)) * (place - place_deg_);
  return core::wrap_angle(heading_rad + build_.compass_rad[0] +
                          build_.compass_rad[1] * core::sin(heading_rad + build_.compass_phase_rad[0]) +
                          build_.compass_rad[2] * core::sin(2.0 * heading_rad + build_.compass_phase_rad[1]) +
                          build_.compass_current_rad * throttle +
                          core::kDegree * (place_deg_ + gnss_errors_.compass_noise_deg * gnss_rng_.normal()));
}

void NavigationSensors::sample_product_gnss(const VehicleState& state) noexcept {
  const GnssErrors& e = gnss_errors_;
  const double dt_s = 1.0 / config_.gnss_rate_Hz;
  const double sky = world_ != nullptr ? sky_ratio(*world_, state.p_WB) : 1.0;
  const double hidden = 1.0 - sky;
  for (int i = 0; i < 3; ++i) {
    const double up = i == 2 ? e.up_ratio : 1.0;
    drift_W_m_[i] = wander(drift_W_m_[i], up * e.drift_m, e.drift_s, dt_s, gnss_rng_);
    multipath_[i] = wander(multipath_[i], 1.0, e.multipath_s, dt_s, gnss_rng_);
  }
  Vector3 error_W_m = (e.multipath_m + e.shaded_m * hidden) * multipath_ + normal3(gnss_rng_, e.noise_m);
  error_W_m.z() *= e.up_ratio;
  firmware_if::GnssFix fix;
  fix.stamp = now_;
  fix.sequence = ++gnss_sequence_;
  fix.p_WB_m = to_array(state.p_WB + drift_W_m_ + error_W_m);
  fix.v_WB_mps =
      to_array(state.v_WB + normal3(gnss_rng_, e.speed_mps * (1.0 + e.speed_shaded_ratio * hidden)));
  fix.heading_rad = compass_rad(state);
  const double worse_m = 0.5 * e.shaded_m * hidden;
  fix.sigma_horizontal_m = e.said_m + worse_m;
  fix.sigma_vertical_m = e.said_up_m + e.up_ratio * worse_m;
  fix.sigma_speed_mps = e.speed_mps * (1.0 + e.speed_shaded_ratio * hidden);
  fix.sigma_heading_rad = e.said_heading_rad;
  const bool lost = gnss_rng_.uniform() < e.lost_ratio || sky < e.least_sky_ratio;
  if (!lost) gnss_.push(fix, now_ + from_seconds(e.latency_s));
}

void NavigationSensors::sample_gnss(const VehicleState& state) noexcept {
  if (config_.gnss == GnssModel::kNone) return;
  if (config_.gnss != GnssModel::kClean) return sample_product_gnss(state);
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
  fix.heading_rad = core::wrap_angle(core::yaw_of(R_WB) + heading_noise_rad);
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
