/// CLOCK_MONOTONIC: of this machine, and counted from the start of the run.
#pragma once

#include <time.h>

#include "firmware_if/clock.hpp"

namespace roborun::rt {

/// Of this machine: on it are the stamps of sensor ports and of the kernel's buses. RT-safe: no system call on Linux (vDSO).
[[nodiscard]] inline MonotonicTime monotonic_now() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return MonotonicTime{Nanos{static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec}};
}

/// RT-safe. Never set back: the wall clock has no part in it.
class MonotonicClock final : public firmware_if::Clock {
 public:
  MonotonicClock() noexcept : epoch_(monotonic_now().time_since_epoch()) {}
  [[nodiscard]] MonotonicTime now() const noexcept override { return monotonic_now() - epoch_; }
  /// What CLOCK_MONOTONIC showed at the start of the run.
  [[nodiscard]] Nanos epoch() const noexcept { return epoch_; }
  /// For system calls that take an absolute CLOCK_MONOTONIC time.
  [[nodiscard]] timespec raw_time(MonotonicTime time) const noexcept {
    const std::int64_t ns = (time.time_since_epoch() + epoch_).count();
    return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
  }

 private:
  Nanos epoch_;
};

}  // namespace roborun::rt
