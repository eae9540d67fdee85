/// How often something is said to who waits: five times per second on a terminal, elsewhere every ten seconds.
#pragma once

#include <chrono>

namespace roborun::report {

class TerminalPace {
 public:
  explicit TerminalPace(bool terminal) : terminal_(terminal) {}

  [[nodiscard]] bool terminal() const { return terminal_; }
  /// True if it is time again: so long ago was said(), or this was made.
  [[nodiscard]] bool due() const { return Clock::now() - last_ >= (terminal_ ? kOnTerminal : kElsewhere); }
  void said() { last_ = Clock::now(); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kOnTerminal{200};
  static constexpr std::chrono::milliseconds kElsewhere{10'000};
  bool terminal_;
  Clock::time_point last_{Clock::now()};
};

}  // namespace roborun::report
