#include "platform/app/actuator_link.hpp"

#include <algorithm>
#include <limits>

namespace roborun::app {
namespace {

constexpr std::uint32_t kBitrate_bps = 1'000'000;
constexpr std::uint8_t kFirstEscNode = 21;
constexpr std::uint8_t kPowerModuleNode = 25;
constexpr std::size_t kPowerModulePort = 5;
constexpr Nanos kBatterySilence = 5 * sitl::FakePowerModule::kPeriod;

firmware_if::CanBus& node_end(sitl::FakeCanPort& simulated, MotorBus* outside) noexcept {
  if (outside != nullptr) return outside->node();
  return simulated;
}
firmware_if::CanBus& esc_end(sitl::FakeCan& simulated, MotorBus* outside, std::size_t index) noexcept {
  if (outside != nullptr) return outside->esc(index);
  return simulated.port(1 + index);
}
/// It only sends: outside it does so through the last ESC's end.
firmware_if::CanBus& power_module_end(sitl::FakeCan& simulated, MotorBus* outside) noexcept {
  if (outside != nullptr) return outside->esc(3);
  return simulated.port(kPowerModulePort);
}

}  // namespace

ActuatorLink::ActuatorLink(std::uint64_t seed, Nanos minor_frame, const RealActuators& real) noexcept
    : bus_(kBitrate_bps, seed),
      port_(bus_.port(0)),
      gate_({.beat_timeout = 3 * minor_frame}, node_end(port_, real.bus)),
      node_({.command_period = minor_frame}, gate_, node_end(port_, real.bus), sessions_),
      escs_{{{{.node_id = kFirstEscNode, .index = 0}, esc_end(bus_, real.bus, 0)},
             {{.node_id = kFirstEscNode + 1, .index = 1}, esc_end(bus_, real.bus, 1)},
             {{.node_id = kFirstEscNode + 2, .index = 2}, esc_end(bus_, real.bus, 2)},
             {{.node_id = kFirstEscNode + 3, .index = 3}, esc_end(bus_, real.bus, 3)}}},
      power_module_(kPowerModuleNode, power_module_end(bus_, real.bus)),
      kill_switch_(real.kill != nullptr ? real.kill->open() : kill_open_,
                   real.kill != nullptr ? real.kill->closed() : kill_closed_) {
  kill_closed_.drive(true, {});
}

Status ActuatorLink::command(const firmware_if::MotorCommand& command) noexcept {
  for (const double ratio : command.thrust_ratio) {
    if (!(ratio >= 0.0 && ratio <= 1.0)) return Status::kInvalidArgument;
  }
  command_ = command;
  commanded_ = true;
  if (!armed_ && !disarmed_) armed_ = gate_.arm_unproven() == Status::kOk;
  return Status::kOk;
}

void ActuatorLink::disarm() noexcept {
  gate_.disarm();
  armed_ = false;
  disarmed_ = true;
}

Nanos ActuatorLink::esc_silence(MonotonicTime now) const noexcept {
  Nanos longest{0};
  for (std::size_t i = 0; i < escs_.size(); ++i)
    longest = std::max(longest, now - node_.inbox().esc[i].stamp);
  return longest;
}

double ActuatorLink::charge_ratio(MonotonicTime now) const noexcept {
  const auto& battery = node_.inbox().battery;
  const std::uint8_t charge_pct = battery.message.state_of_charge_pct;
  if (battery.count == 0 || now - battery.stamp > kBatterySilence || charge_pct > 100)
    return std::numeric_limits<double>::quiet_NaN();
  return charge_pct / 100.0;
}

void ActuatorLink::break_lines(MonotonicTime now) noexcept {
  using sitl::FaultKind;
  const FaultKind kill = faults_->of(sitl::Component::kKillSwitch);
  pulse_ = kill == FaultKind::kIntermittent && !pulse_;
  kill_open_.drive(kill == FaultKind::kOn || kill == FaultKind::kStuck || pulse_, now);
  kill_closed_.drive(kill != FaultKind::kOn && !pulse_, now);
  if (kill == FaultKind::kOff) kill_closed_.remove();

  const FaultKind can = faults_->of(sitl::Component::kCan);
  if (bus_off_ != (can == FaultKind::kOff)) {
    bus_off_ = !bus_off_;
    bus_off_ ? port_.go_bus_off() : port_.recover();
  }
  bus_.set_faults({.loss_ratio = can == FaultKind::kIntermittent ? 0.5 : 0.0,
                   .corrupt_ratio = can == FaultKind::kGarbage ? 0.5 : 0.0});
}

double ActuatorLink::break_battery(double charge_ratio) noexcept {
  using sitl::FaultKind;
  const FaultKind kind = faults_->of(sitl::Component::kBattery);
  power_module_.set_silent(kind == FaultKind::kOff);
  if (kind == FaultKind::kNone) sound_charge_ratio_ = charge_ratio;
  if (kind == FaultKind::kWrong) return 0.05;
  if (kind == FaultKind::kGarbage) return std::numeric_limits<double>::quiet_NaN();
  return sound_charge_ratio_;
}

double ActuatorLink::break_esc(std::size_t i, double ratio, MonotonicTime now) noexcept {
  using sitl::FaultKind;
  const int instance = static_cast<int>(i);
  const FaultKind kind = faults_->of(sitl::Component::kEsc, instance);
  escs_[i].set_silent(kind == FaultKind::kOff ||
                      faults_->of(sitl::Component::kEscStatus, instance) == FaultKind::kOff);
  const auto ticks = static_cast<std::uint64_t>(now.time_since_epoch() / Nanos{50'000'000});
  switch (kind) {
    case FaultKind::kOff:
      return 0.0;
    case FaultKind::kStuck:
      return ratio > 0.0 ? turning_[i] : 0.0;  // until it is told zero
    case FaultKind::kGarbage:
      return ratio > 0.0 ? core::CounterRng(ticks, i).uniform() : 0.0;
    case FaultKind::kWrong:
      return 0.85 * ratio;
    case FaultKind::kSlow:
      return turning_[i] + 0.02 * (ratio - turning_[i]);
    case FaultKind::kIntermittent:
      return core::CounterRng(ticks, 8 + i).below(2) == 0 ? 0.0 : ratio;
    default:
      return ratio;
  }
}

void ActuatorLink::step(MonotonicTime now) noexcept {
  if (faults_ != nullptr) break_lines(now);
  if (kill_switch_.sample() && !ignores_kill_switch_) gate_.kill();
  // Before take-off nobody commands, and the node still has to say that it is there.
  const bool alive = commanded_ || !armed_;
  if (alive) gate_.beat(now);
  (void)node_.step(now, {.cycle_ok = alive, .armed = armed_, .thrust_ratio = command_.thrust_ratio});
  commanded_ = false;
}

void ActuatorLink::advance(MonotonicTime now, double charge_ratio, firmware_if::Motors& motors) noexcept {
  bus_.advance(now);
  power_module_.step(faults_ != nullptr ? break_battery(charge_ratio) : charge_ratio, now);
  firmware_if::MotorCommand out;
  for (std::size_t i = 0; i < escs_.size(); ++i) {
    out.thrust_ratio[i] = escs_[i].step(now);
    if (faults_ != nullptr) out.thrust_ratio[i] = break_esc(i, out.thrust_ratio[i], now);
  }
  turning_ = out.thrust_ratio;
  (void)motors.command(out);
}

}  // namespace roborun::app
