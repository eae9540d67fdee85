/// The clock on which the stamps of sensor ports and of the kernel's buses are.
#pragma once

#include <chrono>

#include "firmware_if/time.hpp"

namespace roborun::app {

/// CLOCK_MONOTONIC of this machine.
[[nodiscard]] inline MonotonicTime monotonic_now() noexcept {
  return MonotonicTime{std::chrono::steady_clock::now().time_since_epoch()};
}

}  // namespace roborun::app
