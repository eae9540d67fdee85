/// One mission as a table that a spreadsheet or a script reads.
#pragma once

#include <span>
#include <string>

#include "platform/report/mission_result.hpp"

namespace roborun::report {

/// One line per decision of every mission, with units in the column names.
[[nodiscard]] std::string trace_csv(std::span<const MissionReport> missions);

}  // namespace roborun::report
