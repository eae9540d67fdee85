/// One mission as a table that a spreadsheet or a script reads.
#pragma once

#include <span>
#include <string>

#include "platform/report/mission_result.hpp"

namespace roborun::report {

/// Writes one line a decision of every mission, with units in the column names. Written beside `path` and
/// renamed, so that a half-written file never stays under that name. Empty if all is well, otherwise one line
/// that says what failed.
[[nodiscard]] std::string write_trace_csv(const std::string& path, std::span<const MissionReport> missions);
/// Empty if a file of that name could be written (or the name is empty), otherwise the line that write_file
/// would give: to be asked before long work.
[[nodiscard]] std::string cannot_write(const std::string& path);
/// Writes text the same way.
[[nodiscard]] std::string write_file(const std::string& path, const std::string& text);

}  // namespace roborun::report
