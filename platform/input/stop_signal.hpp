/// Ctrl-C, SIGTERM and SIGHUP as a question that long work asks, instead of an end in the middle.
#pragma once

#include <array>
#include <csignal>
#include <stdexcept>

namespace roborun::input {

/// Thrown where work ends because of a signal: what was done so far, in one line.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// While one lives, the first signal is kept for requested(); a second one of its kind ends the process at once. SIGHUP
/// stays ignored where it was (nohup).
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  /// Since the last one was made; also true after it is gone.
  [[nodiscard]] static bool requested() noexcept;

 private:
  std::array<struct sigaction, 3> before_{};
};

}  // namespace roborun::input
