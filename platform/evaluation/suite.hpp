/// Suites of worlds in which arriving is measured. `hard`: worlds made from the mission's seed. `foreign`: files that others
/// made and that lie in a folder, flown by a vehicle of their authors' size; the seed chooses the pair of start and goal.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "platform/sitl/world/world.hpp"

namespace roborun::evaluation {

/// Free space around the vehicle that a way must have for a problem to count as possible.
inline constexpr double kJudgeMargin_m = 0.2;

[[nodiscard]] bool is_suite(const std::string& name);
/// Its worlds, or those of `only` (its order; names that nobody knows throw InputError), each as "WORLD/VEHICLE" with every
/// vehicle; without any with those of the suite: `paper` and `micro-six`, or that of the world's authors.
[[nodiscard]] std::vector<std::string> suite_environments(const std::string& suite,
                                                          const std::vector<std::string>& only,
                                                          const std::vector<std::string>& vehicles);
/// The two parts of an environment.
[[nodiscard]] std::string world_of_environment(const std::string& environment);
[[nodiscard]] std::string vehicle_of_environment(const std::string& environment);

/// Files in `folder` that these environments are read from. Throws InputError for one that is not there.
[[nodiscard]] std::vector<std::string> suite_files(const std::string& suite, const std::string& folder,
                                                   const std::vector<std::string>& environments);

/// In the commands of `foreign`, the folder of the files.
inline constexpr const char* kFolderMark = "WORLDS/";

/// A world, and how a person flies in it again.
struct SuiteProblem {
  /// Throws InputError for a file that is no world, and for a start or goal inside of an obstacle.
  std::function<sitl::World()> world;
  std::string make;  ///< A command that is needed before, or empty.
  std::string fly;   ///< Arguments of `roborun fly` that name the world.
};
/// Precondition: an environment of the suite, and the files are there. Throws InputError for start/goal pairs that are none.
[[nodiscard]] SuiteProblem suite_problem(const std::string& suite, const std::string& folder,
                                         const std::string& environment, std::uint64_t seed, double radius_m);

/// Asks the judge for a way of the vehicle's radius and kJudgeMargin_m. Its length, from the ground up to the start and on to
/// the goal; NaN without a way.
[[nodiscard]] double judged_way_m(const sitl::World& world, double radius_m);

}  // namespace roborun::evaluation
