#include "platform/live/bus_sensors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/math.hpp"
#include "platform/live/earth_field.hpp"

namespace roborun::live {
namespace {

namespace dc = firmware_if::dronecan;

constexpr std::array kTypes{dc::kType<dc::RawImu>,
                            dc::kType<dc::GnssFix2>,
                            dc::kType<dc::GnssHeading>,
                            dc::kType<dc::StaticPressure>,
                            dc::kType<dc::GlobalTimeSync>,
                            dc::kType<dc::MagneticFieldStrength>,
                            dc::kType<dc::MagneticFieldStrength2>,
                            dc::kType<dc::RangeMeasurement>};
constexpr int kMostFrames = 128;           // 17 ms of a full bus
constexpr Nanos kLongestAge{500'000'000};  // of a measurement, from its own stamp
constexpr Nanos kSameEpoch{50'000'000};    // between a fix and its heading
constexpr double kUnstatedHeading_rad = 0.05;
constexpr std::uint8_t kFix3d = 3;
// At rest, before a flight.
constexpr double kLeastRate_Hz = 100.0;
constexpr double kGravityError_mps2 = 1.0;
constexpr double kUprightCos = 0.85;
constexpr double kStanding_m = 1.0;
constexpr Nanos kAntennas{1'000'000'000};  // silent for so long, two antennas say no heading

/// From forward, right, down to forward, left, up.
std::array<double, 3> to_flu(const auto& frd, double scale) noexcept {
  return {scale * static_cast<double>(frd[0]), -scale * static_cast<double>(frd[1]),
          -scale * static_cast<double>(frd[2])};
}

bool are_finite(const std::array<double, 3>& v) noexcept {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

/// Variances of north, east, down, and of the speeds along them. A covariance is empty, one number, the diagonal, the upper
/// triangle by rows, or whole. NaN: not stated.
std::array<double, 6> variances_of(const auto& covariance) noexcept {
  constexpr std::array<std::size_t, 6> kTriangle{0, 6, 11, 15, 18, 20};
  std::array<double, 6> out{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::size_t at = covariance.count == 36   ? 7 * i
                           : covariance.count == 21 ? kTriangle.at(i)
                           : covariance.count == 1  ? 0
                                                    : i;
    const bool stated =
        covariance.count == 36 || covariance.count == 21 || covariance.count == 6 || covariance.count == 1;
    out.at(i) =
        stated ? static_cast<double>(covariance.items.at(at)) : std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

bool is_ours(const auto&) noexcept { return true; }
/// One that says that it looks elsewhere than down is another one's.
bool is_ours(const dc::RangeMeasurement& m) noexcept {
  constexpr int kDown = -8, kNearlyDown = -7;  // of pitch, in fifteenths of pi
  const auto& beam = m.beam_orientation_in_body_frame;
  const auto pitch = beam.fixed_axis_roll_pitch_yaw[1];
  return !beam.orientation_defined || pitch == kDown || pitch == kNearlyDown;
}

}  // namespace

BusSensors::BusSensors(firmware_if::CanBus& bus, const SensorRig& rig,
                       const std::optional<sensor_port::EarthPlace>& origin)
    : bus_(bus),
      has_gnss_(rig.gnss != GnssModel::kNone),
      needs_heading_(rig.odometry == OdometryModel::kNone),
      reassembler_(kTypes, sessions_, 0) {
  if (origin) begin_at(*origin);
}

void BusSensors::begin_at(const sensor_port::EarthPlace& origin) noexcept {
  frame_.emplace(origin);
  compass_.stand_in(earth_field_gauss(origin.latitude_deg, origin.longitude_deg));
}

void BusSensors::hear(MonotonicTime now) noexcept {
  firmware_if::CanFrame frame;
  dc::Transfer transfer;
  for (int i = 0; i < kMostFrames && bus_.receive(frame) == Status::kOk; ++i) {
    if (reassembler_.receive(frame, transfer) == dc::FrameVerdict::kDelivered) take(transfer);
  }
  if (waiting_ && now - waits_since_ > kSameEpoch) let_go();
}

void BusSensors::take(const dc::Transfer& transfer) noexcept {
  if (transfer.header.source_node_id == 0) return;
  switch (transfer.header.data_type_id) {
    case dc::kType<dc::RawImu>.id:
      return hear_as<dc::RawImu>(transfer, imu_voice_);
    case dc::kType<dc::GnssFix2>.id:
      return hear_as<dc::GnssFix2>(transfer, fix_voice_);
    case dc::kType<dc::GnssHeading>.id:
      return hear_as<dc::GnssHeading>(transfer, heading_voice_);
    case dc::kType<dc::StaticPressure>.id:
      return hear_as<dc::StaticPressure>(transfer, pressure_voice_);
    case dc::kType<dc::MagneticFieldStrength>.id:
      return hear_as<dc::MagneticFieldStrength>(transfer, field_voice_);
    case dc::kType<dc::MagneticFieldStrength2>.id:
      return hear_as<dc::MagneticFieldStrength2>(transfer, field_voice_);
    case dc::kType<dc::RangeMeasurement>.id:
      return hear_as<dc::RangeMeasurement>(transfer, range_voice_);
    default: {
      dc::GlobalTimeSync sync;
      if (dc::decode(transfer.payload, sync) == Status::kOk)
        time_.take(transfer.header, sync, transfer.stamp);
      return;
    }
  }
}

template <typename T>
void BusSensors::hear_as(const dc::Transfer& transfer, Voice& voice) noexcept {
  if (voice.node != 0 && voice.node != transfer.header.source_node_id) {
    ++voice.foreign;
    return;
  }
  T message;
  if (dc::decode(transfer.payload, message) != Status::kOk) {
    (void)accept(voice, "is no message of its type", transfer.stamp);
    return;
  }
  if (!is_ours(message)) return;
  voice.node = transfer.header.source_node_id;
  take(message, transfer.stamp);
}

bool BusSensors::accept(Voice& voice, const char* why, MonotonicTime stamp) noexcept {
  const bool is_first = voice.stamp == MonotonicTime::min();
  if (why == nullptr && stamp > voice.stamp) {
    if (!is_first && stamp - voice.stamp > voice.patience) ++voice.silences;
    voice.stamp = stamp;
    voice.refusal = nullptr;
    ++voice.taken;
    return true;
  }
  if (why == nullptr) {
    // As with ports, a clock that goes back costs one sample.
    why = "comes with a clock that goes back";
    voice.stamp = stamp;
  }
  voice.refusal = why;
  ++voice.refused;
  return false;
}

MonotonicTime BusSensors::measured_at(std::uint64_t usec, MonotonicTime came,
                                      MonotonicTime otherwise) const noexcept {
  constexpr Nanos kAhead{2'000'000};
  const auto local = time_.local(usec, came);
  if (!local || came - *local > kLongestAge || *local - came > kAhead) return otherwise;
  return std::min(*local, came);
}

void BusSensors::take(const dc::RawImu& m, MonotonicTime came) noexcept {
  imu_voice_.heard = came;
  constexpr double kShortest_s = 1e-4, kLongest_s = 0.02;
  const double interval_s = static_cast<double>(m.integration_interval);
  firmware_if::ImuSample sample;
  bool measured = interval_s >= kShortest_s && interval_s <= kLongest_s;
  if (measured) {
    sample.angular_rate_B_radps = to_flu(m.rate_gyro_integral, 1.0 / interval_s);
    sample.specific_force_B_mps2 = to_flu(m.accelerometer_integral, 1.0 / interval_s);
    measured = are_finite(sample.angular_rate_B_radps) && are_finite(sample.specific_force_B_mps2);
  }
  if (!measured) {
    sample.angular_rate_B_radps = to_flu(m.rate_gyro_latest, 1.0);
    sample.specific_force_B_mps2 = to_flu(m.accelerometer_latest, 1.0);
    measured = are_finite(sample.angular_rate_B_radps) && are_finite(sample.specific_force_B_mps2);
  }
  sample.stamp = measured_at(m.timestamp.usec, came, came);
  if (!accept(imu_voice_, measured ? nullptr : "is not finite", sample.stamp)) return;
  sample.sequence = static_cast<std::uint32_t>(imu_voice_.taken);
  (void)imu_.ring.push(sample);
}

void BusSensors::take(const dc::GnssFix2& m, MonotonicTime came) noexcept {
  fix_voice_.heard = came;
  satellites_ = m.sats_used;
  const sensor_port::EarthPlace place{1e-8 * static_cast<double>(m.latitude_deg_1e8),
                                      1e-8 * static_cast<double>(m.longitude_deg_1e8),
                                      1e-3 * static_cast<double>(m.height_ellipsoid_mm)};
  const auto wide = [&](std::size_t i) { return static_cast<double>(m.ned_velocity.at(i)); };
  firmware_if::GnssFix fix;
  fix.v_WB_mps = {wide(1), wide(0), -wide(2)};
  const std::array<double, 6> variance = variances_of(m.covariance);
  const bool states_error =
      std::all_of(variance.begin(), variance.end(), [](double v) { return std::isfinite(v) && v > 0.0; });
  const char* why = m.status != kFix3d                 ? "is no 3D fix"
                    : !states_error                    ? "does not state its errors (covariance)"
                    : !sensor_port::is_on_earth(place) ? "is no place on the earth"
                    : !are_finite(fix.v_WB_mps)        ? "is not finite"
                                                       : nullptr;
  fix.stamp = measured_at(m.timestamp.usec, came, came - kFixAge);
  if (!accept(fix_voice_, why, fix.stamp)) return;
  if (!frame_) begin_at(place);
  fix.sequence = static_cast<std::uint32_t>(fix_voice_.taken);
  fix.p_WB_m = frame_->to_local_m(place);
  fix.sigma_horizontal_m = std::sqrt(std::max(variance[0], variance[1]));
  fix.sigma_vertical_m = std::sqrt(variance[2]);
  fix.sigma_speed_mps = std::sqrt(std::max({variance[3], variance[4], variance[5]}));
  fix.heading_rad = std::numeric_limits<double>::quiet_NaN();
  if (waiting_) let_go();
  waiting_ = fix;
  waits_since_ = came;
}

/// A receiver says the heading of an epoch after its fix.
void BusSensors::take(const dc::GnssHeading& m, MonotonicTime came) noexcept {
  heading_voice_.heard = came;
  const double clockwise_rad = static_cast<double>(m.heading_rad);
  const double stated_rad = static_cast<double>(m.heading_accuracy_rad);
  const bool says_error = m.heading_accuracy_valid && std::isfinite(stated_rad) && stated_rad > 0.0;
  const char* why = !m.heading_valid                                 ? "is not valid yet"
                    : !(std::fabs(clockwise_rad) <= 4.0 * core::kPi) ? "is no angle"
                                                                     : nullptr;
  if (!accept(heading_voice_, why, came) || !waiting_ || came - waits_since_ > kSameEpoch) return;
  waiting_->heading_rad = core::wrap_angle(0.5 * core::kPi - clockwise_rad);
  waiting_->sigma_heading_rad = says_error ? stated_rad : kUnstatedHeading_rad;
  let_go();
}

void BusSensors::let_go() noexcept {
  const bool has_two_antennas = heading_voice_.taken > 0 && waits_since_ - heading_voice_.stamp < kAntennas;
  if (!std::isfinite(waiting_->heading_rad) && !has_two_antennas) {
    const auto apart = [&](const Bearing& b) {
      return std::max(b.stamp - waiting_->stamp, waiting_->stamp - b.stamp);
    };
    const auto nearest =
        std::min_element(bearings_.begin(), bearings_.end(), [&](const Bearing& a, const Bearing& b) {
          return a.stamp != MonotonicTime::min() && (b.stamp == MonotonicTime::min() || apart(a) < apart(b));
        });
    if (nearest->stamp != MonotonicTime::min() && apart(*nearest) <= kSameEpoch) {
      waiting_->heading_rad = nearest->heading.rad;
      waiting_->sigma_heading_rad = nearest->heading.sigma_rad;
    }
  }
  (void)gnss_.ring.push(*waiting_);
  waiting_.reset();
}

void BusSensors::take(const dc::StaticPressure& m, MonotonicTime came) noexcept {
  pressure_voice_.heard = came;
  const double altitude_m = sensor_port::pressure_altitude_m(static_cast<double>(m.static_pressure));
  const char* why = std::isfinite(altitude_m) ? nullptr : "is no pressure of the air";
  if (!accept(pressure_voice_, why, came)) return;
  if (!first_altitude_m_) first_altitude_m_ = altitude_m;
  firmware_if::BarometerSample sample;
  sample.stamp = came;
  sample.sequence = static_cast<std::uint32_t>(pressure_voice_.taken);
  sample.altitude_m = altitude_m - *first_altitude_m_ + start_m_;
  (void)pressure_.ring.push(sample);
}

void BusSensors::take_field(const std::array<float, 3>& field_frd, MonotonicTime came) noexcept {
  field_voice_.heard = came;
  if (!frame_ || !up_B_) return;  // nobody knows yet what it should be
  Compass::Heading heading;
  const char* why = compass_.read(Vector3(to_flu(field_frd, 1.0).data()), *up_B_, heading);
  if (!accept(field_voice_, why, came)) return;
  bearings_[next_bearing_] = {came, heading};
  next_bearing_ = (next_bearing_ + 1) % bearings_.size();
}

void BusSensors::take(const dc::MagneticFieldStrength& m, MonotonicTime came) noexcept {
  take_field(m.magnetic_field_ga, came);
}

void BusSensors::take(const dc::MagneticFieldStrength2& m, MonotonicTime came) noexcept {
  if (!magnetometer_) magnetometer_ = m.sensor_id;
  if (m.sensor_id == *magnetometer_) take_field(m.magnetic_field_ga, came);
}

void BusSensors::take(const dc::RangeMeasurement& m, MonotonicTime came) noexcept {
  constexpr std::uint8_t kUndefined = 0, kValid = 1, kTooClose = 2, kTooFar = 3;
  range_voice_.heard = came;
  const auto range_m = static_cast<double>(m.range);
  const bool measured = m.reading_type == kUndefined || m.reading_type == kValid;
  const char* why = measured && !(std::isfinite(range_m) && range_m >= 0.0) ? "is no distance"
                    : m.reading_type > kTooFar                              ? "is of no known kind"
                                                                            : nullptr;
  if (!accept(range_voice_, why, came)) return;
  range_m_ = measured ? range_m : m.reading_type == kTooClose ? 0.0 : std::numeric_limits<double>::infinity();
}

std::optional<double> BusSensors::height_m(MonotonicTime now) const noexcept {
  constexpr double kLeastCos = 0.9;  // 25 degrees: beside the vehicle from there on
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (range_voice_.node == 0) return std::nullopt;
  const bool is_fresh = range_voice_.refusal == nullptr && range_voice_.taken > 0 &&
                        now - range_voice_.stamp <= range_voice_.patience;
  if (!is_fresh || !up_B_ || !(up_B_->z() >= kLeastCos)) return kUnknown;
  return range_m_ * up_B_->z();
}

Need BusSensors::need_of_heading(MonotonicTime now) {
  Need antennas = need_of(heading_voice_, now);
  if (antennas.lacks.empty() || field_voice_.node == 0) return antennas;
  // Until then it cannot be told what it should measure.
  if (field_voice_.taken + field_voice_.refused == 0)
    return {antennas.device, "its magnetometer waits for a fix, and for an IMU at rest"};
  Need field = need_of(field_voice_, now);
  field.device = antennas.device;
  return field;
}

Need BusSensors::need_of(Voice& voice, MonotonicTime now) {
  constexpr double kOld_s = 0.5;
  const auto lacks = [&](const std::string& text) { return Need{voice.device, text}; };
  const double age_s = voice.node == 0 ? 0.0 : seconds(now - voice.heard);
  if (voice.node == 0)
    return lacks(fmt::format("no {} on the bus: is its node powered, and told to send it?", voice.message));
  if (age_s > kOld_s) {
    // On the ground another node may take its place.
    const std::string text =
        fmt::format("node {}: its newest {} is {:.1f} s old: is it alive?", voice.node, voice.message, age_s);
    if (voice.foreign > 0) voice.node = 0;
    voice.foreign = 0;
    return lacks(text);
  }
  if (voice.refusal != nullptr)
    return lacks(fmt::format("node {}: what it says of {} {}", voice.node, voice.message, voice.refusal));
  return {voice.device, {}};
}

void BusSensors::rest(MonotonicTime now) noexcept {
  firmware_if::ImuSample sample;
  while (imu_.read(sample) == Status::kOk) {
    ++rest_.count;
    rest_.sum_B_mps2 += Vector3(sample.specific_force_B_mps2.data());
  }
  const double passed_s = seconds(now - rest_.begin);
  if (passed_s < 1.0) return;
  rest_.is_known = rest_.count > 0 && passed_s < 2.0;
  if (rest_.is_known) {
    rest_.rate_Hz = static_cast<double>(rest_.count) / passed_s;
    rest_.mean_B_mps2 = rest_.sum_B_mps2 / static_cast<double>(rest_.count);
    up_B_ = rest_.mean_B_mps2.normalized();
  }
  rest_.begin = now;
  rest_.count = 0;
  rest_.sum_B_mps2.setZero();
}

void BusSensors::look(MonotonicTime now, std::vector<Need>& needs) {
  rest(now);
  Need imu = need_of(imu_voice_, now);
  const Vector3& mean = rest_.mean_B_mps2;
  const bool upright = std::fabs(mean.norm() - core::kGravity_mps2) < kGravityError_mps2 &&
                       mean.z() > kUprightCos * mean.norm();
  if (imu.lacks.empty() && !rest_.is_known) imu.lacks = "is listened to for a second";
  if (imu.lacks.empty() && rest_.rate_Hz < kLeastRate_Hz)
    imu.lacks = fmt::format("node {}: RawIMU comes {:.0f} times a second: must be {:.0f} at least",
                            imu_voice_.node, rest_.rate_Hz, kLeastRate_Hz);
  if (imu.lacks.empty() && !upright)
    imu.lacks = fmt::format(
        "node {}: measures ({:.1f}, {:.1f}, {:.1f}) m/s2 forward, left and up at rest: must be about (0, 0, "
        "9.8): "
        "look at how it is mounted, and at its calibration",
        imu_voice_.node, mean.x(), mean.y(), mean.z());
  needs.push_back(imu);
  if (has_gnss_) {
    needs.push_back(need_of(fix_voice_, now));
    if (!needs.back().lacks.empty() && fix_voice_.node != 0)
      needs.back().lacks += fmt::format(" ({} satellites)", satellites_);
    // Odometry begins with a heading of its own.
    if (needs_heading_) needs.push_back(need_of_heading(now));
    firmware_if::GnssFix fix;
    while (gnss_.read(fix) == Status::kOk) start_m_ = fix.p_WB_m[2];
  }
  needs.push_back(need_of(pressure_voice_, now));
  firmware_if::BarometerSample sample;
  while (pressure_.read(sample) == Status::kOk) {
  }
  if (range_voice_.node == 0) return;  // it need not have one
  needs.push_back(need_of(range_voice_, now));
  if (needs.back().lacks.empty() && range_m_ > kStanding_m)
    needs.back().lacks = fmt::format("node {}: measures {:.1f} m on the ground: it must look down",
                                     range_voice_.node, range_m_);
}

void BusSensors::use(MonotonicTime now, std::vector<PortUse>& all) const {
  const auto add = [&](const Voice& voice, std::uint64_t overwritten) {
    const bool silent = voice.taken > 0 && now - voice.stamp > voice.patience;
    all.push_back(
        {voice.device, voice.taken, voice.refused + overwritten, voice.silences + (silent ? 1U : 0U)});
  };
  add(imu_voice_, imu_.ring.dropped());
  if (has_gnss_) {
    add(fix_voice_, gnss_.ring.dropped());
    add(heading_voice_, 0);
    if (field_voice_.node != 0) add(field_voice_, 0);
  }
  add(pressure_voice_, pressure_.ring.dropped());
  if (range_voice_.node != 0) add(range_voice_, 0);
}

}  // namespace roborun::live
