/// Flies parts of your own through the shipped simulator: 60 m past two pillars, in virtual time.
#pragma once

#include <cstdio>
#include <exception>

#include "platform/board/board_profile.hpp"
#include "platform/mission/mission.hpp"

namespace example {

/// Prints how the mission ended. Returns 0 if it ended at the goal.
inline int fly(const roborun::board::OwnParts& own) {
  using roborun::Vector3;
  try {
    roborun::sitl::WorldDescription world;
    world.bounds_W = {Vector3(-10, -15, 1.5), Vector3(70, 15, 8)};
    world.start_W = Vector3(0, 0, 4);
    world.goal_W = Vector3(60, 0, 4);
    world.pillars = {{20, 1, 2}, {40, -2, 2}};

    roborun::mission::MissionConfig config;
    // What computing costs in virtual time: the authors' machine, which charges by volume, whatever computes.
    const roborun::board::Profile profile = roborun::board::paper();
    config.flight.costs = profile.costs;
    config.flight.model = profile.model;
    config.own = own;
    const auto result = roborun::mission::fly_mission(roborun::sitl::World(world), config, {}).result;
    std::printf("%s after %.1f s and %.1f m: map %s, planner %s, policy %s\n", result.reason.c_str(),
                result.mission_time_s, result.distance_m, result.map.c_str(), result.planner.c_str(),
                result.design.c_str());
    return result.reached_goal && !result.collided ? 0 : 1;
  } catch (const std::exception& error) {  // roborun::InputError: one line that says what would be right
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}

}  // namespace example
