/// Where the runtime reads the time.
#pragma once

#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

/// Contract: now() never decreases, neither blocks nor allocates. Monotonic in flight, virtual in simulation.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual MonotonicTime now() const noexcept = 0;
};

}  // namespace roborun::firmware_if
