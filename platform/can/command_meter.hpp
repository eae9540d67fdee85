/// How long throttles take from the controller to an ESC, and which of them get lost: on any bus.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/executive/slot_statistics.hpp"
#include "firmware_if/can.hpp"

namespace roborun::can {

/// Counts esc.RawCommand frames (up to four throttles are one frame) at both ends, paired by transfer id:
/// right as long as a command arrives within 31 others. One thread.
class CommandMeter {
 public:
  /// Older when it arrives than this: late.
  explicit CommandMeter(Nanos late_after) noexcept : late_after_(late_after) {}

  void sent(const firmware_if::CanFrame& frame) noexcept;
  void heard(const firmware_if::CanFrame& frame) noexcept;

  /// Never decrease. Lost: one that was sent later was heard first, or 32 were sent since. The rest of those
  /// sent is on its way.
  [[nodiscard]] std::uint64_t sent() const noexcept { return sent_; }
  [[nodiscard]] std::uint64_t heard() const noexcept { return heard_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  [[nodiscard]] std::uint64_t late() const noexcept { return late_; }
  /// From the stamp of the sender (when the content was made) to that of the receiver (end of frame).
  [[nodiscard]] const core::DurationHistogram& age() const noexcept { return age_; }
  /// Between two that were heard.
  [[nodiscard]] const core::DurationHistogram& gap() const noexcept { return gap_; }

 private:
  Nanos late_after_;
  std::array<MonotonicTime, 32> made_{};
  std::array<std::uint64_t, 32> on_its_way_{};  ///< As the how manieth it was sent; 0: it is not.
  MonotonicTime last_heard_{};
  std::uint64_t sent_{0}, heard_{0}, lost_{0}, late_{0};
  core::DurationHistogram age_{}, gap_{};
};

/// A bus with the meter at it: hands everything through.
class MeteredBus final : public firmware_if::CanBus {
 public:
  MeteredBus(firmware_if::CanBus& bus, CommandMeter& meter) noexcept : bus_(bus), meter_(meter) {}
  [[nodiscard]] Status send(std::span<const firmware_if::CanFrame> transfer) noexcept override {
    const Status status = bus_.send(transfer);
    if (status == Status::kOk) meter_.sent(transfer.front());
    return status;
  }
  [[nodiscard]] Status receive(firmware_if::CanFrame& frame) noexcept override {
    const Status status = bus_.receive(frame);
    if (status == Status::kOk) meter_.heard(frame);
    return status;
  }
  [[nodiscard]] firmware_if::CanState state() const noexcept override { return bus_.state(); }
  [[nodiscard]] const firmware_if::CanCounters& counters() const noexcept override { return bus_.counters(); }

 private:
  firmware_if::CanBus& bus_;
  CommandMeter& meter_;
};

}  // namespace roborun::can
