/// A few lines on the terminal that are rewritten in place, without colours; where there is no terminal, one plain line every ten
/// seconds.
#pragma once

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "platform/report/terminal_pace.hpp"

namespace roborun::report {

class StatusScreen {
 public:
  using Row = std::pair<std::string, std::string>;  ///< What, and how it is. The first one tells most.

  /// `to` outlives it.
  explicit StatusScreen(std::FILE* to);
  /// Takes the lines off the terminal.
  ~StatusScreen();
  StatusScreen(const StatusScreen&) = delete;
  StatusScreen& operator=(const StatusScreen&) = delete;

  /// True if a call of show() now would be seen.
  [[nodiscard]] bool due() const { return pace_.due(); }
  /// In the place of the rows before. Nothing before it is due().
  void show(const std::vector<Row>& rows);

 private:
  std::FILE* to_;
  TerminalPace pace_;
  std::size_t shown_{0};  ///< Lines on the terminal.
};

}  // namespace roborun::report
