/// Missions that are refused before they begin.
#pragma once

#include <string>

#include "platform/input/input_error.hpp"
#include "platform/mission/mission.hpp"

namespace roborun::mission {

/// The one line with which the mission is refused; empty if it is not.
[[nodiscard]] inline std::string refusal_of(const sitl::World& world, const MissionConfig& config) {
  try {
    (void)fly_mission(world, config, {});
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace roborun::mission
