/// What came of the flights of a suite of worlds: who arrived, how fast, and by how long a way.
#pragma once

#include <string>
#include <vector>

#include "platform/report/mission_result.hpp"

namespace roborun::report {

/// Of the flights of one world, vehicle, profile and design.
struct SuiteSummary {
  std::string world, vehicle, profile, design;
  std::vector<std::uint64_t> seeds;
  int flights{};
  int possible{};  ///< The judge found a way.
  int reached{};   ///< Of the possible ones, without a collision.
  int collided{};
  int no_way{};                ///< Of the impossible ones: ended with that reason.
  double mean_velocity_mps{};  ///< Over those that reached, as the next two; NaN without any.
  double way_ratio{};          ///< Median of the length flown over the shortest.
  double way_ratio_max{};
};

/// Of flights of a suite, whose env is "WORLD/VEHICLE". In the order of first appearance.
[[nodiscard]] std::vector<SuiteSummary> summarise(const std::vector<MissionResult>& flights);
/// Not what it should be: a collision, a goal not reached although there is a way, another end than "no_way" without one.
[[nodiscard]] bool failed(const MissionResult& result);

/// What a person reads at the end of `roborun sweep --suite`: a row per world, vehicle, profile and design, then every flight that
/// failed, with its command. Plain ASCII.
[[nodiscard]] std::string suite_table(const std::vector<MissionResult>& flights);
/// One JSON object on one line: "suite", "complete", "worlds" (the table's rows) and "failed". Numbers that are not finite
/// become null.
[[nodiscard]] std::string suite_json(const std::string& suite, const std::vector<MissionResult>& flights,
                                     bool complete);

}  // namespace roborun::report
