#include "platform/sitl/aircraft/simulated_actuators.hpp"

#include <limits>

namespace roborun::sitl {
namespace {

constexpr std::uint32_t kBitrate_bps = 1'000'000;
constexpr std::uint8_t kFirstEscNode = 21;
constexpr std::uint8_t kPowerModuleNode = 25;
constexpr std::size_t kPowerModulePort = 5;

template <typename Simulated, typename Device>
Device& outside_or(Device* outside, Simulated& simulated) noexcept {
  if (outside != nullptr) return *outside;
  return simulated;
}

}  // namespace

SimulatedActuators::SimulatedActuators(std::uint64_t seed, const OutsideActuators& outside) noexcept
    : bus_(kBitrate_bps, seed),
      port_(bus_.port(0)),
      node_(outside_or(outside.node, port_)),
      escs_{{{{.node_id = kFirstEscNode, .index = 0}, outside_or(outside.esc[0], bus_.port(1))},
             {{.node_id = kFirstEscNode + 1, .index = 1}, outside_or(outside.esc[1], bus_.port(2))},
             {{.node_id = kFirstEscNode + 2, .index = 2}, outside_or(outside.esc[2], bus_.port(3))},
             {{.node_id = kFirstEscNode + 3, .index = 3}, outside_or(outside.esc[3], bus_.port(4))}}},
      // It only sends: outside it does so through the last ESC's end.
      power_module_(kPowerModuleNode, outside_or(outside.esc[3], bus_.port(kPowerModulePort))),
      open_(outside_or(outside.kill_open, kill_open_)),
      closed_(outside_or(outside.kill_closed, kill_closed_)) {
  kill_closed_.drive(true, {});
}

void SimulatedActuators::break_lines(MonotonicTime now) noexcept {
  if (faults_ == nullptr) return;
  const FaultKind kill = faults_->of(Component::kKillSwitch);
  pulse_ = kill == FaultKind::kIntermittent && !pulse_;
  kill_open_.drive(kill == FaultKind::kOn || kill == FaultKind::kStuck || pulse_, now);
  kill_closed_.drive(kill != FaultKind::kOn && !pulse_, now);
  if (kill == FaultKind::kOff) kill_closed_.remove();

  const FaultKind can = faults_->of(Component::kCan);
  if (bus_off_ != (can == FaultKind::kOff)) {
    bus_off_ = !bus_off_;
    bus_off_ ? port_.go_bus_off() : port_.recover();
  }
  const double share = faults_->size(Component::kCan);
  bus_.set_faults({.loss_ratio = can == FaultKind::kIntermittent ? share : 0.0,
                   .corrupt_ratio = can == FaultKind::kGarbage ? share : 0.0});
}

double SimulatedActuators::break_battery(double charge_ratio) noexcept {
  const FaultKind kind = faults_->of(Component::kBattery);
  power_module_.set_silent(kind == FaultKind::kOff);
  if (kind == FaultKind::kNone) sound_charge_ratio_ = charge_ratio;
  if (kind == FaultKind::kWrong) return faults_->size(Component::kBattery);
  if (kind == FaultKind::kGarbage) return std::numeric_limits<double>::quiet_NaN();
  return sound_charge_ratio_;
}

double SimulatedActuators::break_esc(std::size_t i, double ratio, MonotonicTime now) noexcept {
  const int instance = static_cast<int>(i);
  const FaultKind kind = faults_->of(Component::kEsc, instance);
  escs_[i].set_silent(kind == FaultKind::kOff ||
                      faults_->of(Component::kEscStatus, instance) == FaultKind::kOff);
  const auto ticks = static_cast<std::uint64_t>(now.time_since_epoch() / Nanos{50'000'000});
  switch (kind) {
    case FaultKind::kOff:
      return 0.0;
    case FaultKind::kStuck:
      return ratio > 0.0 ? turning_[i] : 0.0;  // until it is told zero
    case FaultKind::kGarbage:
      return ratio > 0.0 ? core::CounterRng(ticks, i).uniform() : 0.0;
    case FaultKind::kWrong:
      return faults_->size(Component::kEsc, instance) * ratio;
    case FaultKind::kSlow:
      return turning_[i] + 0.02 * (ratio - turning_[i]);
    case FaultKind::kIntermittent:
      return faults_->loses(Component::kEsc, instance, ticks) ? 0.0 : ratio;
    default:
      return ratio;
  }
}

void SimulatedActuators::advance(MonotonicTime now, double charge_ratio,
                                 firmware_if::Motors& motors) noexcept {
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

}  // namespace roborun::sitl
