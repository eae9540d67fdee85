#include "platform/live/plant_bus.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/geometry/math.hpp"
#include "core/random/counter_rng.hpp"
#include "platform/live/earth_field.hpp"

namespace roborun::live {
namespace {

namespace dc = firmware_if::dronecan;

constexpr std::uint8_t kImuNode = 30, kReceiverNode = 31, kBarometerNode = 32, kRangeNode = 33;
constexpr Nanos kTimePeriod{500'000'000};
constexpr Nanos kAlways{0};  // what is said when there is a sample

std::array<float, 3> to_frd(const std::array<double, 3>& flu, double scale) noexcept {
  return {static_cast<float>(scale * flu[0]), static_cast<float>(-scale * flu[1]),
          static_cast<float>(-scale * flu[2])};
}

}  // namespace

SensorNodes::SensorNodes(firmware_if::CanBus& bus, const sensor_port::EarthPlace& origin, GnssModel receiver)
    : time_(bus, kImuNode, 1, kTimePeriod),
      imu_(bus, kImuNode, 2, kAlways),
      fix_(bus, kReceiverNode, 16, kAlways),
      heading_(bus, kReceiverNode, 16, kAlways),
      pressure_(bus, kBarometerNode, 16, kAlways),
      temperature_(bus, kBarometerNode, 20, Nanos{1'000'000'000}),
      field_(bus, kReceiverNode, 16, Nanos{20'000'000}),
      range_(bus, kRangeNode, 20, Nanos{50'000'000}),
      imu_beat_(bus, kImuNode),
      receiver_beat_(bus, kReceiverNode),
      barometer_beat_(bus, kBarometerNode),
      range_beat_(bus, kRangeNode),
      frame_(origin),
      origin_height_m_(origin.height_m),
      earth_W_gauss_(earth_field_gauss(origin.latitude_deg, origin.longitude_deg)),
      has_magnetometer_(receiver == GnssModel::kM9n) {}

dc::Timestamp SensorNodes::stamp_of(MonotonicTime stamp) const noexcept {
  return {static_cast<std::uint64_t>(std::max<std::int64_t>((stamp + ahead_).time_since_epoch().count(), 0)) /
          1000};
}

void SensorNodes::step(MonotonicTime now, Nanos ahead, const sitl::Vehicle& vehicle) noexcept {
  now_ = now;
  ahead_ = ahead;
  imu_beat_.step(now);
  receiver_beat_.step(now);
  barometer_beat_.step(now);
  range_beat_.step(now);
  if (has_magnetometer_ && field_.due(now)) say_field(vehicle);
  if (range_.due(now)) say_range(vehicle);
  if (temperature_.due(now)) temperature_.say({.static_temperature = 300.0F}, now);
  if (!time_.due(now)) return;
  // When the one before was sent, on this clock; 0: it is the first.
  time_.say({told_usec_}, now);
  told_usec_ = stamp_of(now).usec;
}

/// What a calibrated magnetometer still has of the vehicle itself: a remanence, and the currents of the motors; and its noise
/// (IST8310, as in most GNSS modules).
void SensorNodes::say_field(const sitl::Vehicle& vehicle) noexcept {
  constexpr double kNoise_gauss = 0.003;
  const Vector3 remanent_B_gauss(0.008, -0.006, 0.010), at_full_throttle_B_gauss(0.010, 0.015, -0.030);
  const auto& throttle = vehicle.commanded().thrust_ratio;
  const double mean =
      std::accumulate(throttle.begin(), throttle.end(), 0.0) / static_cast<double>(throttle.size());
  Vector3 field_B = vehicle.state().q_WB.inverse() * earth_W_gauss_;
  field_B += remanent_B_gauss + mean * at_full_throttle_B_gauss;
  core::CounterRng rng(static_cast<std::uint64_t>(now_.time_since_epoch().count()), 51);
  for (double& axis : field_B) axis += kNoise_gauss * rng.normal();
  dc::MagneticFieldStrength2 m;
  m.magnetic_field_ga = to_frd({field_B.x(), field_B.y(), field_B.z()}, 1.0);
  field_.say(m, now_);
}

/// A laser of 12 m (as TFmini-S: 6 cm below 6 m, 1 % above).
void SensorNodes::say_range(const sitl::Vehicle& vehicle) noexcept {
  constexpr double kNearest_m = 0.1, kFarthest_m = 12.0, kNoise_m = 0.02, kNoise_ratio = 0.003;
  const double cosine = (vehicle.state().q_WB * Vector3::UnitZ()).z();
  const double height_m = std::max(vehicle.state().p_WB.z() - vehicle.ground_m(), 0.0);
  const double true_m = cosine > 0.1 ? height_m / cosine : 2.0 * kFarthest_m;
  core::CounterRng rng(static_cast<std::uint64_t>(now_.time_since_epoch().count()), 52);
  const double range_m = true_m + std::max(kNoise_m, kNoise_ratio * true_m) * rng.normal();
  dc::RangeMeasurement m;
  m.timestamp = stamp_of(now_);
  m.beam_orientation_in_body_frame = {{0, -8, 0}, true};
  m.sensor_type = 2;
  m.reading_type = range_m < kNearest_m ? 2 : range_m > kFarthest_m ? 3 : 1;
  m.range = static_cast<float>(range_m);
  range_.say(m, now_);
}

void SensorNodes::say(const firmware_if::ImuSample& sample) noexcept {
  dc::RawImu m;
  m.timestamp = stamp_of(sample.stamp);
  const double interval_s = measured_ == MonotonicTime{} ? 0.0 : seconds(sample.stamp - measured_);
  measured_ = sample.stamp;
  m.integration_interval = static_cast<float>(interval_s);
  m.rate_gyro_latest = to_frd(sample.angular_rate_B_radps, 1.0);
  m.rate_gyro_integral = to_frd(sample.angular_rate_B_radps, interval_s);
  m.accelerometer_latest = to_frd(sample.specific_force_B_mps2, 1.0);
  m.accelerometer_integral = to_frd(sample.specific_force_B_mps2, interval_s);
  imu_.say(m, now_);
}

void SensorNodes::say(const firmware_if::GnssFix& fix) noexcept {
  const sensor_port::EarthPlace place = frame_.to_earth(fix.p_WB_m);
  dc::GnssFix2 m;
  m.timestamp = stamp_of(fix.stamp);
  m.latitude_deg_1e8 = std::llround(1e8 * place.latitude_deg);
  m.longitude_deg_1e8 = std::llround(1e8 * place.longitude_deg);
  m.height_ellipsoid_mm = static_cast<std::int32_t>(std::lround(1e3 * place.height_m));
  m.height_msl_mm = m.height_ellipsoid_mm;
  m.ned_velocity = {static_cast<float>(fix.v_WB_mps[1]), static_cast<float>(fix.v_WB_mps[0]),
                    static_cast<float>(-fix.v_WB_mps[2])};
  m.sats_used = 16;
  m.status = 3;
  const auto variance = [&](double sigma) {
    (void)m.covariance.push_back(static_cast<float>(sigma * sigma));
  };
  for (const double sigma_m : {fix.sigma_horizontal_m, fix.sigma_horizontal_m, fix.sigma_vertical_m})
    variance(sigma_m);
  for (int i = 0; i < 3; ++i) variance(fix.sigma_speed_mps);
  fix_.say(m, now_);
  if (has_magnetometer_ || !std::isfinite(fix.heading_rad)) return;
  heading_.say({.heading_valid = true,
                .heading_accuracy_valid = true,
                .heading_rad = static_cast<float>(core::wrap_angle(0.5 * core::kPi - fix.heading_rad)),
                .heading_accuracy_rad = static_cast<float>(fix.sigma_heading_rad)},
               now_);
}

void SensorNodes::say(const firmware_if::BarometerSample& sample) noexcept {
  pressure_.say(
      {.static_pressure = static_cast<float>(sensor_port::pressure_at(origin_height_m_ + sample.altitude_m))},
      now_);
}

void PlantOperator::step(MonotonicTime now, bool heard) noexcept {
  constexpr Nanos kGone{1'000'000'000};
  if (heard && (!hears_ || now - heard_ > kGone)) began_ = now;
  if (heard) heard_ = now;
  hears_ = hears_ || heard;
  if (hears_) time_s_ = seconds(now - began_);
}

bool PlantOperator::presses_kill() const noexcept { return !flies_ && time_s_ > 0.5 && time_s_ < 1.0; }

bool PlantOperator::arms() const noexcept {
  return flies_ || (time_s_ > 1.5 && std::fmod(time_s_, 1.0) > 0.5);
}

}  // namespace roborun::live
