/// The figures of the paper's evaluation, from a sweep. Each function gives a complete SVG file without
/// external resources; the same rows give the same bytes.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "platform/report/mission_result.hpp"
#include "platform/report/sweep_summary.hpp"

namespace roborun::report {

/// Velocity, mission time, energy, latency and CPU time per decision: one bar per design and profile, whiskers: 95
/// % interval over seeds, dashes: what RoboRun printed.
[[nodiscard]] std::string overall_svg(const std::vector<SweepRow>& rows);

/// Mission time, velocity and energy over density, spread and distance, logarithmic: one line per design of
/// `profile`, whiskers as above, and the ratio of the highest knob to the lowest beside the published one.
/// Drawn from missions in which only that knob differs (sweep_sensitivity.hpp); where there are none the
/// chart says which environments are missing.
[[nodiscard]] std::string sensitivity_svg(const std::vector<SweepRow>& rows, const std::string& profile);

/// One flight a design: velocity, precision and the latency of each stage over time, with the deadline, and
/// the mean latency by stage in zones A, B and C (the borders are x in metres; empty: one zone).
[[nodiscard]] std::string breakdown_svg(std::span<const MissionReport> flights,
                                        const std::vector<double>& zone_borders_m);

}  // namespace roborun::report
