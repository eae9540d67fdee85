/// A mission's result as a line of a file that must repeat, and back.
#pragma once

#include <optional>
#include <string>

#include "platform/report/mission_result.hpp"

namespace roborun::report {

/// to_json without what differs from run to run (real_time_factor, believed); no line end.
[[nodiscard]] std::string to_line(const MissionResult& result);
/// Empty if the text is not such a line. What was null reads as NaN.
[[nodiscard]] std::optional<MissionResult> from_line(const std::string& line);

}  // namespace roborun::report
