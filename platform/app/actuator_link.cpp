#include "platform/app/actuator_link.hpp"

namespace roborun::app {
namespace {

constexpr std::uint32_t kBitrate_bps = 1'000'000;
constexpr std::uint8_t kFirstEscNode = 21;

}  // namespace

ActuatorLink::ActuatorLink(std::uint64_t seed, Nanos minor_frame) noexcept
    : bus_(kBitrate_bps, seed),
      port_(bus_.port(0)),
      gate_({.beat_timeout = 3 * minor_frame}, port_),
      node_({.command_period = minor_frame}, gate_, port_, sessions_),
      escs_{{{{.node_id = kFirstEscNode, .index = 0}, bus_.port(1)},
             {{.node_id = kFirstEscNode + 1, .index = 1}, bus_.port(2)},
             {{.node_id = kFirstEscNode + 2, .index = 2}, bus_.port(3)},
             {{.node_id = kFirstEscNode + 3, .index = 3}, bus_.port(4)}}},
      kill_switch_(kill_open_, kill_closed_) {
  kill_closed_.drive(true, {});
}

Status ActuatorLink::command(const firmware_if::MotorCommand& command) noexcept {
  for (const double ratio : command.thrust_ratio) {
    if (!(ratio >= 0.0 && ratio <= 1.0)) return Status::kInvalidArgument;
  }
  command_ = command;
  commanded_ = true;
  if (!armed_) armed_ = gate_.arm() == Status::kOk;
  return Status::kOk;
}

void ActuatorLink::step(MonotonicTime now) noexcept {
  if (kill_switch_.sample()) gate_.kill();
  // Before take-off nobody commands, and the node still has to say that it is there.
  const bool alive = commanded_ || !armed_;
  if (alive) gate_.beat(now);
  (void)node_.step(now, {.cycle_ok = alive, .armed = armed_, .thrust_ratio = command_.thrust_ratio});
  commanded_ = false;
}

void ActuatorLink::advance(MonotonicTime now, firmware_if::Motors& motors) noexcept {
  bus_.advance(now);
  firmware_if::MotorCommand out;
  for (std::size_t i = 0; i < escs_.size(); ++i) out.thrust_ratio[i] = escs_[i].step(now);
  (void)motors.command(out);
}

void ActuatorLink::press_kill_switch(MonotonicTime now) noexcept {
  kill_open_.drive(true, now);
  kill_closed_.drive(false, now);
}

}  // namespace roborun::app
