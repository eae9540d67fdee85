#include "platform/sitl/fault/faulty_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/math.hpp"

namespace roborun::sitl {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// In [-1e6, 1e6], every third one NaN: a function of the sequence alone.
double nonsense(std::uint64_t sequence, std::uint64_t field) noexcept {
  core::CounterRng rng(sequence, field);
  return rng.below(3) == 0 ? kNaN : rng.uniform(-1e6, 1e6);
}
/// For kSlow.
bool comes(double one_in, std::uint64_t sequence) noexcept {
  return sequence % static_cast<std::uint64_t>(one_in) == 0;
}

void garble(firmware_if::ImuSample& s) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    s.angular_rate_B_radps[i] = nonsense(s.sequence, i);
    s.specific_force_B_mps2[i] = nonsense(s.sequence, 3 + i);
  }
}
void garble(firmware_if::GnssFix& f) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    f.p_WB_m[i] = nonsense(f.sequence, i);
    f.v_WB_mps[i] = nonsense(f.sequence, 3 + i);
  }
}
void garble(firmware_if::BarometerSample& s) noexcept { s.altitude_m = nonsense(s.sequence, 0); }

void garble(firmware_if::OdometrySample& s) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    s.p_OB_m[i] = nonsense(s.sequence, i);
    s.v_OB_mps[i] = nonsense(s.sequence, 3 + i);
  }
}

/// By so much in its own unit: wrong, jump, drift.
void shift(firmware_if::ImuSample& s, double by) noexcept { s.angular_rate_B_radps[0] += by; }
void shift(firmware_if::GnssFix& f, double by) noexcept { f.p_WB_m[1] += by; }
void shift(firmware_if::BarometerSample& s, double by) noexcept { s.altitude_m += by; }
void shift(firmware_if::OdometrySample& s, double by) noexcept { s.p_OB_m[1] += by; }

template <typename Sample>
void begin_anew(Sample&) noexcept {}
/// A quarter turn to the left, and elsewhere.
void begin_anew(firmware_if::OdometrySample& s) noexcept {
  constexpr double kHalf = 0.70710678118654752;
  const auto [w, x, y, z] = s.q_OB;
  ++s.reset_counter;
  s.p_OB_m = {7.0 - s.p_OB_m[1], s.p_OB_m[0] - 3.0, s.p_OB_m[2] + 1.0};
  s.v_OB_mps = {-s.v_OB_mps[1], s.v_OB_mps[0], s.v_OB_mps[2]};
  s.q_OB = {kHalf * (w - z), kHalf * (x - y), kHalf * (x + y), kHalf * (w + z)};
}

constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

void cover(std::uint64_t number, const firmware_if::DepthFrame& frame, std::vector<float>& depth_m) noexcept {
  core::CounterRng rng(number, 41);
  for (float& d : depth_m)
    d = rng.below(50) == 0 ? frame.range_min_m + static_cast<float>(rng.uniform(0.05, 0.5)) : kNoValue;
}

