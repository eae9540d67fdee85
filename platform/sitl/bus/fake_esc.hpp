/// A speed controller on the bus: obeys RawCommand, stops by itself when nobody commands, tells its state.
#pragma once

#include <cstdint>

#include "platform/sitl/bus/fake_node.hpp"

namespace roborun::sitl {

/// A node like one that can be bought: it turns only after it was told zero once, stops 200 ms after the last
/// command, sends NodeStatus at 1 Hz and esc.Status at 10 Hz.
class FakeEsc {
 public:
  struct Config {
    std::uint8_t node_id{};
    std::uint8_t index{};
    Nanos command_timeout{200'000'000};
  };
  FakeEsc(const Config& config, firmware_if::CanBus& bus) noexcept
      : config_(config),
        ear_(bus),
        status_(bus, config.node_id, 20, Nanos{100'000'000}),
        heartbeat_(bus, config.node_id) {}

  /// Reads what came, sends what is due. The thrust ratio it gives the motor now, 0 .. 1.
  double step(MonotonicTime now) noexcept;
  /// It says nothing any more, and obeys on.
  void set_silent(bool silent) noexcept { silent_ = silent; }
  /// When it last obeyed a throttle other than zero.
  [[nodiscard]] MonotonicTime last_thrust() const noexcept { return last_thrust_; }
  [[nodiscard]] std::uint64_t commands() const noexcept { return commands_; }

 private:
  Config config_;
  FakeEar<firmware_if::dronecan::EscRawCommand> ear_;
  FakeVoice<firmware_if::dronecan::EscStatus> status_;
  FakeHeartbeat heartbeat_;
  bool ready_{false};  ///< It was told zero.
  bool silent_{false};
  std::int16_t throttle_{0};
  MonotonicTime heard_{};
  MonotonicTime last_thrust_{};
  std::uint64_t commands_{0};
};

}  // namespace roborun::sitl
