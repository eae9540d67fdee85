#include "firmware_if/status_lights.hpp"

namespace roborun::firmware_if {
namespace {

constexpr Nanos kRepeat{500'000'000};

dronecan::Rgb565 colour_of(VehicleState state, bool blink) noexcept {
  if (state == VehicleState::kSafe) return {.green = 63};
  if (state == VehicleState::kFailsafe && blink) return {.blue = 31};
  return {.red = 31};
}

}  // namespace

void StatusLights::step(MonotonicTime now, VehicleState state) noexcept {
  if (said_ && said_state_ == state && now - said_at_ < kRepeat) return;
  dronecan::LightsCommand command;
  (void)command.commands.push_back({.light_id = light_id_, .color = colour_of(state, blink_)});
  // A change that comes too soon for the gate is said in a later step.
  if (gate_.send(command, now) != Status::kOk) return;
  said_ = true;
  said_state_ = state;
  said_at_ = now;
  blink_ = !blink_;
}

}  // namespace roborun::firmware_if
