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
/// Writes text the same way.
[[nodiscard]] std::string write_file(const std::string& path, const std::string& text);

}  // namespace roborun::report
