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
  std::string scenario;
  std::string port;
};

/// What flies, where, and what fails.
struct PlantScene {
  mission::MissionConfig mission;
  std::string vehicle;  ///< As `run` is told of it.
  sitl::World world;
};

/// Adds --vehicle, --env, --world and what goes with it, --seed, --scenario and --port. `arguments` must outlive the command.
void add_plant_arguments(CLI::App& command, PlantArguments& arguments);
/// Throws InputError that names the option.
[[nodiscard]] PlantScene plant_scene(const PlantArguments& arguments);

}  // namespace roborun::app
