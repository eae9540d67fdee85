#include "platform/flight/actuator_side.hpp"

#include <algorithm>
#include <limits>

namespace roborun::flight {
namespace {

constexpr std::size_t kMotors = 4;
constexpr Nanos kBatterySilence{500'000'000};

}  // namespace

ActuatorSide::ActuatorSide(Nanos minor_frame, firmware_if::CanBus& bus, firmware_if::GpioInput& open,
                           firmware_if::GpioInput& closed, Arming arming) noexcept
    : gate_({.beat_timeout = 3 * minor_frame}, bus),
      node_({.command_period = minor_frame}, gate_, bus, sessions_),
      kill_switch_(open, closed),
      arming_(arming) {}

Status ActuatorSide::command(const firmware_if::MotorCommand& command) noexcept {
  for (const double ratio : command.thrust_ratio) {
    if (!(ratio >= 0.0 && ratio <= 1.0)) return Status::kInvalidArgument;
  }
  command_ = command;
  commanded_ = true;
  if (!armed_ && !disarmed_)
    armed_ = (arming_ == Arming::kProven ? gate_.arm(kill_switch_) : gate_.arm_unproven()) == Status::kOk;
  return Status::kOk;
}

Status ActuatorSide::forget_proof() noexcept {
  if (armed_ || disarmed_) return Status::kInvalidArgument;
  if (const Status status = kill_switch_.reset(); status != Status::kOk) return status;
  return gate_.reset_kill(kill_switch_);
}

void ActuatorSide::disarm() noexcept {
  gate_.disarm();
  armed_ = false;
  disarmed_ = true;
}

void ActuatorSide::step(MonotonicTime now) noexcept {
  if (kill_switch_.sample() && !ignores_kill_switch_) gate_.kill();
  // Before take-off nobody commands, and the node still has to say that it is there.
  const bool alive = commanded_ || !armed_;
  if (alive) gate_.beat(now);
  (void)node_.step(now, {.cycle_ok = alive, .armed = armed_, .thrust_ratio = command_.thrust_ratio});
  commanded_ = false;
}

Nanos ActuatorSide::esc_silence(MonotonicTime now) const noexcept {
  Nanos longest{0};
  for (std::size_t i = 0; i < kMotors; ++i) longest = std::max(longest, now - node_.inbox().esc[i].stamp);
  return longest;
}

double ActuatorSide::charge_ratio(MonotonicTime now) const noexcept {
  const auto& battery = node_.inbox().battery;
  const std::uint8_t charge_pct = battery.message.state_of_charge_pct;
  if (battery.count == 0 || now - battery.stamp > kBatterySilence || charge_pct > 100)
    return std::numeric_limits<double>::quiet_NaN();
  return charge_pct / 100.0;
}

}  // namespace roborun::flight
