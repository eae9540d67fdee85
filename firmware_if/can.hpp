/// A classic CAN 2.0B bus: 29-bit identifiers, at most 8 bytes a frame.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

struct CanFrame {
  std::uint32_t id{};  ///< 29 bits; standard (11-bit) frames never reach the runtime.
  std::uint8_t size{};
  std::array<std::uint8_t, 8> data{};
  MonotonicTime stamp{};  ///< Received: end of frame on the bus. To send: when the content was made.

  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return {data.data(), size}; }
};

/// Where the controller stands, as ISO 11898-1 counts errors.
enum class CanState : std::uint8_t {
  kActive,
  kPassive,   ///< An error counter above 127: most often nobody acknowledges.
  kBusOff,    ///< Nothing is sent until the controller has recovered.
  kDetached,  ///< The interface is down or gone.
};

/// Never decrease.
struct CanCounters {
  std::uint64_t sent{};             ///< Frames handed to the driver.
  std::uint64_t received{};         ///< Frames handed out by receive().
  std::uint64_t refused{};          ///< Frames given up because there was no room; they are never sent later.
  std::uint64_t flushed{};          ///< Frames thrown away when the bus went off.
  std::uint64_t lost_on_receive{};  ///< Frames that came while the receive queue was full.
  std::uint64_t bus_off{};
  std::uint64_t error_passive{};
  std::uint64_t no_acknowledge{};
  std::uint64_t detached{};
};

/// Contract (proved on every implementation by tests/contract/can_bus_contract_test.cpp):
///  1. No call blocks or allocates.
///  2. send() takes all frames of a transfer or none: kOk: they are the driver's now; kNotReady: no room, or
///     bus off; they were dropped and counted, and never leave later; kIo: interface down or gone;
///     kInvalidArgument: no frame, more than kMostFrames, an id above 29 bits or more than 8 bytes.
///  3. Frames of one sender with the same id arrive in the order in which they were sent.
///  4. receive() hands out the oldest frame not yet read; kNotReady: none; kIo: interface down or gone.
///     A frame is never handed to its own sender.
///  5. When the bus goes off, what waits is thrown away and counted; after recovery only new frames leave.
class CanBus {
 public:
  static constexpr std::size_t kMostFrames = 64;  ///< The longest transfer: 384 bytes in 55 frames.

  virtual ~CanBus() = default;
  [[nodiscard]] virtual Status send(std::span<const CanFrame> transfer) noexcept = 0;
  [[nodiscard]] virtual Status receive(CanFrame& frame) noexcept = 0;
  [[nodiscard]] virtual CanState state() const noexcept = 0;
  [[nodiscard]] virtual const CanCounters& counters() const noexcept = 0;
};

}  // namespace roborun::firmware_if
