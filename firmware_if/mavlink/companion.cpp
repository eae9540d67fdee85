#include "firmware_if/mavlink/companion.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "firmware_if/mavlink/ned.hpp"

namespace roborun::firmware_if::mavlink {
namespace {

constexpr std::uint16_t kNavLand = 21;  // PX4 and ArduCopter change into their mode Land
constexpr std::uint8_t kArmedFlag = 128;
constexpr double kJump_m = 0.5;
constexpr std::int64_t kBackwards_ns = 1'000'000'000;
// Yaw rate ignored: position, velocity, acceleration and yaw count, for PX4 and for ArduCopter.
constexpr std::uint16_t kMask = 2048;
constexpr std::uint8_t kLocalNed = 1;
constexpr std::uint8_t kBodyFrd = 12;
constexpr std::uint8_t kLocalFrd = 20;

template <typename T>
bool all_finite(const T& values) noexcept {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

/// Of length 1 within 1 %, and then exactly.
bool normalise(std::array<double, 4>& q) noexcept {
  const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(square > 0.98 && square < 1.02)) return false;
  const double scale = 1.0 / std::sqrt(square);
  for (double& x : q) x *= scale;
  return true;
}

/// A goal that the ground station behind the autopilot asks for.
std::optional<GoalRequest> request_of(const Frame& frame, const Companion::Config& config,
                                      std::uint8_t sysid) noexcept {
  if (sysid == 0 || config.ground_sysid == 0 || frame.header.sysid != config.ground_sysid)
    return std::nullopt;
  return goal_request(frame, sysid, config.compid);
}

}  // namespace

// ---- out

template <typename T>
void Companion::send(const T& message) noexcept {
  const FrameHeader header{seq_, sysid_ != 0 ? sysid_ : std::uint8_t{1}, config_.compid};
  const auto length = write_frame(T::kType, header, pack(message), signer_,
                                  std::span<std::uint8_t>(out_).subspan(out_bytes_));
  if (!length.ok()) {
    ++counters_.not_sent;
    return;
  }
  ++seq_;
  out_bytes_ += length.value();
}

void Companion::sent(std::size_t bytes) noexcept {
  const std::size_t gone = std::min(bytes, out_bytes_);
  std::copy(out_.begin() + static_cast<std::ptrdiff_t>(gone),
            out_.begin() + static_cast<std::ptrdiff_t>(out_bytes_), out_.begin());
  out_bytes_ -= gone;
}

void Companion::send_command(std::uint16_t command, float p1, float p2, float p7) noexcept {
  CommandLong message;
  message.target_system = sysid_;
  message.target_component = autopilot_compid_;
  message.command = command;
  message.param1 = p1;
  message.param2 = p2;
  message.param7 = p7;
  send(message);
}

void Companion::send_name(const char* name, bool set, float value, bool is_integer) noexcept {
  std::array<char, 16> id{};
  std::copy_n(name, std::min(std::strlen(name), id.size()), id.begin());
  if (set) {
    constexpr std::uint8_t kInt32 = 6;
    constexpr std::uint8_t kReal32 = 9;
    const bool as_bits = is_integer && config_.kind == AutopilotKind::kPx4;
    if (as_bits) value = std::bit_cast<float>(static_cast<std::int32_t>(value));
    send(ParamSet{sysid_, autopilot_compid_, id, value, as_bits ? kInt32 : kReal32});
  } else {
    send(ParamRequestRead{sysid_, autopilot_compid_, id, -1});
  }
}

bool Companion::streams() const noexcept {
  if (let_go_) return false;
  const bool before = stage_ == AutopilotStage::kReady || stage_ == AutopilotStage::kTaking;
  // A set-point during ArduCopter's take-off would end it.
  return stage_ == AutopilotStage::kOurs || (before && !dialect_.takes_off_by_command);
}

Status Companion::command(MonotonicTime now, const AutopilotSetPoint& s) noexcept {
  if (!all_finite(s.p_W_m) || !all_finite(s.v_W_mps) || !all_finite(s.a_W_mps2) || !std::isfinite(s.yaw_rad))
    return Status::kInvalidArgument;
  if (!streams()) {
    ++counters_.withheld;
    return Status::kNotReady;
  }
  // With the state that came in this frame, where one comes near the time: what is sent then is as young as it can be.
  constexpr Nanos kNear{5'000'000};  // half a state's interval
  const Nanos since = now - set_point_at_;
  const bool came = std::exchange(came_, false);
  if (since < config_.period - kNear || (!came && since < config_.period + kNear)) return Status::kOk;
  // On the grid of the period, so that a late frame does not delay all that follow.
  set_point_at_ = since < 2 * config_.period ? set_point_at_ + config_.period : now;
  AutopilotSetPoint later = s;
  for (std::size_t i = 0; i < 3; ++i) {
    const double dv_mps = config_.lead_s * s.a_W_mps2.at(i);
    later.p_W_m.at(i) += config_.lead_s * (s.v_W_mps.at(i) + 0.5 * dv_mps);
    later.v_W_mps.at(i) += dv_mps;
  }
  const auto p = swap_world(later.p_W_m);
  const auto v = swap_world(later.v_W_mps);
  const auto a = swap_world(s.a_W_mps2);
  const auto narrow = [](double x) { return static_cast<float>(x); };
  SetPositionTargetLocalNed m;
  m.time_boot_ms = static_cast<std::uint32_t>(clock_.theirs_ns(now) / 1'000'000);
  m.target_system = sysid_;
  m.target_component = autopilot_compid_;
  m.coordinate_frame = kLocalNed;
  m.type_mask = kMask;
  m.x = narrow(p[0]), m.y = narrow(p[1]), m.z = narrow(p[2]);
  m.vx = narrow(v[0]), m.vy = narrow(v[1]), m.vz = narrow(v[2]);
  m.afx = narrow(a[0]), m.afy = narrow(a[1]), m.afz = narrow(a[2]);
  m.yaw = narrow(swap_yaw(s.yaw_rad));
  send(m);
  ++counters_.set_points;
  return Status::kOk;
}

void Companion::take_command(double height_m) noexcept {
  wanted_ = true;
  height_m_ = height_m;
}

void Companion::tell(const Statustext& line) noexcept {
  if (sysid_ != 0 && !let_go_) send(line);
}

void Companion::tell(const CommandAck& ack) noexcept {
  if (sysid_ != 0 && !let_go_) send(ack);
}

void Companion::disarm() noexcept { end(kArmDisarm); }

void Companion::land() noexcept { end(kNavLand); }

void Companion::terminate() noexcept { end(kFlightTermination); }

// ---- in

std::size_t Companion::receive(MonotonicTime now, std::span<const std::uint8_t> bytes) noexcept {
  std::size_t taken = 0;
  for (;;) {
    Frame frame;
    Event event = Event::kNothing;
    while (events_left_ > 0 && (event = receiver_.next(frame)) != Event::kNothing) {
      --events_left_;
      if (event == Event::kFrame) on_frame(now, frame);
    }
    if (events_left_ == 0 || taken == bytes.size()) return taken;
    taken += receiver_.push(bytes.subspan(taken));
  }
}

void Companion::on_frame(MonotonicTime now, const Frame& frame) noexcept {
  ++counters_.frames;
  if (frame.msgid == kHeartbeat.id) return on_heartbeat(now, frame);
  if (sysid_ == 0 || frame.header.sysid != sysid_ || frame.header.compid != autopilot_compid_) {
    ++counters_.foreign;
    if (const auto request = request_of(frame, config_, sysid_)) asked_goal_ = request;
    return;
  }
  switch (frame.msgid) {
    case kTimesync.id:
      return on_timesync(now, unpack<Timesync>(frame.payload));
    case kSystemTime.id:
      (void)restarted(std::int64_t{unpack<SystemTime>(frame.payload).time_boot_ms} * 1'000'000);
      return;
    case kAttitudeQuaternion.id:
      attitude_ = unpack<AttitudeQuaternion>(frame.payload);
      has_attitude_ = true;
      return;
    case kLocalPositionNed.id:
      if (config_.kind == AutopilotKind::kArduCopter)
        on_position(now, unpack<LocalPositionNed>(frame.payload));
      return;
    case kOdometry.id:
      if (config_.kind == AutopilotKind::kPx4) on_odometry(now, unpack<Odometry>(frame.payload));
      return;
    case kCommandAck.id:
      return on_ack(unpack<CommandAck>(frame.payload));
    case kParamValue.id:
      return on_parameter(unpack<ParamValue>(frame.payload));
    case kExtendedSysState.id:
      landed_state_ = unpack<ExtendedSysState>(frame.payload).landed_state;
      landed_at_ = now;
      return;
    case kGpsGlobalOrigin.id:
      origin_ = unpack<GpsGlobalOrigin>(frame.payload);
      return;
    case kSysStatus.id: {
      const std::int8_t percent = unpack<SysStatus>(frame.payload).battery_remaining;
      battery_ratio_ = percent >= 0 ? 0.01 * percent : std::numeric_limits<double>::quiet_NaN();
      return;
    }
    case kStatustext.id: {
      const auto line = unpack<Statustext>(frame.payload);
      text_ = line.text;
      text_size_ = static_cast<std::size_t>(std::find(text_.begin(), text_.end(), '\0') - text_.begin());
      return;
    }
    default:
      return;
  }
}

void Companion::on_heartbeat(MonotonicTime now, const Frame& frame) noexcept {
  const auto beat = unpack<Heartbeat>(frame.payload);
  constexpr std::uint8_t kAutopilotCompid = 1;
  if (sysid_ == 0) {
    if (beat.autopilot != dialect_.autopilot || frame.header.compid != kAutopilotCompid ||
        frame.header.sysid == 0) {
      ++counters_.foreign;
      constexpr std::uint8_t kInvalid = 8;
      if (beat.autopilot != kInvalid && frame.header.compid == kAutopilotCompid)
        reason_ = "an autopilot of another kind was heard";
      return;
    }
    sysid_ = frame.header.sysid;
    autopilot_compid_ = frame.header.compid;
    stage_ = AutopilotStage::kChecking;
    reason_ = "its answers are not complete";
  }
  if (frame.header.sysid != sysid_ || frame.header.compid != autopilot_compid_ ||
      beat.autopilot != dialect_.autopilot) {
    ++counters_.foreign;
    return;
  }
  heartbeat_at_ = now;
  mode_ = beat.custom_mode;
  armed_ = (beat.base_mode & kArmedFlag) != 0;
  watch_pilot();
}

void Companion::on_timesync(MonotonicTime now, const Timesync& m) noexcept {
  if (m.tc1 == 0) {
    send(Timesync{now.time_since_epoch().count(), m.ts1, sysid_, autopilot_compid_});
    return;
  }
  (void)clock_.answer(now, m.tc1, m.ts1);
}

bool Companion::restarted(std::int64_t boot_ns) noexcept {
  if (boot_ns > boot_ns_ - kBackwards_ns) {
    boot_ns_ = std::max(boot_ns_, boot_ns);
    return false;
  }
  ++counters_.reboots;
  boot_ns_ = boot_ns;
  clock_.forget();
  has_state_ = is_new_ = has_attitude_ = false;
  ++state_.frame_number;  // its origin is another one
  origin_.reset();
  asked_ = 0, tries_ = 0, setting_ = false, rose_ = false;
  landed_state_ = 0;
  // Nor is it armed again by itself; an operator who has not armed yet may restart what he likes.
  const bool taken = begun_ && (config_.may_arm || had_both_);
  if (stage_ == AutopilotStage::kRefused) return true;
  if (taken || stage_ == AutopilotStage::kPilots) {
    stage_ = AutopilotStage::kPilots;
    reason_ = "it restarted";
  } else {
    stage_ = AutopilotStage::kChecking;
    reason_ = "it restarted: its answers are not complete";
  }
  return true;
}

void Companion::on_odometry(MonotonicTime now, const Odometry& m) noexcept {
  const bool known = (m.frame_id == kLocalNed || m.frame_id == kLocalFrd) && m.child_frame_id == kBodyFrd;
  if (!known || m.quality < 0) return;
  AutopilotState s;
  std::copy(m.q.begin(), m.q.end(), s.q_WB.begin());
  if (!all_finite(s.q_WB) || !normalise(s.q_WB)) return;
  s.v_WB_mps = swap_world(turned(s.q_WB, wide(m.vx, m.vy, m.vz)));
  s.p_WB_m = swap_world(wide(m.x, m.y, m.z));
  s.q_WB = swap_attitude(s.q_WB);
  s.w_WB_B_radps = swap_body(wide(m.rollspeed, m.pitchspeed, m.yawspeed));
  if (m.reset_counter != reset_counter_ && has_state_) {
    ++counters_.jumps;
    ++state_.frame_number;
    has_state_ = false;  // what follows is not compared with what was
  }
  reset_counter_ = m.reset_counter;
  if (m.time_usec > std::uint64_t{1} << 52U) return;
  take_state(now, static_cast<std::int64_t>(m.time_usec) * 1000, s);
}

void Companion::on_position(MonotonicTime now, const LocalPositionNed& m) noexcept {
  if (!has_attitude_) return;
  const auto age_ms = static_cast<std::int32_t>(m.time_boot_ms - attitude_.time_boot_ms);
  constexpr std::int32_t kMostApart_ms = 50;
  if (age_ms > kMostApart_ms || age_ms < -kMostApart_ms) return;
  AutopilotState s;
  s.p_WB_m = swap_world(wide(m.x, m.y, m.z));
  s.v_WB_mps = swap_world(wide(m.vx, m.vy, m.vz));
  const std::array<double, 3> w = wide(attitude_.rollspeed, attitude_.pitchspeed, attitude_.yawspeed);
  const auto [q1, q2, q3] = wide(attitude_.q2, attitude_.q3, attitude_.q4);
  std::array<double, 4> q{static_cast<double>(attitude_.q1), q1, q2, q3};
  if (!all_finite(q) || !normalise(q)) return;
  const double half_s = 0.5e-3 * age_ms;  // turned on to the instant of the position
  q = times(q, {1.0, half_s * w[0], half_s * w[1], half_s * w[2]});
  if (!normalise(q)) return;
  s.q_WB = swap_attitude(q);
  s.w_WB_B_radps = swap_body(w);
  take_state(now, std::int64_t{m.time_boot_ms} * 1'000'000, s);
}

void Companion::take_state(MonotonicTime now, std::int64_t boot_ns, AutopilotState s) noexcept {
  if (!all_finite(s.p_WB_m) || !all_finite(s.v_WB_mps) || !all_finite(s.w_WB_B_radps)) return;
  if (restarted(boot_ns) || !clock_.matched()) return;
  s.stamp = std::min(clock_.ours(boot_ns), now);
  if (has_state_ && s.stamp <= state_.stamp) {
    ++counters_.stale_states;
    return;
  }
  const bool same_clock = std::exchange(clock_moves_, clock_.counters().moved) == clock_.counters().moved;
  if (has_state_ && same_clock) {
    // No reset counter in LOCAL_POSITION_NED: a step that no flight makes.
    const double dt_s = seconds(s.stamp - state_.stamp);
    double square = 0.0;
    double speed = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double step_m = s.p_WB_m.at(i) - state_.p_WB_m.at(i) - dt_s * state_.v_WB_mps.at(i);
      square += step_m * step_m;
      speed = std::max(speed, std::fabs(state_.v_WB_mps.at(i)));
    }
    const double allowed_m = kJump_m + (dt_s > 0.1 ? dt_s * speed : 0.0);
    if (square > allowed_m * allowed_m) {
      ++counters_.jumps;
      ++state_.frame_number;
    }
  }
  s.frame_number = state_.frame_number;
  s.sequence = state_.sequence + 1;
  state_ = s;
  has_state_ = is_new_ = came_ = true;
  ++counters_.states;
}

