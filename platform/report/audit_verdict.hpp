/// Pass or fail: what an audit must show, and whether it does. The table in the source holds every requirement
/// with its default.
#pragma once

#include <string>
#include <vector>

#include "platform/report/audit_report.hpp"

namespace roborun::report {

/// "At most `limit`", of a lane or of the whole run.
struct Requirement {
  std::string name;  ///< NAME of the run, or LANE.NAME.
  double limit{};    ///< Infinity: not required.
  bool is_default{true};
};

/// The defaults, with `texts` (each NAME=LIMIT, a limit of 0 or more, or none) put in their place or added. Of a figure of lanes, NAME
/// alone means every lane that has a default for it, LANE.NAME that lane. Throws std::invalid_argument with what
/// would be right.
[[nodiscard]] std::vector<Requirement> requirements_of(const std::vector<std::string>& texts);
/// Whether the report meets each of them. What cannot be known is not met: too few samples for a percentile, a
/// heap that was not watched. Requirements on a bus or kill switch that the run did not have are left out.
[[nodiscard]] std::vector<JudgedRequirement> judge(const AuditReport& report,
                                                   const std::vector<Requirement>& requirements);
/// Every name, its meaning and its defaults, for --help.
[[nodiscard]] std::string requirement_help();

}  // namespace roborun::report
