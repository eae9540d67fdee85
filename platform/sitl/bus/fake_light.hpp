/// A light on the bus: shows the colour that it was told last.
#pragma once

#include <cstdint>

#include "platform/sitl/bus/fake_node.hpp"

namespace roborun::sitl {

/// Obeys the entries of indication.LightsCommand with its id. Sends NodeStatus at 1 Hz.
class FakeLight {
 public:
  FakeLight(std::uint8_t node_id, std::uint8_t light_id, firmware_if::CanBus& bus) noexcept
      : light_id_(light_id), ear_(bus), heartbeat_(bus, node_id) {}

  /// Reads what came, sends what is due.
  void step(MonotonicTime now) noexcept {
    firmware_if::dronecan::LightsCommand command;
    MonotonicTime stamp;
    while (ear_.hear(command, stamp)) {
      for (const auto& light : command.commands.view()) {
        if (light.light_id == light_id_) colour_ = light.color;
      }
    }
    heartbeat_.step(now);
  }
  /// Dark until it is told.
  [[nodiscard]] const firmware_if::dronecan::Rgb565& colour() const noexcept { return colour_; }

 private:
  std::uint8_t light_id_;
  FakeEar<firmware_if::dronecan::LightsCommand> ear_;
  FakeHeartbeat heartbeat_;
  firmware_if::dronecan::Rgb565 colour_{};
};

}  // namespace roborun::sitl
