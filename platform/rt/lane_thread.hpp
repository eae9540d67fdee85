/// A lane of the executive on its own thread: pinned, at its real-time priority, on its own painted stack.
#pragma once

#include <pthread.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/executive/lane_executive.hpp"
#include "platform/rt/kernel_counters.hpp"
#include "platform/rt/monotonic_clock.hpp"

namespace roborun::rt {

/// Where and how urgently a thread runs.
struct Placement {
  int cpu{-1};      ///< -1: anywhere.
  int priority{0};  ///< SCHED_FIFO, 1 .. 99; 0: an ordinary thread.
};

/// For the lane as the frame table wants it, on the CPUs that this process may use; a lane whose own CPU does
/// not exist shares the last one.
[[nodiscard]] Placement placement_of(const core::LaneSpec& spec);
/// Empty if this process may run threads at the lanes' priorities, otherwise why not, in one line.
[[nodiscard]] std::string why_no_priority();
/// Empty if this process may run all lanes as the frame table wants them, otherwise one line a reason: no
/// real-time privilege, no CPU for a lane.
[[nodiscard]] std::vector<std::string> why_not_real_time();

/// SCHED_FIFO for the calling thread, 1 .. 99. Where this process has no right to it the thread goes on as well as it goes.
void take_priority(int priority) noexcept;

/// Sleeps to each release by absolute time, and runs the frame. The stack is mapped, painted and prefaulted
/// by start(); pages and context switches are those between the first and the last frame.
class LaneThread {
 public:
  LaneThread(core::LaneExecutive& lane, const MonotonicClock& clock) noexcept : lane_(lane), clock_(clock) {}
  ~LaneThread();
  LaneThread(const LaneThread&) = delete;
  LaneThread& operator=(const LaneThread&) = delete;

  /// Empty if the thread runs, otherwise one line. `watch_heap`: heap calls of this thread count once sealed.
  [[nodiscard]] std::string start(const Placement& placement, bool watch_heap);
  void request_stop() noexcept { stop_.store(true, std::memory_order_release); }
  /// After request_stop(): the frame in progress is finished. The counters hold from then on.
  void join() noexcept;

  [[nodiscard]] const KernelCounters& counters() const noexcept { return counters_; }
  [[nodiscard]] std::size_t stack_bytes() const noexcept { return stack_bytes_; }
  /// Most of the stack that was ever touched, from its paint. After join().
  [[nodiscard]] std::size_t stack_high_water_bytes() const noexcept;

 private:
  static void* entry(void* self) noexcept;
  void loop() noexcept;

  core::LaneExecutive& lane_;
  const MonotonicClock& clock_;
  pthread_t thread_{};
  bool running_{false};
  bool watch_heap_{false};
  std::atomic<bool> stop_{false};
  KernelCounters counters_{};
  std::byte* stack_{nullptr};
  std::size_t stack_bytes_{0};
};

}  // namespace roborun::rt
