/// What a sweep says about each design: means, 95 % intervals over seeds, and the published values.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "platform/report/mission_result.hpp"

namespace roborun::report {

/// A mission and the knobs of its environment.
struct SweepRow {
  MissionResult result;
  double density_ratio{};
  double spread_m{};
  double distance_m{};
};

/// A mean over missions. The interval is that of the mean over seeds: each seed gives one mean over its
/// environments, and Student's t of these; NaN with one seed (no interval).
struct Estimate {
  double mean{std::numeric_limits<double>::quiet_NaN()};
  double half_95{std::numeric_limits<double>::quiet_NaN()};
};

/// Velocity, time, energy and CPU time are means over the missions that reached the goal without a collision:
/// read them together with `reached`. NaN where no mission counts.
struct DesignSummary {
  std::string design;
  std::string profile;
  int missions{};
  int reached{};
  int collided{};
  std::uint64_t decisions{};
  std::uint64_t deadline_misses{};
  Estimate velocity_mps;
  Estimate mission_time_s;
  Estimate energy_kJ;
  Estimate flight_Jpm, computing_Jpm;
  Estimate latency_s;  ///< Of the missions' medians; its mean is their median, as published.
  Estimate cpu_s_per_decision;
};

/// How many times as good one is as another, over the missions (environment, seed) that both reached: faster,
/// shorter, with less energy, latency and CPU time per decision. Intervals: each seed gives one ratio.
struct Gain {
  int pairs{};
  Estimate velocity, mission_time, energy, latency, cpu_s_per_decision;
};

/// What RoboRun printed; NaN where it printed nothing. Source: FACTS of the paper: overall metrics, means
/// over the 27 environments, one run each; latency: the representative mission.
struct Published {
  double velocity_mps, mission_time_s, energy_kJ;
  double time_ratio_density, time_ratio_spread,
      time_ratio_distance;  ///< Mission time, highest to lowest knob.
};
[[nodiscard]] std::optional<Published> published(const std::string& design);

/// In the order of first appearance.
[[nodiscard]] std::vector<DesignSummary> summarise(const std::vector<SweepRow>& rows);
[[nodiscard]] Gain gain(const std::vector<const SweepRow*>& mine, const std::vector<const SweepRow*>& theirs);
/// Of `design` against `baseline`, in the same profile.
[[nodiscard]] Gain gain(const std::vector<SweepRow>& rows, const std::string& profile,
                        const std::string& design, const std::string& baseline);
/// True if a mission counts: it reached the goal and hit nothing.
[[nodiscard]] bool counts(const MissionResult& result);
/// Mean and interval of value(result) over the missions that count.
[[nodiscard]] Estimate estimate(const std::vector<const SweepRow*>& rows,
                                double (*value)(const MissionResult&));

/// Of a number a seed: their mean, and its interval.
[[nodiscard]] Estimate estimate(const std::vector<double>& of_seeds);
/// "4.52 +-0.10", without the interval if there is none; "-" for NaN.
[[nodiscard]] std::string shown(const Estimate& estimate, int digits);
/// A table of gains: its head, and a row. At most 110 columns.
[[nodiscard]] std::string gain_head();
[[nodiscard]] std::string gain_row(const std::string& what, const Gain& gain);

/// The table that a person reads at the end of `roborun sweep`: one row per design, published values below,
/// gains, and every mission that did not reach the goal. Plain ASCII, at most 110 columns.
[[nodiscard]] std::string sweep_table(const std::vector<SweepRow>& rows);
/// One JSON object on one line; `designs` holds the designs of the first profile, `profiles` those of all.
/// Numbers that are not finite become null.
[[nodiscard]] std::string sweep_json(const std::string& suite, const std::vector<SweepRow>& rows,
                                     bool complete);

}  // namespace roborun::report
