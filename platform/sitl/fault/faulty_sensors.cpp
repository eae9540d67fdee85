#include "platform/sitl/fault/faulty_sensors.hpp"

#include <limits>

namespace roborun::sitl {
namespace {

constexpr Nanos kImuDelay{50'000'000};
constexpr Nanos kDelay{400'000'000};
constexpr Nanos kClockShift{200'000'000};
constexpr std::uint32_t kSlow = 10;
constexpr double kJump_m = 2.0;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// In [-1e6, 1e6], every third one NaN: a function of the sequence alone.
double nonsense(std::uint64_t sequence, std::uint64_t field) noexcept {
  core::CounterRng rng(sequence, field);
  return rng.below(3) == 0 ? kNaN : rng.uniform(-1e6, 1e6);
}
bool lost(std::uint64_t sequence, std::uint64_t stream) noexcept {
  return core::CounterRng(sequence, stream).below(2) == 0;
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

void bend(firmware_if::ImuSample& s) noexcept { s.angular_rate_B_radps[0] += 0.5; }
void bend(firmware_if::GnssFix& f) noexcept { f.p_WB_m[1] += 30.0; }
void bend(firmware_if::BarometerSample& s) noexcept { s.altitude_m += 30.0; }

template <typename Sample>
void bend(Sample&) noexcept {}

template <typename Sample>
void jump(Sample&) noexcept {}
void jump(firmware_if::GnssFix& f) noexcept { f.p_WB_m[1] += kJump_m; }
void jump(firmware_if::OdometrySample& s) noexcept { s.p_OB_m[1] += kJump_m; }

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

template <typename Sample>
void shift_clock(FaultKind kind, Sample& s) noexcept {
  if (kind == FaultKind::kWrong) s.stamp += kClockShift;
  if (kind == FaultKind::kDelayed) s.stamp -= kClockShift;
}

}  // namespace

template <typename Sample>
Status FaultySensors::read(Component component, Nanos delay, Channel<Sample>& channel,
                           Sample& sample) noexcept {
  const FaultKind kind = faults_ != nullptr ? faults_->of(component) : FaultKind::kNone;
  if (kind == FaultKind::kNone) {
    const Status status = sensors_.read(sample);
    if (status == Status::kOk) channel.good = sample;
    return status;
  }
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
        bend(sample);
        return Status::kOk;
      case FaultKind::kJump:
        jump(sample);
        return Status::kOk;
      case FaultKind::kReset:
        begin_anew(sample);
        return Status::kOk;
      case FaultKind::kSlow:
        if (sample.sequence % kSlow == 0) return Status::kOk;
        break;
      case FaultKind::kIntermittent:
        if (!lost(sample.sequence, static_cast<std::uint64_t>(component))) return Status::kOk;
        break;
      case FaultKind::kDelayed:
        channel.late.push(sample, now_ + delay);
        break;
      default:
        break;  // off
    }
  }
  return channel.late.pop(sample, now_);
}

Status FaultySensors::read(firmware_if::ImuSample& sample) noexcept {
  return read(Component::kImu, kImuDelay, imu_, sample);
}

Status FaultySensors::read(firmware_if::GnssFix& fix) noexcept {
  const Status status = read(Component::kGnss, kDelay, gnss_, fix);
  if (status == Status::kOk && faults_ != nullptr) shift_clock(faults_->of(Component::kClock), fix);
  return status;
}

Status FaultySensors::read(firmware_if::BarometerSample& sample) noexcept {
  return read(Component::kBarometer, kDelay, barometer_, sample);
}

Status FaultySensors::read(firmware_if::OdometrySample& sample) noexcept {
  const Status status = read(Component::kOdometry, kDelay, odometry_, sample);
  if (status == Status::kOk && faults_ != nullptr) shift_clock(faults_->of(Component::kClock), sample);
  return status;
}

Status FaultyDepthCamera::read(firmware_if::DepthFrame& frame) noexcept {
  const FaultKind kind = faults_.of(Component::kDepth, instance_);
  if (kind == FaultKind::kDelayed && waiting_) {
    if (faults_.now() - late_.stamp < kDelay) return Status::kNotReady;
    waiting_ = false;
    frame = late_;
    return Status::kOk;
  }
  const Status status = camera_.read(frame);
  if (status != Status::kOk) return status;
  shift_clock(faults_.of(Component::kClock), frame);
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
        bent_m_[i] = lost(number, i) ? std::numeric_limits<float>::quiet_NaN() : -1.0F;
      break;
    case FaultKind::kWrong:
      for (float& depth_m : bent_m_) depth_m *= 0.5F;
      break;
    case FaultKind::kSlow:
      return frame.sequence % kSlow == 0 ? Status::kOk : Status::kNotReady;
    case FaultKind::kIntermittent:
      return lost(number, 9) ? Status::kNotReady : Status::kOk;
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
