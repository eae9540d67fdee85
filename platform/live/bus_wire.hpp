/// The vehicle's bus: an interface of the kernel, or a bus made of two ports. And the lines beside it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "firmware_if/can.hpp"
#include "platform/gpio/kill_lines.hpp"
#include "platform/sensor_port/port_names.hpp"

namespace roborun::live {

/// Lines of this machine; those that are not given come over the port of lines.
struct BusLines {
  std::optional<gpio::KillWiring> kill{};
  std::optional<gpio::LineConfig> arm{};
};

/// Two ends of one bus: that of the runtime's node, and one on which its sensors are heard alone.
class BusWire {
 public:
  virtual ~BusWire() = default;
  /// On the ground, again and again. Empty: both ends are open. Otherwise what is wrong, in one line.
  [[nodiscard]] virtual std::string open() = 0;
  [[nodiscard]] virtual firmware_if::CanBus& node() noexcept = 0;
  [[nodiscard]] virtual firmware_if::CanBus& ear() noexcept = 0;
};

/// Stamps count from when CLOCK_MONOTONIC showed `epoch`.
[[nodiscard]] std::unique_ptr<BusWire> kernel_wire(const std::string& interface, Nanos epoch);
[[nodiscard]] std::unique_ptr<BusWire> port_wire(const sensor_port::VehiclePorts& ports, Nanos epoch);

}  // namespace roborun::live
