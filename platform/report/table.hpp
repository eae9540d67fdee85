/// The comparison that a person reads at the end of `roborun fly`.
#pragma once

#include <span>
#include <string>

#include "platform/report/mission_result.hpp"

namespace roborun::report {

/// One row per design, at most 110 columns, plain ASCII. Ratios are against the row of the design "static", if
/// there is one and it reached the goal.
[[nodiscard]] std::string comparison_table(std::span<const MissionResult> results);

}  // namespace roborun::report
