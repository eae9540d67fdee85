/// Where a simulated flight comes from: world, vehicle and settings by the options that say them; in a log as JSON, so that the
/// flight can be flown once more.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "platform/app/world_arguments.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::app {

struct FlightSource {
  std::string env{"14"};
  std::string mission{"package_delivery"};
  std::string world;  ///< A file, in the place of env and mission.
  WorldArguments in_file;
  std::string vehicle{"paper"};
  std::string settings;
  std::string aim;               ///< In the place of that of the settings; empty: as they say.
  std::string profile{"paper"};  ///< Loaded by the caller.
};

struct PreparedFlight {
  std::unique_ptr<sitl::World> world;
  mission::MissionConfig config;  ///< Vehicle, settings, goals, seed and source.
  std::string env;                ///< As results name it.
  std::string title;
  double zone_m{};                  ///< Of the environment; 0 for a file.
  std::vector<std::string> inputs;  ///< Files that were read.
};

/// Reads all of it. Throws InputError.
[[nodiscard]] PreparedFlight prepare(const FlightSource& source, std::uint64_t seed);

/// The flight of a log, to be flown once more: from the files that it was flown from, with the seed and parts of the
/// log, and the cost profile that it names; `config.log` is left to the caller. Throws InputError, also if the log does not say them.
[[nodiscard]] PreparedFlight prepare_again(const std::string& log);

}  // namespace roborun::app
