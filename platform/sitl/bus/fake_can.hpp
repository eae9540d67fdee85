/// A CAN bus in virtual time: bit timing, arbitration by identifier, queues of fixed size, and faults.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/random/counter_rng.hpp"
#include "firmware_if/can.hpp"
#include "platform/sitl/bus/ring.hpp"

namespace roborun::sitl {

/// Each applies to one frame at one receiver. Ratios 0 .. 1.
struct CanFaults {
  double loss_ratio{};
  double duplicate_ratio{};
  double reorder_ratio{};  ///< The frame is held back until the next one has arrived.
  double corrupt_ratio{};  ///< One bit of the data flips and no controller notices.
};

class FakeCan;

/// One controller. Thread: that of the simulation.
class FakeCanPort final : public firmware_if::CanBus {
 public:
  static constexpr std::size_t kSendQueue_frames = 128;
  static constexpr std::size_t kReceiveQueue_frames = 256;

  [[nodiscard]] Status send(std::span<const firmware_if::CanFrame> transfer) noexcept override;
  [[nodiscard]] Status receive(firmware_if::CanFrame& frame) noexcept override;
  [[nodiscard]] firmware_if::CanState state() const noexcept override { return state_; }
  [[nodiscard]] const firmware_if::CanCounters& counters() const noexcept override { return counters_; }

  /// The controller stops; what waits is thrown away. It recovers with recover().
  void go_bus_off() noexcept;
  void recover() noexcept;
  /// The interface is down or gone; attach() brings it back with empty queues.
  void detach() noexcept;
  void attach() noexcept;

 private:
  friend class FakeCan;
  void deliver(const firmware_if::CanFrame& frame, const CanFaults& faults, core::CounterRng& rng) noexcept;
  void put(const firmware_if::CanFrame& frame) noexcept;

  bool connected_{false};
  firmware_if::CanState state_{firmware_if::CanState::kActive};
  firmware_if::CanCounters counters_{};
  Ring<firmware_if::CanFrame, kSendQueue_frames> to_send_;
  Ring<firmware_if::CanFrame, kReceiveQueue_frames> received_;
  Ring<firmware_if::CanFrame, 1> held_back_;
};

/// The wire. A frame of n bytes takes 67 + 8 n bit times (without stuff bits: 131 for 8 bytes, 7,634 frames/s
/// at 1 Mbit/s). With nobody to acknowledge nothing leaves, and the controller is error-passive.
class FakeCan {
 public:
  static constexpr std::size_t kPorts = 9;

  FakeCan(std::uint32_t bitrate_bps, std::uint64_t seed) noexcept
      : bitrate_bps_(bitrate_bps), rng_(seed, 0xca9) {}

  /// Precondition: index < kPorts. A port takes part from its first use on.
  [[nodiscard]] FakeCanPort& port(std::size_t index) noexcept;
  void set_faults(const CanFaults& faults) noexcept { faults_ = faults; }
  /// Runs the wire until `to`: frames that end by then are delivered, stamped with their end.
  void advance(MonotonicTime to) noexcept;
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  /// Time that the wire was busy.
  [[nodiscard]] Nanos busy() const noexcept { return busy_; }

 private:
  [[nodiscard]] FakeCanPort* next_sender() noexcept;

  std::uint32_t bitrate_bps_;
  core::CounterRng rng_;
  CanFaults faults_{};
  std::array<FakeCanPort, kPorts> ports_{};
  MonotonicTime free_at_{};
  std::uint64_t frames_{0};
  Nanos busy_{0};
};

}  // namespace roborun::sitl
