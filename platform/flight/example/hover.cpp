/// Takes off and hovers: an aircraft of your own under the runtime. Links roborun::flight and nothing else.
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "lift.hpp"
#include "platform/flight/lockstep_flight.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/planning/rrt_star.hpp"

using namespace roborun;

int main() {
  // 1. What the flight depends on. The vehicle is the default one; its numbers stand in core/vehicle_model.hpp.
  flight::FlightConfig config;
  config.bounds_W = {Vector3(-20, -20, 1), Vector3(20, 20, 10)};
  config.goal_W = Vector3(0, 0, 3);
  config.cruise_m = 3.0;  // the height of the first hover

  // 2. All memory, taken once. A map that finds no room in the arena has no bricks: ask before the start.
  stages::BrickMap::Config map_config;
  map_config.bounds_W = flight::map_bounds_W(config);
  map_config.lattice = flight::lattice_of(config);
  const stages::RrtStar::Config planner_config;
  std::vector<std::byte> block(flight::FlightSystem::arena_bytes(config) +
                               stages::BrickMap::arena_bytes(map_config) +
                               stages::RrtStar::arena_bytes(planner_config) + 4096);
  core::Arena arena(block);

  // 3. The parts that may be yours: the aircraft, the map, the planner. This aircraft has no cameras, so no
  //    decision is ever made: the flight lane alone takes off and hovers.
  example::Lift aircraft(config.vehicle);
  stages::BrickMap map(map_config, arena);
  stages::RrtStar planner(planner_config, arena);
  const auto runtime =
      std::make_unique<flight::LockstepFlight>(config, aircraft, std::span<firmware_if::DepthCamera* const>{},
                                               flight::FlightParts{map, planner}, arena);
  if (arena.exhausted()) {
    std::fprintf(stderr, "hover: the arena is too small\n");
    return 1;
  }

  // 4. One call is one minor frame of 2.5 ms: sensors, estimator, failsafe, tracker, motors. On a real aircraft
  //    rt::LaneSet gives each lane its thread (platform/mission/audit_run.cpp); the lanes are the same.
  while (seconds(runtime->now().time_since_epoch()) < 10.0) (void)runtime->step();

  std::printf("hovers at %.2f m after 10 s\n", aircraft.height_m());
  const bool holds = std::fabs(aircraft.height_m() - config.cruise_m) < 0.1 &&
                     runtime->system().pilot().action() == governor::Action::kGoOn;
  return holds ? 0 : 1;
}
