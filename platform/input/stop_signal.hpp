/// Ctrl-C and SIGTERM as a question that long work asks, instead of an end in the middle.
#pragma once

#include <csignal>
#include <stdexcept>

namespace roborun::input {

/// Thrown where work ends because of a signal: what was done so far, in one line.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// While one lives, the first signal is kept for requested(); a second one ends the process at once.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  /// Since the last one was made; also true after it is gone.
  [[nodiscard]] static bool requested() noexcept;

 private:
  struct sigaction int_ {};
  struct sigaction term_ {};
};

}  // namespace roborun::input
