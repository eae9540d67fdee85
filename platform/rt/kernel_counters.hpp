/// What the kernel itself counted for one thread.
#pragma once

#include <cstdint>

namespace roborun::rt {

struct KernelCounters {
  std::uint64_t minor_faults{}, major_faults{};
  std::uint64_t voluntary_switches{}, involuntary_switches{};
  std::uint64_t migrations{};
  bool migrations_known{};  ///< The kernel shows them (/proc/thread-self/sched).
};

/// Of the calling thread, since it began. Opens a file: before and after a measurement, not within.
[[nodiscard]] KernelCounters read_kernel_counters() noexcept;
/// What was counted between two readings.
[[nodiscard]] KernelCounters operator-(const KernelCounters& after, const KernelCounters& before) noexcept;

}  // namespace roborun::rt
