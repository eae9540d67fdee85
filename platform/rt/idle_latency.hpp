/// CPUs do not sleep deeper than what costs nothing to wake from, while this lives: on a board with idle
/// states, waking from the deepest takes longer than a wake-up may (up to some milliseconds; Linux,
/// Documentation/power/pm_qos_interface.rst).
#pragma once

#include <string>

namespace roborun::rt {

/// Holds /dev/cpu_dma_latency at 0 us. Where that is not to be had (no such device, no permission), flight
/// goes on and the report says so. Opens a file: before real time starts.
class IdleLatencyHold {
 public:
  IdleLatencyHold() noexcept;
  ~IdleLatencyHold();
  IdleLatencyHold(const IdleLatencyHold&) = delete;
  IdleLatencyHold& operator=(const IdleLatencyHold&) = delete;

  /// "held at 0 us", or why not.
  [[nodiscard]] std::string describe() const;

 private:
  int file_{-1};
  int error_{0};
};

}  // namespace roborun::rt
