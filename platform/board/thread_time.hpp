/// Processor time of the calling thread: what other programs take is not in it.
#pragma once

#include <ctime>

namespace roborun::board {

/// Seconds since the thread began.
[[nodiscard]] inline double thread_time_s() noexcept {
  timespec now{};
  (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace roborun::board
