#include "platform/live/plant_bus.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::live {
namespace {

namespace dc = firmware_if::dronecan;

constexpr std::uint8_t kImuNode = 30, kReceiverNode = 31, kBarometerNode = 32;
constexpr Nanos kTimePeriod{500'000'000};
constexpr Nanos kAlways{0};  // what is said when there is a sample

std::array<float, 3> to_frd(const std::array<double, 3>& flu, double scale) noexcept {
  return {static_cast<float>(scale * flu[0]), static_cast<float>(-scale * flu[1]),
          static_cast<float>(-scale * flu[2])};
}

}  // namespace

SensorNodes::SensorNodes(firmware_if::CanBus& bus, const sensor_port::EarthPlace& origin)
    : time_(bus, kImuNode, 1, kTimePeriod),
      imu_(bus, kImuNode, 2, kAlways),
      fix_(bus, kReceiverNode, 16, kAlways),
      heading_(bus, kReceiverNode, 16, kAlways),
      pressure_(bus, kBarometerNode, 16, kAlways),
      temperature_(bus, kBarometerNode, 20, Nanos{1'000'000'000}),
      imu_beat_(bus, kImuNode),
      receiver_beat_(bus, kReceiverNode),
      barometer_beat_(bus, kBarometerNode),
      frame_(origin),
      origin_height_m_(origin.height_m) {}

dc::Timestamp SensorNodes::stamp_of(MonotonicTime stamp) const noexcept {
  return {static_cast<std::uint64_t>(std::max<std::int64_t>((stamp + ahead_).time_since_epoch().count(), 0)) /
          1000};
}

void SensorNodes::step(MonotonicTime now, Nanos ahead) noexcept {
  now_ = now;
  ahead_ = ahead;
  imu_beat_.step(now);
  receiver_beat_.step(now);
  barometer_beat_.step(now);
  if (temperature_.due(now)) temperature_.say({.static_temperature = 300.0F}, now);
  if (!time_.due(now)) return;
  // When the one before was sent, on this clock; 0: it is the first.
  time_.say({told_usec_}, now);
  told_usec_ = stamp_of(now).usec;
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
  if (!std::isfinite(fix.heading_rad)) return;
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
