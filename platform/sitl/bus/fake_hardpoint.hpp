/// A package hook on the bus: holds or lets go as it is told, and says what hangs on it.
#pragma once

#include <cstdint>

#include "platform/sitl/bus/fake_node.hpp"

namespace roborun::sitl {

/// Obeys hardpoint.Command with its id: 0 opens, anything else closes. A package that fell does not come
/// back. Sends hardpoint.Status and NodeStatus at 1 Hz, and the former at each change.
class FakeHardpoint {
 public:
  struct Config {
    std::uint8_t node_id{};
    std::uint8_t hardpoint_id{1};
    float package_N{20.0F};  ///< Weight of what hangs on it at the start.
  };
  FakeHardpoint(const Config& config, firmware_if::CanBus& bus) noexcept
      : config_(config),
        ear_(bus),
        status_(bus, config.node_id, 16, Nanos{1'000'000'000}),
        heartbeat_(bus, config.node_id) {}

  /// Reads what came, sends what is due.
  void step(MonotonicTime now) noexcept;
  [[nodiscard]] bool open() const noexcept { return open_; }
  [[nodiscard]] bool holds_package() const noexcept { return !dropped_; }
  [[nodiscard]] std::uint64_t commands() const noexcept { return commands_; }

 private:
  Config config_;
  FakeEar<firmware_if::dronecan::HardpointCommand> ear_;
  FakeVoice<firmware_if::dronecan::HardpointStatus> status_;
  FakeHeartbeat heartbeat_;
  bool open_{false};
  bool dropped_{false};
  std::uint64_t commands_{0};
};

}  // namespace roborun::sitl
