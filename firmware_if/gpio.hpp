/// Digital lines: inputs that are read, outputs that fall back to their safe level when we die.
#pragma once

#include <cstdint>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

enum class GpioBias : std::uint8_t { kNone, kPullUp, kPullDown };

/// Contract (proved on every implementation by tests/contract/gpio_contract_test.cpp):
///  1. No call blocks or allocates.
///  2. active() is the level now: true is active, whatever the polarity of the wire.
///  3. next_edge() hands out edges oldest first; kNotReady: none. At most 16 wait; newer ones are then lost:
///     so the level is read as well.
///  4. A line that is gone or was never there answers kIo, and never a level.
struct GpioEdge {
  MonotonicTime stamp{};
  bool active{};  ///< The level after it.
};

class GpioInput {
 public:
  virtual ~GpioInput() = default;
  [[nodiscard]] virtual Result<bool> active() noexcept = 0;
  [[nodiscard]] virtual Status next_edge(GpioEdge& edge) noexcept = 0;
};

/// Contract: set() neither blocks nor allocates; kIo: the line is gone. The line is inactive before the first
/// set(), and again after its owner is gone, however it went.
class GpioOutput {
 public:
  virtual ~GpioOutput() = default;
  [[nodiscard]] virtual Status set(bool active) noexcept = 0;
};

}  // namespace roborun::firmware_if
