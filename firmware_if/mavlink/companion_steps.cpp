// What it asks before the flight, and the take-over.
#include <algorithm>
#include <bit>
#include <cmath>

#include "firmware_if/mavlink/companion.hpp"

namespace roborun::firmware_if::mavlink {
namespace {

using Rule = ParameterCheck::Rule;

constexpr std::uint16_t kNavTakeOff = 22;
constexpr std::uint16_t kDoSetMode = 176;
constexpr std::uint16_t kGripper = 211;
constexpr std::uint16_t kSetMessageInterval = 511;
constexpr Nanos kRetry{500'000'000};
constexpr int kMostTries = 10;
constexpr int kMostTakeTries = 120;    // a minute: its checks before arming take a while
constexpr double kNearHeight_m = 0.6;  // ArduCopter ends its take-off up to half a metre lower
constexpr double kRisen_mps = 0.3;

std::string_view name_of(const std::array<char, 16>& text) noexcept {
  const auto* const end = std::find(text.begin(), text.end(), '\0');
  return {text.data(), static_cast<std::size_t>(end - text.begin())};
}

/// PX4 has an INT32's bits in the float, ArduPilot the number.
double number_of(const ParamValue& m, AutopilotKind kind) noexcept {
  constexpr std::uint8_t kInt32 = 6;
  if (kind == AutopilotKind::kPx4 && m.param_type == kInt32)
    return std::bit_cast<std::int32_t>(m.param_value);
  return static_cast<double>(m.param_value);
}

double wanted_of(const ParameterCheck& check, const AutopilotLimits& planned) noexcept {
  return check.value != nullptr ? planned.*check.value : check.wanted;
}

/// False for NaN. A time-out of zero is none.
bool fits(Rule rule, double value, double wanted) noexcept {
  constexpr double kRounding = 1e-6;
  if (rule == Rule::kExactly) return value == wanted;
  if (rule == Rule::kAtMost) return value > 0.0 && value <= wanted * (1.0 + kRounding);
  return value >= wanted * (1.0 - kRounding);
}

}  // namespace

void Companion::refuse(const char* reason, const char* subject) noexcept {
  stage_ = AutopilotStage::kRefused;
  reason_ = reason;
  subject_ = subject;
}

void Companion::release(MonotonicTime now) noexcept {
  if (now - release_at_ < kRetry) return;
  release_at_ = now;
  --releases_left_;
  send_command(kGripper, 1.0F, 0.0F);  // the first one: release
}

void Companion::on_ack(const CommandAck& ack) noexcept {
  if (ack.command == kGripper && releases_left_ > 0) {
    constexpr std::uint8_t kAccepted = 0;
    releases_left_ = 0;
    if (ack.result == kAccepted) ++counters_.releases;
    return;
  }
  if (stage_ != AutopilotStage::kChecking || asked_ >= dialect_.streams.size() || tries_ == 0) return;
  constexpr std::uint8_t kAccepted = 0;
  constexpr std::uint8_t kNotNow = 1;
  constexpr std::uint8_t kInProgress = 5;
  // An answer to a ground station comes along the same line. Zero: to everybody, or from a sender that does not tell.
  const bool ours =
      ack.target_system == 0 ||
      (ack.target_system == sysid_ && (ack.target_component == 0 || ack.target_component == config_.compid));
  if (!ours || ack.command != kSetMessageInterval) return;
  if (ack.result == kInProgress || ack.result == kNotNow) return;  // asked again
  const std::uint32_t id = dialect_.streams[asked_].msgid;
  const bool needed = id == kOdometry.id || id == kAttitudeQuaternion.id || id == kLocalPositionNed.id ||
                      id == kExtendedSysState.id;
  if (ack.result != kAccepted && needed)
    return refuse("it does not send a message that is needed", find_message(id)->name.data());
  ++asked_;
  tries_ = 0;
}

void Companion::on_parameter(const ParamValue& m) noexcept {
  const std::size_t first = dialect_.streams.size();
  if (stage_ != AutopilotStage::kChecking || asked_ < first || !asks() || tries_ == 0) return;
  const ParameterCheck& check = dialect_.parameters[asked_ - first];
  if (name_of(m.param_id) != check.name) return;
  const double value = check.scale * number_of(m, config_.kind);
  if (fits(check.rule, value, wanted_of(check, config_.planned))) {
    if (check.value != nullptr && check.rule != Rule::kRaised) limits_.*check.value = value;
    ++asked_;
    tries_ = 0;
    setting_ = false;
    return;
  }
  if (check.rule == Rule::kAtLeast && !config_.may_tune)
    return refuse("a limit of the autopilot is less than what is planned with", check.name);
  if (check.rule != Rule::kAtLeast && !config_.may_set)
    return refuse("a time-out, its action or a limit is not as planned, and may not be set", check.name);
  if (setting_ && tries_ >= 2) return refuse("a parameter did not take the value that is needed", check.name);
  if (!setting_) {
    setting_ = true;
    tries_ = 0;
  }
}

void Companion::ask(MonotonicTime now) noexcept {
  if (tries_ > 0 && now - tried_at_ < kRetry) return;
  const std::size_t first = dialect_.streams.size();
  const bool is_stream = asked_ < first;
  if (tries_ >= kMostTries)
    return refuse("it does not answer", is_stream ? find_message(dialect_.streams[asked_].msgid)->name.data()
                                                  : dialect_.parameters[asked_ - first].name);
  ++tries_;
  tried_at_ = now;
  if (is_stream) {
    const StreamRequest& stream = dialect_.streams[asked_];
    send_command(kSetMessageInterval, static_cast<float>(stream.msgid),
                 static_cast<float>(stream.interval_us));
    return;
  }
  const ParameterCheck& check = dialect_.parameters[asked_ - first];
  const double wanted = wanted_of(check, config_.planned);
  send_name(check.name, setting_, static_cast<float>(wanted / check.scale), check.is_integer);
}

void Companion::begin_taking() noexcept {
  stage_ = AutopilotStage::kTaking;
  reason_ =
      config_.may_arm ? "mode, arming and take-off are under way" : "waits for the operator: mode and arming";
  ground_m_ = state_.p_WB_m[2];
  rose_ = in_air_;
  tries_ = 0;
  begun_ = true;
  watch_pilot();
}

void Companion::take(MonotonicTime now) noexcept {
  if (stage_ == AutopilotStage::kReady) begin_taking();
  if (stage_ != AutopilotStage::kTaking) return;
  const double risen_m = state_.p_WB_m[2] - ground_m_;
  const bool risen =
      in_air_ && risen_m > height_m_ - kNearHeight_m && std::fabs(state_.v_WB_mps[2]) < kRisen_mps;
  rose_ = rose_ || !dialect_.takes_off_by_command || risen || (in_air_ && height_m_ <= 0.0);
  if (in_our_mode() && armed_ && rose_) {
    stage_ = AutopilotStage::kOurs;
    reason_ = "";
    return;
  }
  ask_to_take(now);
}

void Companion::ask_to_take(MonotonicTime now) noexcept {
  if (tries_ > 0 && now - tried_at_ < kRetry) return;
  const bool rises = in_our_mode() && armed_;
  if (rises ? in_air_ : !config_.may_arm) return;
  if (tries_ >= kMostTakeTries)
    return refuse("it does not do what the take-over needs", rises           ? "take-off"
                                                             : in_our_mode() ? "arming"
                                                                             : "mode");
  tried_at_ = now;
  ++tries_;
  if (rises) {
    send_command(kNavTakeOff, 0.0F, 0.0F, static_cast<float>(height_m_));
  } else if (!in_our_mode()) {
    send_command(kDoSetMode, 1.0F, dialect_.mode_parameter);
  } else {
    send_command(kArmDisarm, 1.0F, 0.0F);
  }
}

void Companion::watch_pilot() noexcept {
  const bool refused = stage_ == AutopilotStage::kRefused || stage_ == AutopilotStage::kPilots;
  if (!begun_ || refused) return;
  had_mode_ = had_mode_ || in_our_mode();
  had_armed_ = had_armed_ || armed_;
  had_both_ = had_both_ || (in_our_mode() && armed_);
  // An operator who does mode and arming himself may change his mind until both are there.
  const bool counts = config_.may_arm || had_both_;
  const bool mode_gone = had_mode_ && !in_our_mode();
  const bool disarmed = had_armed_ && !armed_;
  if (!counts || !(mode_gone || disarmed)) return;
  stage_ = AutopilotStage::kPilots;
  reason_ = disarmed ? "it was disarmed" : "its mode was changed";
}

const char* Companion::why_not_led(MonotonicTime now) const noexcept {
  if (now - heartbeat_at_ > kLost_heartbeat) return "its heartbeat does not come";
  // By the stamp: also a state that comes late is an old one.
  if (!has_state_ || now - state_.stamp > kLost_state)
    return "it sends no position: its estimator is not ready, or the clocks are not matched";
  return nullptr;
}

void Companion::end(std::uint16_t command) noexcept {
  const bool ours = stage_ == AutopilotStage::kOurs || stage_ == AutopilotStage::kTaking;
  if (sysid_ != 0 && ours && !let_go_) {
    end_command_ = command;
    tries_ = 0;
  }
  let_go_ = true;
}

void Companion::repeat_end(MonotonicTime now) noexcept {
  const bool pilots = armed_ && stage_ == AutopilotStage::kPilots;
  if (!armed_ || pilots || tries_ >= kMostTries) end_command_ = 0;
  if (end_command_ == 0 || (tries_ > 0 && now - tried_at_ < kRetry)) return;
  tried_at_ = now;
  ++tries_;
  send_command(end_command_, end_command_ == kFlightTermination ? 1.0F : 0.0F, 0.0F);
}

void Companion::check_silence(MonotonicTime now) noexcept {
  const bool silent = why_not_led(now) != nullptr;
  if ((silent || !knows_ground(now)) &&
      (stage_ == AutopilotStage::kReady || stage_ == AutopilotStage::kTaking)) {
    stage_ = AutopilotStage::kChecking;
  } else if (stage_ == AutopilotStage::kOurs && silent) {
    stage_ = AutopilotStage::kLost;
    reason_ = "its heartbeat or its state do not come";
    lost_at_ = now;
  } else if (stage_ == AutopilotStage::kLost && !silent && heartbeat_at_ > lost_at_) {
    stage_ = AutopilotStage::kOurs;
    reason_ = "";
  }
}

}  // namespace roborun::firmware_if::mavlink
