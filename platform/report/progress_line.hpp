/// A line on the terminal that is rewritten, or one line every ten seconds where there is no terminal.
#pragma once

#include <chrono>
#include <string>

#include "platform/report/terminal_pace.hpp"

namespace roborun::report {

class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// True if a call of show() now would be seen, so that nobody formats for nothing.
  [[nodiscard]] bool due() const { return pace_.due(); }
  /// Writes the line to standard error.
  void show(const std::string& text);
  /// Takes the line off the terminal before something else is printed there.
  void clear();
  /// Wall time since this was made.
  [[nodiscard]] double elapsed_s() const;

 private:
  using Clock = std::chrono::steady_clock;
  TerminalPace pace_;
  bool shown_{false};
  Clock::time_point start_{Clock::now()};
};

}  // namespace roborun::report
