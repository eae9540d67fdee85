#include "platform/report/progress_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace roborun::report {

ProgressLine::ProgressLine() : terminal_(isatty(STDERR_FILENO) != 0), start_(Clock::now()), last_(start_) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::clear() {
  if (terminal_ && shown_) fmt::print(stderr, "\r{:90}\r", "");
  shown_ = false;
}

bool ProgressLine::due() const {
  return std::chrono::duration<double>(Clock::now() - last_).count() >= (terminal_ ? 0.2 : 10.0);
}

void ProgressLine::show(const std::string& text) {
  if (!due()) return;
  last_ = Clock::now();
  shown_ = true;
  fmt::print(stderr, "{}{}{}", terminal_ ? "\r" : "", text, terminal_ ? "   " : "\n");
}

double ProgressLine::elapsed_s() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

}  // namespace roborun::report
