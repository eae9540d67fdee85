/// What a scenario asks of its flight, one by one, and what came of each.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "platform/mission/scenario_file.hpp"

namespace roborun::mission {

/// One condition of a scenario. Texts are for people; a program reads `condition` and `passed`.
struct Check {
  std::string condition;  ///< A key of [expect], "fence" or "fault".
  bool passed{};
  std::string value;  ///< What it was, with its unit.
  std::string limit;  ///< What it had to be, after "must be".
  double at_s{-1.0};  ///< When the value fell, since the start of the mission; -1: it belongs to no moment.
  std::string why;    ///< What led to it, one sentence; or empty.
};

/// Every condition that the scenario asks for, the outcome first: the fence is asked for by every scenario, and that its
/// faults were injected by every one that has some.
[[nodiscard]] std::vector<Check> checks_of(const Scenario& scenario, const report::MissionReport& report);
/// "outcome: landed at 11.32 s, must be reached_goal: the failsafe chose land at 7.88 s (mission; gnss)".
[[nodiscard]] std::string to_text(const Check& check);
/// The texts of those that did not pass; empty: the scenario passed.
[[nodiscard]] std::vector<std::string> complaints_of(const std::vector<Check>& checks);
[[nodiscard]] std::vector<std::string> complaints_of(const Scenario& scenario,
                                                     const report::MissionReport& report);
/// The moment that a failed flight should be looked at: that of the first action after which it could not pass any more, as
/// far as the checks tell, and otherwise the end. Within the time of its decisions, rounded up to 0.01 s; 0 without any.
[[nodiscard]] double moment_of(const std::vector<Check>& checks, const report::MissionReport& report);

/// condition, passed, value, limit, at_s (null: no moment), and why if there is one.
[[nodiscard]] nlohmann::json to_json(const Check& check);
/// {scenario, passed, complaints, checks, moment_s}, moment_s if it failed.
[[nodiscard]] LogVerdict log_verdict(const std::string& scenario, const std::vector<Check>& checks,
                                     const report::MissionReport& report);

}  // namespace roborun::mission
