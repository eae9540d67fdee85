/// What one knob of the environments does to a design, with everything else held: the environments of a sweep
/// in which only that knob differs. Source: RoboRun, section "Evaluation": sensitivity over 27 environments.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "platform/report/sweep_summary.hpp"

namespace roborun::report {

/// A knob of the 27 environments: its three values, ascending, and how far apart the numbers of two
/// environments are that differ by one step of it.
struct Knob {
  const char* name;
  double (*value)(const SweepRow&);
  double (*printed_ratio)(const Published&);  ///< Of mission times, highest to lowest value.
  std::array<double, 3> values;
  std::size_t stride;
};
inline constexpr std::array<Knob, 3> kKnobs{{{"density",
                                              [](const SweepRow& r) { return r.density_ratio; },
                                              [](const Published& p) { return p.time_ratio_density; },
                                              {0.3, 0.45, 0.6},
                                              9},
                                             {"spread, m",
                                              [](const SweepRow& r) { return r.spread_m; },
                                              [](const Published& p) { return p.time_ratio_spread; },
                                              {40.0, 80.0, 120.0},
                                              3},
                                             {"goal distance, m",
                                              [](const SweepRow& r) { return r.distance_m; },
                                              [](const Published& p) { return p.time_ratio_distance; },
                                              {600.0, 900.0, 1200.0},
                                              1}}};

/// The missions of one design in one profile that tell what a knob does: for each of its values the same
/// seeds and the same other two knobs. A mission counts only if it reached the goal at all three values.
struct Sensitivity {
  std::array<std::vector<const SweepRow*>, 3> at;  ///< In the order of Knob::values; all of one size.
  std::size_t missions{};                          ///< Of the design in the profile, in the whole sweep.
  /// Empty unless nothing can be compared: then the environments that are missing.
  std::string missing;
};

/// Rows of other environments than the 27 are left out. The result points into `rows`.
[[nodiscard]] Sensitivity sensitivity_of(const std::vector<SweepRow>& rows, const std::string& profile,
                                         const std::string& design, const Knob& knob);

}  // namespace roborun::report
