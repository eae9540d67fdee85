/// What carries commands to the ESCs when it is not the simulator's own bus: two interfaces of the kernel.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "firmware_if/can.hpp"
#include "platform/can/socket_can.hpp"
#include "platform/rt/monotonic_clock.hpp"
#include "platform/sitl/bus/command_meter.hpp"

namespace roborun::app {

/// The vehicle's end of the bus, and that of each ESC (whatever else is simulated speaks through one of
/// these).
class MotorBus {
 public:
  virtual ~MotorBus() = default;
  [[nodiscard]] virtual firmware_if::CanBus& node() noexcept = 0;
  /// Precondition: index < 4.
  [[nodiscard]] virtual firmware_if::CanBus& esc(std::size_t index) noexcept = 0;
};

/// The vehicle on one interface, four ESCs on another one of the same wire (or, on vcan, on the same one),
/// each with a socket of its own. What happens between vehicle and first ESC is metered.
class KernelMotorBus final : public MotorBus {
 public:
  /// Stamps count as `clock` does. Throws sitl::InputError, in one line, for an interface that cannot be
  /// used. `late_after`: as CommandMeter's.
  KernelMotorBus(const std::string& vehicle, const std::string& escs, const rt::MonotonicClock& clock,
                 Nanos late_after);
  KernelMotorBus(const KernelMotorBus&) = delete;
  KernelMotorBus& operator=(const KernelMotorBus&) = delete;

  [[nodiscard]] firmware_if::CanBus& node() noexcept override { return node_; }
  [[nodiscard]] firmware_if::CanBus& esc(std::size_t index) noexcept override;
  [[nodiscard]] const sitl::CommandMeter& meter() const noexcept { return meter_; }

 private:
  sitl::CommandMeter meter_;
  can::SocketCan vehicle_;
  std::array<can::SocketCan, 4> esc_;
  sitl::MeteredBus node_;
  sitl::MeteredBus first_esc_;
};

}  // namespace roborun::app
