#include "platform/report/progress_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace roborun::report {

ProgressLine::ProgressLine() : pace_(isatty(STDERR_FILENO) != 0) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::clear() {
  if (pace_.terminal() && shown_) (void)std::fputs(fmt::format("\r{:90}\r", "").c_str(), stderr);
  shown_ = false;
}

void ProgressLine::show(const std::string& text) {
  if (!due()) return;
  pace_.said();
  shown_ = true;
  // What cannot be written is left out: the work goes on.
  const bool terminal = pace_.terminal();
  (void)std::fputs(fmt::format("{}{}{}", terminal ? "\r" : "", text, terminal ? "   " : "\n").c_str(),
                   stderr);
}

double ProgressLine::elapsed_s() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

}  // namespace roborun::report
