/// A CAN interface of the Linux kernel (SocketCAN).
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "firmware_if/can.hpp"

struct can_frame;

namespace roborun::can {

/// What an error frame of the kernel says about the controller, as far as we act on it.
struct CanErrorReport {
  bool bus_off{};
  bool restarted{};
  bool passive{};
  bool active{};  ///< Error counters are low again.
  bool no_acknowledge{};
};
/// RT-safe: O(1). `frame` has CAN_ERR_FLAG set.
[[nodiscard]] CanErrorReport classify_error(const can_frame& frame) noexcept;

/// One raw socket on one interface. See firmware_if::CanBus for the contract. In particular:
///  - only extended data frames and error frames pass the kernel's filter;
///  - a whole transfer is sent only if the socket has room for all of it; the socket's share is smaller than
///  the
///    interface's queue, so the queue itself (ENOBUFS) fills only if somebody else sends too: then the rest
///    of the transfer is given up and counted, and receivers drop the piece;
///  - after bus-off the kernel empties the interface's queue; nothing is sent until it reports a restart;
///  - stamps are the kernel's, moved to the clock of the run, at most 100 ms in the past, so that a jump of
///  the wall
///    clock cannot make a frame old;
///  - an interface that went down comes back by itself; one that was removed answers kIo until reopen().
class SocketCan final : public firmware_if::CanBus {
 public:
  SocketCan() = default;
  ~SocketCan() override;
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  /// Empty: opened. Otherwise what is wrong, in one line. Not for the loop. Stamps count from when
  /// CLOCK_MONOTONIC showed `epoch`.
  [[nodiscard]] std::string open(const std::string& interface, Nanos epoch = Nanos{0});
  /// Opens the same interface again, from a thread that is not the loop's; the loop's state() follows with
  /// the next frame. kIo: still not there.
  [[nodiscard]] Status reopen();

  [[nodiscard]] Status send(std::span<const firmware_if::CanFrame> transfer) noexcept override;
  [[nodiscard]] Status receive(firmware_if::CanFrame& frame) noexcept override;
  [[nodiscard]] firmware_if::CanState state() const noexcept override { return state_; }
  [[nodiscard]] const firmware_if::CanCounters& counters() const noexcept override { return counters_; }

 private:
  [[nodiscard]] std::string connect();
  void note(const CanErrorReport& report) noexcept;
  Status lose(int error) noexcept;

  std::string interface_;
  Nanos epoch_{0};
  // Only the loop's thread sets it to -1 (gone) and closes; only reopen() sets it from -1.
  std::atomic<int> socket_{-1};
  firmware_if::CanState state_{firmware_if::CanState::kDetached};
  std::uint32_t overflow_seen_{0};
  firmware_if::CanCounters counters_{};
};

}  // namespace roborun::can
