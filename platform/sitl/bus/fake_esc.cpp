#include "platform/sitl/bus/fake_esc.hpp"

namespace roborun::sitl {

double FakeEsc::step(MonotonicTime now) noexcept {
  constexpr double kFull = 8191.0;
  firmware_if::dronecan::EscRawCommand command;
  MonotonicTime stamp;
  while (ear_.hear(command, stamp)) {
    if (config_.index >= command.cmd.count) continue;
    const std::int16_t value = command.cmd.items[config_.index];
    ready_ = ready_ || value == 0;
    throttle_ = value > 0 && ready_ ? value : std::int16_t{0};
    heard_ = stamp;
    if (throttle_ != 0) last_thrust_ = stamp;
    ++commands_;
  }
  if (now - heard_ > config_.command_timeout) {
    throttle_ = 0;
    ready_ = false;
  }
  const double ratio = throttle_ / kFull;
  if (silent_) return ratio;
  if (status_.due(now)) {
    status_.say({.voltage = 44.4F,
                 .temperature = 310.0F,
                 .power_rating_pct = static_cast<std::uint8_t>(100.0 * ratio),
                 .esc_index = config_.index},
                now);
  }
  heartbeat_.step(now);
  return ratio;
}

}  // namespace roborun::sitl
