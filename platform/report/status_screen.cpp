#include "platform/report/status_screen.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace roborun::report {
namespace {

/// What cannot be written, to a terminal that went or a disk that is full, is left out: a flight hangs on who says it.
void write(std::FILE* to, const std::string& text) {
  (void)std::fputs(text.c_str(), to);
  (void)std::fflush(to);
}

/// A terminal that moves its cursor.
bool is_screen(std::FILE* file) {
  const char* const kind = std::getenv("TERM");
  return isatty(fileno(file)) != 0 && kind != nullptr && std::string_view(kind) != "dumb";
}

}  // namespace

StatusScreen::StatusScreen(std::FILE* to) : to_(to), pace_(is_screen(to)) {}

StatusScreen::~StatusScreen() {
  if (shown_ > 0) write(to_, fmt::format("\x1b[{}A\x1b[J", shown_));
}

void StatusScreen::show(const std::vector<Row>& rows) {
  if (!due()) return;
  pace_.said();
  std::string text = shown_ > 0 ? fmt::format("\x1b[{}A", shown_) : "";
  for (const auto& [what, how] : rows) {
    if (pace_.terminal())
      text += fmt::format("{:<10} {}\x1b[K\n", what, how);
    else
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", what, how);
  }
  if (pace_.terminal())
    shown_ = rows.size();
  else
    text += "\n";
  write(to_, text);
}

}  // namespace roborun::report
