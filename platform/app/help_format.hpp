/// How --help is laid out: as the parser does it, wrapped at the terminal's width. Of main alone.
#pragma once

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>

namespace roborun::app {

/// Columns of whoever reads standard output: COLUMNS if it is 40 to 1,000, else the terminal's; 0: no terminal,
/// nothing is wrapped.
[[nodiscard]] inline std::size_t help_width() {
  if (const char* columns = std::getenv("COLUMNS"); columns != nullptr) {
    const long n = std::strtol(columns, nullptr, 10);
    if (n >= 40 && n <= 1000) return static_cast<std::size_t>(n);
  }
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 0;
  return std::max<std::size_t>(size.ws_col, 40);
}

/// `text` with no line over `width` (0: as it is) that could be broken at a space; what goes on begins with
/// `indent` spaces. A line that begins with a space is a command or a table, and stays whole.
[[nodiscard]] inline std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  std::string out;
  const std::size_t room = width > indent + 10 ? width - indent : 10;
  while (true) {
    const std::size_t newline = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, newline);
    while (width != 0 && line.size() > room && line.front() != ' ') {
      std::size_t cut = line.rfind(' ', room);
      if (cut == std::string_view::npos) cut = line.find(' ');  // a long word has its line
      if (cut == std::string_view::npos) break;
      out += fmt::format("{}\n{:{}}", line.substr(0, cut), "", indent);
      line = line.substr(cut + 1);
    }
    out += line;
    if (newline == text.size()) return out;
    out += fmt::format("\n{:{}}", "", indent);
    text = text.substr(newline + 1);
  }
}

class HelpFormat final : public CLI::Formatter {
 public:
  explicit HelpFormat(std::size_t width) : width_(width) {}

  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return columns(make_option_name(option, is_positional) + make_option_opts(option),
                   make_option_desc(option));
  }
  std::string make_subcommand(const CLI::App* sub) const override {
    return columns(sub->get_display_name(true), sub->get_description());
  }
  std::string make_footer(const CLI::App* app) const override {
    const std::string footer = app->get_footer();
    return footer.empty() ? "" : wrapped(footer, width_, 0) + "\n";
  }

 private:
  [[nodiscard]] std::string columns(const std::string& name, const std::string& about) const {
    const std::size_t column = get_column_width();
    if (about.empty()) return fmt::format("  {}\n", name);
    const std::string gap = name.size() + 2 < column ? "" : fmt::format("\n{:{}}", "", column);
    return fmt::format("  {:<{}}{}{}\n", name, column - 2, gap, wrapped(about, width_, column));
  }

  std::size_t width_;
};

}  // namespace roborun::app
