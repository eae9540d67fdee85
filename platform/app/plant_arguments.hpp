/// What `plant` and `feed plant` have to agree on.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "platform/app/world_arguments.hpp"
#include "platform/mission/mission_config.hpp"

namespace roborun::app {

struct PlantArguments {
  std::string vehicle{"paper"};
  std::string env{"14"};
  std::string world;
  WorldArguments in_file;
  std::string seed{"1"};
  std::string port;
};

/// Adds --vehicle, --env, --world and what goes with it, --seed and --port. `arguments` must outlive the command.
void add_plant_arguments(CLI::App& command, PlantArguments& arguments);
/// The vehicle and the seed. Throw InputError that names the option.
[[nodiscard]] mission::MissionConfig plant_mission(const PlantArguments& arguments);
[[nodiscard]] sitl::World plant_world(const PlantArguments& arguments, const mission::MissionConfig& mission);

}  // namespace roborun::app
