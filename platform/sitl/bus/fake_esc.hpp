/// A speed controller on the bus: obeys RawCommand, stops by itself when nobody commands, tells its state.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/can.hpp"
#include "firmware_if/dronecan/transfer.hpp"

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
        bus_(bus),
        reassembler_(firmware_if::dronecan::kAllTypes, sessions_, config.node_id) {}
  FakeEsc(const FakeEsc&) = delete;  // the reassembler looks into our own sessions
  FakeEsc& operator=(const FakeEsc&) = delete;

  /// Reads what came, sends what is due. The thrust ratio it gives the motor now, 0 .. 1.
  double step(MonotonicTime now) noexcept;
  /// It says nothing any more, and obeys on.
  void set_silent(bool silent) noexcept { silent_ = silent; }
  /// When it last obeyed a throttle other than zero.
  [[nodiscard]] MonotonicTime last_thrust() const noexcept { return last_thrust_; }
  [[nodiscard]] std::uint64_t commands() const noexcept { return commands_; }

 private:
  template <typename T>
  void say(const T& message, std::uint8_t priority, std::uint8_t& transfer_id, MonotonicTime now) noexcept;

  Config config_;
  firmware_if::CanBus& bus_;
  std::array<firmware_if::dronecan::Reassembler::Session, 4> sessions_{};
  firmware_if::dronecan::Reassembler reassembler_;
  bool ready_{false};  ///< It was told zero.
  bool silent_{false};
  std::int16_t throttle_{0};
  MonotonicTime heard_{};
  MonotonicTime last_thrust_{};
  MonotonicTime next_status_{};
  MonotonicTime next_node_status_{};
  std::uint8_t status_transfer_id_{0};
  std::uint8_t node_status_transfer_id_{0};
  std::uint64_t commands_{0};
};

}  // namespace roborun::sitl
