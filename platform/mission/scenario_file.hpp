/// One flight with faults in a TOML file: world, vehicle, sensors, weather, fence, time line, and what must
/// come of it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "platform/mission/mission.hpp"

namespace roborun::mission {

/// What must come of the flight. What is not there is not asked for; a collision, or the true position
/// outside the fence, fails every scenario that does not name it as its outcome.
struct Expectation {
  std::string outcome;  ///< The reason why the mission ended; empty: any safe one (kSafeOutcomes).
  std::optional<std::string> action;           ///< The last one of the failsafe; "go_on": none was taken.
  std::optional<std::string> condition;        ///< Held when an action was decided.
  std::optional<double> within_s;              ///< From the first fault to the first action.
  std::optional<double> motors_stop_within_s;  ///< From the first fault to the last thrust.
  std::optional<double> touchdown_mps;         ///< At most.
  std::optional<std::string> sensor;           ///< FailsafeRecord::sensor of one of its actions.
  std::optional<double> home_within_m;         ///< Where it ends, over ground.
  std::optional<bool> landing_site_known;
};

/// Ends that the failsafe table has for something that is broken, and arrival.
inline constexpr std::array<const char*, 5> kSafeOutcomes{"reached_goal", "landed", "holding", "terminated",
                                                          "killed"};

struct Scenario {
  std::string name;   ///< The file's name without folder and ending.
  std::string about;  ///< One line.
  std::string world;  ///< Path of a world file, or empty: `environment`.
  std::string environment;
  std::string vehicle{"paper"};    ///< Shipped, or the path of its file.
  std::vector<sitl::Body> bodies;  ///< Besides those of the world.
  MissionConfig config{};
  Expectation expect{};
  std::vector<std::string> files;  ///< Read besides its own: world, vehicle and its patterns.
};

/// Tables [scenario] about, world (relative to this file) or environment, vehicle (shipped, or a file
/// relative to this one), seed, design, answers, cost_factor
/// (of computing, against the paper's machine); those of a
/// settings file (settings_file.hpp); any number of [[fault]] with component, kind, size (sitl::kSizes),
/// instance, phase, at_s, for_s, every_s; [[goal]] position_m, at_s: goals in the place of those not answered yet, those of one instant in order; [[body]] as in a world file (body_reader.hpp); [expect] with the fields above. Throws
/// InputError with file, line, key and what would be right.
[[nodiscard]] Scenario load_scenario(const std::string& path);
/// Whether a TOML file has a table that only scenarios have ([scenario], [expect], [[fault]]). Throws InputError for what
/// cannot be read and for what is no TOML.
[[nodiscard]] bool is_scenario(const std::string& path);
/// Where it is flown, bodies included. Throws InputError for a file that is no world.
[[nodiscard]] sitl::World world_of(const Scenario& scenario);
/// Flies it; its log says whether it passed (verdict.hpp). Throws InputError for a world that cannot be flown.
[[nodiscard]] report::MissionReport fly_scenario(const Scenario& scenario);

}  // namespace roborun::mission
