/// What carries commands to the ESCs when it is not the simulator's own bus: two interfaces of the kernel.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "firmware_if/can.hpp"
#include "platform/can/command_meter.hpp"
#include "platform/can/socket_can.hpp"

namespace roborun::can {

/// The vehicle on one interface, four ESCs on another one of the same wire (or, on vcan, on the same one),
/// each with a socket of its own. What happens between vehicle and first ESC is metered.
class KernelMotorBus {
 public:
  /// Stamps count from `epoch` of the monotonic clock. Throws InputError, in one line, for an interface that
  /// cannot be used. `late_after`: as CommandMeter's.
  KernelMotorBus(const std::string& vehicle, const std::string& escs, Nanos epoch, Nanos late_after);
  KernelMotorBus(const KernelMotorBus&) = delete;
  KernelMotorBus& operator=(const KernelMotorBus&) = delete;

  /// The vehicle's end of the bus.
  [[nodiscard]] firmware_if::CanBus& node() noexcept { return node_; }
  /// An ESC's end of the bus (whatever else is simulated speaks through one of these). Precondition:
  /// index < 4.
  [[nodiscard]] firmware_if::CanBus& esc(std::size_t index) noexcept;
  [[nodiscard]] const can::CommandMeter& meter() const noexcept { return meter_; }

 private:
  can::CommandMeter meter_;
  can::SocketCan vehicle_;
  std::array<can::SocketCan, 4> esc_;
  can::MeteredBus node_;
  can::MeteredBus first_esc_;
};

}  // namespace roborun::can
