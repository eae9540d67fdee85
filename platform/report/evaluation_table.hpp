/// The tables of an evaluation beside its overall one: sensitivity, representative mission, and what
/// awareness gains against what faster code gains. Means, 95 % intervals over seeds, and what RoboRun
/// printed. Plain ASCII, at most 110 columns.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "platform/report/mission_result.hpp"
#include "platform/report/sweep_summary.hpp"

namespace roborun::report {

/// Mission time at each value of density, spread and distance, one row per design of `profile`, from missions
/// in which only that knob differs (sweep_sensitivity.hpp); the ratio of the highest knob to the lowest is
/// beside the published one. Where the sweep has no such missions the row says which environments are missing.
[[nodiscard]] std::string sensitivity_table(const std::vector<SweepRow>& rows, const std::string& profile);

/// Flights of one environment and profile, several seeds per design: time, velocity, energy, latency, and what
/// the decisions in zones A, B and C took: mean by stage, and the longest; for environment 14 beside what was
/// published. The borders are x in metres;
/// empty: one zone.
[[nodiscard]] std::string representative_table(std::span<const MissionReport> flights,
                                               const std::vector<double>& zone_borders_m);

/// What awareness gains, told apart from what faster code gains: {static-fair, aware} x map and planner x
/// profile, with the gains of each step. The rows may be of several sweeps.
[[nodiscard]] std::string kernel_table(const std::vector<SweepRow>& rows);

}  // namespace roborun::report
