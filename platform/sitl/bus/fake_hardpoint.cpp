#include "platform/sitl/bus/fake_hardpoint.hpp"

namespace roborun::sitl {

void FakeHardpoint::step(MonotonicTime now) noexcept {
  firmware_if::dronecan::HardpointCommand command;
  MonotonicTime stamp;
  const bool was_open = open_;
  while (ear_.hear(command, stamp)) {
    if (command.hardpoint_id != config_.hardpoint_id) continue;
    open_ = command.command == 0;
    dropped_ = dropped_ || open_;
    ++commands_;
  }
  if (status_.due(now) || open_ != was_open) {
    status_.say({.hardpoint_id = config_.hardpoint_id,
                 .payload_weight = dropped_ ? 0.0F : config_.package_N,
                 .status = static_cast<std::uint16_t>(open_ ? 0 : 1)},
                now);
  }
  heartbeat_.step(now);
}

}  // namespace roborun::sitl