/// What the camera would see: the nearest pixels of what it saw, along its new axis; nothing where it did not look before.
void turn(const firmware_if::DepthFrame& frame, std::vector<float>& depth_m) noexcept {
  constexpr double kLeft_rad = 12.0 * core::kDegree, kDown_rad = 10.0 * core::kDegree;
  const core::SinCos left = core::sin_cos(kLeft_rad), down = core::sin_cos(kDown_rad);
  Matrix3 yaw, pitch;
  yaw << left.cos, -left.sin, 0.0, left.sin, left.cos, 0.0, 0.0, 0.0, 1.0;
  pitch << down.cos, 0.0, down.sin, 0.0, 1.0, 0.0, -down.sin, 0.0, down.cos;
  const Matrix3 R = yaw * pitch;
  const auto across = static_cast<double>(frame.tan_half_width),
             along = static_cast<double>(frame.tan_half_height);
  for (std::size_t v = 0; v < frame.height; ++v) {
    for (std::size_t u = 0; u < frame.width; ++u) {
      const Vector3 ray =
          R * Vector3(1.0, across * (1.0 - (2.0 * static_cast<double>(u) + 1.0) / frame.width),
                      along * (1.0 - (2.0 * static_cast<double>(v) + 1.0) / frame.height));
      float& to = depth_m[v * frame.width + u];
      to = kNoValue;
      if (!(ray.x() > 0.0)) continue;
      const double column = 0.5 * frame.width * (1.0 - ray.y() / (ray.x() * across));
      const double row = 0.5 * frame.height * (1.0 - ray.z() / (ray.x() * along));
      if (!(column >= 0.0 && column < frame.width && row >= 0.0 && row < frame.height)) continue;
      const float from =
          frame.depth_m[static_cast<std::size_t>(row) * frame.width + static_cast<std::size_t>(column)];
      // Depths count along the axis; nothing within the range stays nothing.
      to = from < frame.range_m ? static_cast<float>(static_cast<double>(from) / ray.x()) : from;
    }
  }
}

/// Contrast falls by 95 % over the visibility (Koschmieder): so does the share of pixels that a stereo camera can match.
void veil(double visibility_m, std::uint64_t number, const firmware_if::DepthFrame& frame,
          std::vector<float>& depth_m) noexcept {
  core::CounterRng rng(number, 42);
  for (float& d : depth_m) {
    const auto z_m = static_cast<double>(std::fmin(d, frame.range_m));
    if (!(rng.uniform() < core::exp(-3.0 * z_m / visibility_m))) d = kNoValue;
  }
}

void wet(std::uint64_t number, const firmware_if::DepthFrame& frame, std::vector<float>& depth_m) noexcept {
  core::CounterRng rng(number, 43);
  constexpr std::size_t kDropsOnLens = 6;
  for (float& d : depth_m)
    if (rng.below(300) == 0) d = frame.range_min_m + static_cast<float>(rng.uniform(0.2, 3.0));
  // Those on the lens stay where they are for all of the flight.
  core::CounterRng lens(number % 8, 44);
  const std::size_t radius = frame.width / 12U;
  for (std::size_t k = 0; k < kDropsOnLens; ++k) {
    const auto u0 = static_cast<std::size_t>(lens.below(frame.width));
    const auto v0 = static_cast<std::size_t>(lens.below(frame.height));
    for (std::size_t v = v0 - std::min(v0, radius); v < std::min<std::size_t>(v0 + radius, frame.height); ++v)
      for (std::size_t u = u0 - std::min(u0, radius); u < std::min<std::size_t>(u0 + radius, frame.width);
           ++u)
        depth_m[v * frame.width + u] = kNoValue;
  }
}

template <typename Sample>
void shift_clock(const FaultLine& faults, Sample& s) noexcept {
  const Nanos shift = from_seconds(faults.size(Component::kClock));
  const FaultKind kind = faults.of(Component::kClock);
  if (kind == FaultKind::kWrong) s.stamp += shift;
  if (kind == FaultKind::kDelayed) s.stamp -= shift;
}

}  // namespace

template <typename Sample>
Status FaultySensors::read(Component component, Channel<Sample>& channel, Sample& sample) noexcept {
  const FaultKind kind = faults_ != nullptr ? faults_->of(component) : FaultKind::kNone;
  if (kind == FaultKind::kNone) {
    const Status status = sensors_.read(sample);
    if (status == Status::kOk) channel.good = sample;
    return status;
  }
  const double size = faults_->size(component);
  // At most what a ring holds.
  while (sensors_.read(sample) == Status::kOk) {
    switch (kind) {
      case FaultKind::kStuck: {
        const Sample fresh = sample;
        sample = channel.good;
        sample.stamp = fresh.stamp;
        sample.sequence = fresh.sequence;
        return Status::kOk;
      }
      case FaultKind::kGarbage:
        garble(sample);
        return Status::kOk;
      case FaultKind::kWrong:
      case FaultKind::kJump:
        shift(sample, size);
        return Status::kOk;
      case FaultKind::kDrift:
        shift(sample, size * seconds(faults_->age(component)));
        return Status::kOk;
      case FaultKind::kReset:
        begin_anew(sample);
        return Status::kOk;
      case FaultKind::kSlow:
        if (comes(size, sample.sequence)) return Status::kOk;
        break;
      case FaultKind::kIntermittent:
        if (!faults_->loses(component, 0, sample.sequence)) return Status::kOk;
        break;
      case FaultKind::kDelayed:
        channel.late.push(sample, now_ + from_seconds(size));
        break;
      default:
        break;  // off
    }
  }
  return channel.late.pop(sample, now_);
}

