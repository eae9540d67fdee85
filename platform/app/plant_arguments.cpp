#include "platform/app/plant_arguments.hpp"

#include <utility>

#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/live/link.hpp"
#include "platform/live/plant_faults.hpp"
#include "platform/mission/scenario_file.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::app {

void add_plant_arguments(CLI::App& command, PlantArguments& a) {
  CLI::Option* vehicle = command
                             .add_option("--vehicle", a.vehicle,
                                         "Vehicle: a shipped one (roborun vehicle list), or a vehicle file")
                             ->capture_default_str();
  CLI::Option* env =
      command.add_option("--env", a.env, "Environment: 1 .. 27, or a name")->capture_default_str();
  CLI::Option* world = command.add_option(
      "--world", a.world,
      "World from a file instead: .toml, OctoMap .bt / .ot, SDF .world / .sdf, points .pcd / .ply / "
      ".las, meshes .stl / .obj / .dae");
  world->excludes(env);
  add_world_arguments(command, a.in_file);
  CLI::Option* seed =
      command.add_option("--seed", a.seed, "Seed of world, noise and wind")->capture_default_str();
  command
      .add_option("--scenario", a.scenario,
                  "World, vehicle, weather, bodies and faults of a scenario file instead (roborun scenario)")
      ->excludes(env)
      ->excludes(world)
      ->excludes(vehicle)
      ->excludes(seed);
  command.add_option("--port", a.port, "NAME of the vehicle's ports")->required();
}

PlantScene plant_scene(const PlantArguments& a) {
  live::check_port_name("--port", a.port);
  if (!a.scenario.empty()) {
    mission::Scenario scenario = mission::load_scenario(a.scenario);
    live::check_plant_faults(a.scenario, scenario.config);
    return {scenario.config, scenario.vehicle, mission::world_of(scenario)};
  }
  mission::MissionConfig mission;
  mission::set_vehicle(mission, vehicle::load_vehicle(a.vehicle));
  mission.seed = input::seed_of("--seed", a.seed);
  if (!a.world.empty()) {
    sitl::World world = sitl::load_world(a.world, world_options(a.in_file, mission.flight.vehicle.radius_m));
    return {mission, a.vehicle, std::move(world)};
  }
  if (any_given(a.in_file))
    throw InputError("--start, --goal and the like go with --world FILE: the environments have their own");
  return {mission, a.vehicle,
          sitl::generate(sitl::environment(a.env).knobs, sitl::Mission::kPackageDelivery, mission.seed)};
}

}  // namespace roborun::app
