#include "platform/sitl/autopilot/fake_autopilot.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "firmware_if/mavlink/ned.hpp"

namespace roborun::sitl {
namespace {

using namespace firmware_if::mavlink;  // NOLINT(google-build-using-namespace): messages by the dozen

constexpr std::uint8_t kSystem = 1;
constexpr Nanos kDisarmDelay{10'000'000'000};
// Between the command and the first lift: measured as the rest of 7.2 s for 9.6 m.
constexpr Nanos kSpoolUp{1'500'000'000};
constexpr Nanos kLandedFor{1'000'000'000};
constexpr Nanos kStreamAge{500'000'000};  // PX4: at least 2 Hz
constexpr double kMostSpeed = 1000.0;     // m/s, and of an acceleration m/s2; a place may lie anywhere
// An attitude loop follows an acceleration so late. Chosen on the measured steps.
constexpr double kAttitudeLag_s = 0.03;
constexpr double kReturnHeight_m = 30.0;
constexpr double kLand_mps = 0.7;

enum Ack : std::uint8_t { kAccepted = 0, kNotNow = 1, kDenied = 2, kUnsupported = 3, kFailed = 4 };

Vector3 vector_of(const std::array<double, 3>& v) noexcept { return {v[0], v[1], v[2]}; }

/// PX4's loops as its parameters are: MPC_XY_P, MPC_XY_VEL_P_ACC, _I_ACC. ArduCopter's chosen with the shaper's gain on the
/// measured responses (of 60 combinations the best), which do not follow from its parameters alone.
stages::Tracker::Config tracker_config(AutopilotKind kind, const VehicleModel& vehicle,
                                       Nanos frame) noexcept {
  stages::Tracker::Config config = stages::Tracker::config_for(vehicle, seconds(frame));
  // Neither of them knows its drag.
  config.vehicle.drag_linear_Nspm = config.vehicle.drag_quadratic_Ns2pm2 = 0.0;
  if (kind == AutopilotKind::kPx4) {
    config.position_gain_Hz = 0.95;
    config.velocity_gain_Hz = 1.8;
    config.velocity_integral_Hz2 = 0.4;
  }
  if (kind == AutopilotKind::kArduCopter) {
    config.position_gain_Hz = 0.7;
    config.velocity_gain_Hz = 2.5;
    config.velocity_integral_Hz2 = 0.3;
  }
  return config;
}

}  // namespace

FakeAutopilot::FakeAutopilot(AutopilotKind kind, const VehicleModel& vehicle, Nanos minor_frame,
                             Signer* signer, Verifier* verifier) noexcept
    : kind_(kind),
      vehicle_(vehicle),
      minor_frame_(minor_frame),
      estimator_({}),
      tracker_(tracker_config(kind, vehicle, minor_frame)),
      signer_(signer),
      receiver_(verifier),
      ready_after_(from_seconds(kBoot_s)) {
  // Defaults of PX4 v1.17 and ArduCopter 4.7-dev.
  if (is_px4()) {
    parameters_ = {{{"COM_OF_LOSS_T", 1.0, false},
                    {"COM_OBL_RC_ACT", 0.0, true},
                    {"MPC_ACC_HOR", 3.0, false},
                    {"MPC_JERK_AUTO", 4.0, false},
                    {"MPC_XY_VEL_MAX", 12.0, false},
                    {"MPC_Z_VEL_MAX_UP", 3.0, false},
                    {"MPC_Z_VEL_MAX_DN", 1.5, false},
                    {"MAV_SYS_ID", 1.0, true},
                    {"MAV_PROTO_VER", 2.0, true}}};
  } else {
    parameters_ = {{{"GUID_TIMEOUT", 3.0, false},
                    {"WPNAV_ACCEL", 250.0, false},
                    {"WPNAV_ACCEL_Z", 100.0, false},
                    {"PSC_JERK_XY", 5.0, false},
                    {"WPNAV_SPEED", 1000.0, false},
                    {"WPNAV_SPEED_UP", 250.0, false},
                    {"WPNAV_SPEED_DN", 150.0, false},
                    {"WP_YAW_BEHAVIOR", 2.0, false},
                    {"SYSID_THISMAV", 1.0, false}}};
  }
  const Nanos position = is_px4() ? Nanos{33'000'000} : Nanos{0};
  const Nanos slow = is_px4() ? Nanos{1'000'000'000} : Nanos{0};
  streams_ = {{{0, Nanos{1'000'000'000}, {}},
               {1, slow, {}},
               {2, slow, {}},
               {31, is_px4() ? Nanos{20'000'000} : Nanos{0}, {}},
               {32, position, {}},
               {245, slow, {}},
               {331, position, {}},
               {49, Nanos{0}, {}}}};
}

// ---- in

void FakeAutopilot::receive(MonotonicTime now, std::span<const std::uint8_t> bytes) noexcept {
  while (!bytes.empty()) {
    bytes = bytes.subspan(receiver_.push(bytes));
    Frame frame;
    Event event = Event::kNothing;
    while ((event = receiver_.next(frame)) != Event::kNothing) {
      if (event == Event::kFrame) on_frame(now, frame);
    }
  }
}

void FakeAutopilot::count(const FrameHeader& header) noexcept {
  if (!heard_) {
    heard_ = header;
    return;
  }
  if (heard_->sysid != header.sysid || heard_->compid != header.compid) return;  // somebody else's
  const auto ahead = static_cast<std::uint8_t>(header.seq - heard_->seq);
  constexpr std::uint8_t kHalf = 128;  // farther ahead is behind
  if (ahead >= kHalf || ahead == 0) {
    ++counters_.doubled_frames;
    return;
  }
  if (ahead > 1) counters_.lost_frames += ahead - 1U;
  heard_ = header;
}

void FakeAutopilot::on_frame(MonotonicTime now, const Frame& frame) noexcept {
  count(frame.header);
  const auto named = [this](const std::array<char, 16>& id) {
    const auto* const end = std::find(id.begin(), id.end(), '\0');
    const std::string_view name(id.data(), static_cast<std::size_t>(end - id.begin()));
    return std::find_if(parameters_.begin(), parameters_.end(),
                        [name](const Parameter& p) { return p.name == name; });
  };
  switch (frame.msgid) {
    case kTimesync.id: {
      const auto m = unpack<Timesync>(frame.payload);
      if (m.tc1 == 0) send(Timesync{boot_ns(now), m.ts1, 0, 0});  // both answer to nobody
      return;
    }
    case kCommandLong.id:
      return on_command(now, unpack<CommandLong>(frame.payload));
    case kParamRequestRead.id:
      if (const auto* const p = named(unpack<ParamRequestRead>(frame.payload).param_id);
          p != parameters_.end())
        send_parameter(*p);
      return;
    case kParamSet.id: {
      const auto m = unpack<ParamSet>(frame.payload);
      auto* const p = named(m.param_id);
      if (p == parameters_.end()) return;
      const bool bits = is_px4() && p->is_integer;
      if (is_px4() && m.param_type != (bits ? 6 : 9)) return send_parameter(*p);  // a wrong type is refused
      p->value = bits ? std::bit_cast<std::int32_t>(m.param_value) : static_cast<double>(m.param_value);
      return send_parameter(*p);
    }
    case kSetPositionTargetLocalNed.id:
      return on_set_point(now, unpack<SetPositionTargetLocalNed>(frame.payload));
    default:
      return;
  }
}

void FakeAutopilot::on_command(MonotonicTime now, const CommandLong& c) noexcept {
  if (c.target_system != kSystem && c.target_system != 0) return;
  std::uint8_t result = kUnsupported;
  switch (c.command) {
    case 511:
      result = set_interval(now, static_cast<std::uint32_t>(c.param1), static_cast<double>(c.param2));
      break;
    case 21:
      set_mode(Mode::kLand);
      result = kAccepted;
      break;
    case 176:
      result = change_mode(now, static_cast<double>(c.param2));
      break;
    case 400:
      result = arm(now, c.param1 > 0.5F);
      break;
    case 185:
      if (c.param1 > 0.5F) armed_ = false;
      result = kAccepted;
      break;
    case 211:
      if (c.param2 == 0.0F) ++counters_.releases;
      result = kAccepted;
      break;
    case 22:
      if (is_px4()) break;
      result = mode_ == Mode::kGuided && armed_ && on_ground_ ? kAccepted : kFailed;
      if (result != kAccepted) break;
      if (!rises_at_) rises_at_ = now + kSpoolUp;
      rise_m_ = static_cast<double>(c.param7);
      break;
    default:
      break;
  }
  send(CommandAck{c.command, result, 0, 0, 0, 0});
}

std::uint8_t FakeAutopilot::set_interval(MonotonicTime now, std::uint32_t msgid,
                                         double interval_us) noexcept {
  auto* const stream =
      std::find_if(streams_.begin(), streams_.end(), [msgid](const Stream& s) { return s.msgid == msgid; });
  if (stream == streams_.end() || (!is_px4() && msgid == 331)) return kDenied;
  if (interval_us > 0.0 && interval_us < 5000.0) return kDenied;  // 400 Hz was denied, 200 Hz was not
  stream->interval = interval_us > 0.0 ? Nanos{static_cast<std::int64_t>(interval_us) * 1000} : Nanos{0};
  stream->next = now;
  return kAccepted;
}

std::uint8_t FakeAutopilot::arm(MonotonicTime now, bool on) noexcept {
  if (!on) {
    if (!on_ground_) {
      ++counters_.refused_disarms;
      return kFailed;
    }
    armed_ = false;
    return kAccepted;
  }
  if (armed_) return kAccepted;
  if (never_arms || !has_state_ || now - booted_at_ < ready_after_) {
    say("PreArm: Need Position Estimate");
    return is_px4() ? kNotNow : kFailed;
  }
  const bool streaming = set_point_at_ && now - *set_point_at_ <= kStreamAge;
  if (is_px4() && mode_ == Mode::kGuided && !streaming) {
    say("Arming denied: no offboard signal");
    return kNotNow;
  }
  armed_ = true;
  armed_at_ = now;
  home_W_ = state_.p_WB;
  tracker_.reset();
  return kAccepted;
}

std::uint8_t FakeAutopilot::change_mode(MonotonicTime now, double number) noexcept {
  const double guided = is_px4() ? 6.0 : 4.0;
  if (number != guided) return kUnsupported;
  const bool streaming = set_point_at_ && now - *set_point_at_ <= kStreamAge;
  if (is_px4() && !streaming) {
    say("Offboard rejected: no set-points");
    return kNotNow;
  }
  set_mode(Mode::kGuided);
  return kAccepted;
}

void FakeAutopilot::set_mode(Mode mode) noexcept {
  if (mode == mode_) return;
  mode_ = mode;
  is_led_ = false;
  target_ = Target::stop();
  if (mode == Mode::kReturn) target_ = Target::at({home_W_.x(), home_W_.y(), kReturnHeight_m});
  if (mode == Mode::kLand) target_.v_W = {0.0, 0.0, -kLand_mps};
  shaper_.begin(state_.p_WB, state_.v_WB);
  yaw_.begin(core::yaw_of(state_.q_WB));
  lagged_W_mps2_.setZero();
  has_yaw_ = has_yaw_rate_ = false;
}

bool FakeAutopilot::take_axes(const SetPositionTargetLocalNed& m, Target& target) const noexcept {
  const auto given = [&m](unsigned bits) { return (m.type_mask & bits) == 0; };
  constexpr unsigned kForce = 512;
  if (m.coordinate_frame != 1) return false;
  const std::array<float, 9> values{m.x, m.y, m.z, m.vx, m.vy, m.vz, m.afx, m.afy, m.afz};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double most = i < 3 ? std::numeric_limits<double>::max() : kMostSpeed;
    const bool fine = std::fabs(static_cast<double>(values.at(i))) <= most;  // false for NaN
    if (given(1U << i) && !fine) return false;
  }
  target.p_W = origin_W_ + vector_of(swap_world(wide(m.x, m.y, m.z)));
  target.v_W = vector_of(swap_world(wide(m.vx, m.vy, m.vz)));
  target.a_W = vector_of(swap_world(wide(m.afx, m.afy, m.afz)));
  target.has_position = given(7);
  target.has_velocity = given(56);
  target.has_acceleration = given(448);
  // PX4 would control single axes; this one does not, and nobody here asks for it.
  const bool any = target.has_position || target.has_velocity || target.has_acceleration;
  return any && (is_px4() || target.has_position || target.has_velocity || (m.type_mask & kForce) != 0);
}

void FakeAutopilot::on_set_point(MonotonicTime now, const SetPositionTargetLocalNed& m) noexcept {
  Target target;
  const bool valid = take_axes(m, target) && !refuses_set_points;
  if (is_px4() && !valid) {
    ++counters_.refused_set_points;
    return;  // dropped, and no sign of life
  }
  set_point_at_ = now;
  if (mode_ != Mode::kGuided || (!is_px4() && (!has_risen_ || on_ground_))) {
    ++counters_.ignored_set_points;
    return;
  }
  if (!valid) {
    ++counters_.refused_set_points;
    target_ = Target::stop();
    has_yaw_ = has_yaw_rate_ = false;
    return;
  }
  ++counters_.set_points;
  if (!is_led_ && is_px4()) tracker_.reset();
  is_led_ = true;
  timed_out_ = false;
  target_ = target;
  has_yaw_ = (m.type_mask & 1024U) == 0 && std::isfinite(m.yaw);
  has_yaw_rate_ = (m.type_mask & 2048U) == 0 && std::isfinite(m.yaw_rate);
  if (has_yaw_) yaw_rad_ = swap_yaw(static_cast<double>(m.yaw));
  yaw_rate_radps_ = has_yaw_rate_ ? -static_cast<double>(m.yaw_rate) : 0.0;
}

// ---- flight

void FakeAutopilot::sense(flight::Aircraft& body) noexcept {
  constexpr int kMost = 16;
  firmware_if::ImuSample imu;
  for (int i = 0; i < kMost && body.imu().read(imu) == Status::kOk; ++i) (void)estimator_.predict(imu);
  firmware_if::OdometrySample odometry;
  for (int i = 0; body.odometry() != nullptr && i < kMost && body.odometry()->read(odometry) == Status::kOk;
       ++i)
    (void)estimator_.update(odometry);
  firmware_if::GnssFix fix;
  for (int i = 0; i < kMost && body.gnss().read(fix) == Status::kOk; ++i) (void)estimator_.update(fix);
  firmware_if::BarometerSample pressure;
  for (int i = 0; i < kMost && body.barometer().read(pressure) == Status::kOk; ++i)
    (void)estimator_.update(pressure);
  has_state_ = estimator_.state(state_) == Status::kOk;
}

void FakeAutopilot::check_time_outs(MonotonicTime now) noexcept {
  if (mode_ == Mode::kGuided && is_led_ && set_point_at_) {
    const Nanos silence = now - *set_point_at_;
    const Nanos limit = from_seconds(parameter(is_px4() ? "COM_OF_LOSS_T" : "GUID_TIMEOUT"));
    if (silence > limit && !timed_out_) {
      timed_out_ = true;
      ++counters_.timeouts;
      if (is_px4()) {
        constexpr double kHoldAction = 5.0;
        set_mode(parameter("COM_OBL_RC_ACT") == kHoldAction ? Mode::kHold : Mode::kReturn);
      } else {
        target_.v_W.setZero();
        target_.a_W.setZero();
        yaw_rate_radps_ = 0.0;
      }
    }
  }
  if (!on_ground_) grounded_at_ = now;
  if (rises_at_ && now >= *rises_at_ && armed_) {
    rises_at_.reset();
    has_risen_ = true;
    target_ = Target::at(state_.p_WB + Vector3(0.0, 0.0, rise_m_));
    shaper_.begin(state_.p_WB, Vector3::Zero());
    tracker_.reset();
  }
  if (!armed_ || !on_ground_) return;
  const bool idle = !is_px4() && !has_risen_ && !rises_at_ && now - armed_at_ > kDisarmDelay;
  if (idle || (mode_ == Mode::kLand && now - grounded_at_ > kLandedFor)) {
    armed_ = false;
    has_risen_ = false;
  }
}

ShaperLimits FakeAutopilot::shaper_limits() const noexcept {
  if (is_px4()) return {parameter("MPC_ACC_HOR"), 3.0, parameter("MPC_JERK_AUTO"), 5.0, 3.0, 1.5};
  return {0.01 * parameter("WPNAV_ACCEL"),    0.01 * parameter("WPNAV_ACCEL_Z"),
          parameter("PSC_JERK_XY"),           0.01 * parameter("WPNAV_SPEED"),
          0.01 * parameter("WPNAV_SPEED_UP"), 0.01 * parameter("WPNAV_SPEED_DN")};
}

void FakeAutopilot::lead_yaw(double dt_s) noexcept {
  if (has_yaw_) return yaw_.turn_to(yaw_rad_, dt_s);
  if (has_yaw_rate_) return yaw_.turn_at(yaw_rate_radps_, dt_s);
  constexpr double kMoving_mps = 0.5;
  const Vector3& v = shaper_.v_W();
  const bool follows = !is_px4() && is_led_ && core::hypot2(v.x(), v.y()) > kMoving_mps;
  if (follows) return yaw_.turn_to(core::atan2(v.y(), v.x()), dt_s);
  yaw_.turn_at(0.0, dt_s);
}

void FakeAutopilot::lead(double dt_s) noexcept {
  lead_yaw(dt_s);
  if (is_px4() && mode_ == Mode::kGuided) {
    reference_ = {};
    reference_.p_W = is_led_ && target_.has_position ? target_.p_W : state_.p_WB;
    if (is_led_ && target_.has_velocity) reference_.v_W = target_.v_W;
    if (is_led_ && target_.has_acceleration) reference_.a_W = target_.a_W;
    return;
  }
  shaper_.step(dt_s, shaper_limits(), target_);
  lagged_W_mps2_ += (dt_s / kAttitudeLag_s) * (shaper_.a_W() - lagged_W_mps2_);
  reference_ = {shaper_.p_W(), shaper_.v_W(), lagged_W_mps2_, Vector3::Zero()};
}

void FakeAutopilot::step(MonotonicTime now, flight::Aircraft& body, bool on_ground,
                         double battery_ratio) noexcept {
  on_ground_ = on_ground;
  sense(body);
  check_time_outs(now);
  const bool turns = armed_ && has_state_ && (is_px4() || has_risen_);
  motors_ = {};
  if (turns) {
    lead(seconds(minor_frame_));
    (void)tracker_.step({state_, reference_, yaw_.yaw_rad()}, motors_);
  } else if (has_state_) {
    shaper_.begin(state_.p_WB, Vector3::Zero());
    yaw_.begin(core::yaw_of(state_.q_WB));
  }
  (void)body.motors().command(motors_);
  constexpr Nanos kAsk{1'000'000'000};
  if (now - asked_at_ >= kAsk) {
    asked_at_ = now;
    send(Timesync{0, boot_ns(now), 0, 0});
  }
  for (Stream& stream : streams_) {
    if (stream.interval <= Nanos{0} || now < stream.next) continue;
    stream.next = std::max(stream.next + stream.interval, now - stream.interval);
    send_stream(now, stream.msgid, battery_ratio);
  }
}

void FakeAutopilot::reboot(MonotonicTime now) noexcept {
  booted_at_ = now;
  ready_after_ = from_seconds(kBoot_s);
  set_mode(is_px4() ? Mode::kHold : Mode::kManual);
  set_point_at_.reset();
}

bool FakeAutopilot::set_parameter(std::string_view name, double value) noexcept {
  for (Parameter& p : parameters_) {
    if (p.name != name) continue;
    p.value = value;
    return true;
  }
  return false;
}

double FakeAutopilot::parameter(std::string_view name) const noexcept {
  for (const Parameter& p : parameters_)
    if (p.name == name) return p.value;
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace roborun::sitl