Status FaultySensors::read(firmware_if::ImuSample& sample) noexcept {
  return read(Component::kImu, imu_, sample);
}

Status FaultySensors::read(firmware_if::GnssFix& fix) noexcept {
  const Status status = read(Component::kGnss, gnss_, fix);
  if (status == Status::kOk && faults_ != nullptr) shift_clock(*faults_, fix);
  return status;
}

Status FaultySensors::read(firmware_if::BarometerSample& sample) noexcept {
  return read(Component::kBarometer, barometer_, sample);
}

Status FaultySensors::read(firmware_if::OdometrySample& sample) noexcept {
  const Status status = read(Component::kOdometry, odometry_, sample);
  if (status == Status::kOk && faults_ != nullptr) shift_clock(*faults_, sample);
  return status;
}

Status FaultyDepthCamera::read(firmware_if::DepthFrame& frame) noexcept {
  const FaultKind kind = faults_.of(Component::kDepth, instance_);
  const double size = faults_.size(Component::kDepth, instance_);
  if (kind == FaultKind::kDelayed && waiting_) {
    if (faults_.now() - late_.stamp < from_seconds(size)) return Status::kNotReady;
    waiting_ = false;
    frame = late_;
    return Status::kOk;
  }
  const Status status = camera_.read(frame);
  if (status != Status::kOk) return status;
  shift_clock(faults_, frame);
  const auto number = std::uint64_t{frame.sequence} * 8 + static_cast<std::uint64_t>(instance_);
  if (kind == FaultKind::kNone) {
    good_m_.assign(frame.depth_m.begin(), frame.depth_m.end());
    return Status::kOk;
  }
  bent_m_.assign(frame.depth_m.begin(), frame.depth_m.end());
  switch (kind) {
    case FaultKind::kStuck:
      if (good_m_.size() == bent_m_.size()) frame.depth_m = good_m_;
      return Status::kOk;
    case FaultKind::kGarbage:
      for (std::size_t i = 0; i < bent_m_.size(); ++i)
        bent_m_[i] =
            core::CounterRng(number, i).below(2) == 0 ? std::numeric_limits<float>::quiet_NaN() : -1.0F;
      break;
    case FaultKind::kWrong:
      for (float& depth_m : bent_m_) depth_m *= static_cast<float>(size);
      break;
    case FaultKind::kCovered:
      cover(number, frame, bent_m_);
      break;
    case FaultKind::kTurned:
      turn(frame, bent_m_);
      break;
    case FaultKind::kFog:
      veil(size, number, frame, bent_m_);
      break;
    case FaultKind::kRain:
      wet(number, frame, bent_m_);
      break;
    case FaultKind::kSlow:
      return comes(size, frame.sequence) ? Status::kOk : Status::kNotReady;
    case FaultKind::kIntermittent:
      return faults_.loses(Component::kDepth, instance_, frame.sequence) ? Status::kNotReady : Status::kOk;
    case FaultKind::kDelayed:
      late_ = frame;
      late_.depth_m = bent_m_;
      waiting_ = true;
      return Status::kNotReady;
    default:
      return Status::kNotReady;  // off
  }
  frame.depth_m = bent_m_;
  return Status::kOk;
}

}  // namespace roborun::sitl
