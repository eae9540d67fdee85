#include "platform/report/progress_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace roborun::report {

ProgressLine::ProgressLine() : terminal_(isatty(STDERR_FILENO) != 0), start_(Clock::now()), last_(start_) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::clear() {
  if (terminal_ && shown_) (void)std::fputs(fmt::format("\r{:90}\r", "").c_str(), stderr);
  shown_ = false;
}

bool ProgressLine::due() const {
  return std::chrono::duration<double>(Clock::now() - last_).count() >= (terminal_ ? 0.2 : 10.0);
}

void ProgressLine::show(const std::string& text) {
  if (!due()) return;
  last_ = Clock::now();
  shown_ = true;
  // What cannot be written is left out: the work goes on.
  (void)std::fputs(fmt::format("{}{}{}", terminal_ ? "\r" : "", text, terminal_ ? "   " : "\n").c_str(),
                   stderr);
}

double ProgressLine::elapsed_s() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

}  // namespace roborun::report