Status Companion::read(AutopilotState& state) noexcept {
  if (!is_new_) return Status::kNotReady;
  is_new_ = false;
  state = state_;
  return Status::kOk;
}

void Companion::step(MonotonicTime now) noexcept {
  events_left_ = kMostEvents;
  // Not known to stand: it flies. What is not armed does not.
  constexpr std::uint8_t kOnGround = 1;
  in_air_ = armed_ && (landed_state_ != kOnGround || !knows_ground(now));
  if (let_go_) return repeat_end(now);
  constexpr Nanos kBeat{1'000'000'000};
  if (now - beat_at_ >= kBeat) {
    beat_at_ = now;
    send(Heartbeat{18, 8, 0, 0, 4, 3});
  }
  if (sysid_ == 0) return;
  if (clock_.due(now)) send(Timesync{0, clock_.question(now), sysid_, autopilot_compid_});
  check_silence(now);
  if (stage_ == AutopilotStage::kChecking) {
    if (asks()) return ask(now);
    if (const char* const reason = why_not_led(now)) {
      reason_ = reason;
    } else if (!knows_ground(now)) {
      reason_ = "it does not say whether it stands on the ground";
      subject_ = kExtendedSysState.name.data();
    } else {
      stage_ = AutopilotStage::kReady;
      reason_ = subject_ = "";
    }
  }
  const bool takes = stage_ == AutopilotStage::kReady || stage_ == AutopilotStage::kTaking;
  if (wanted_ && takes) take(now);
  if (releases_left_ > 0 && stage_ == AutopilotStage::kOurs) release(now);
}

}  // namespace roborun::firmware_if::mavlink
