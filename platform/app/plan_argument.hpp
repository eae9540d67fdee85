/// `fly --plan`: a mission file in lockstep, as `run --mission` flies it.
#pragma once

#include <string>

#include "platform/mission/mission_config.hpp"

namespace roborun::app {

/// Its route and its fence. The plan's home is the world's (0, 0, 0); the mission ends over the place of a landing. Throws
/// InputError for a release without an autopilot, and for two fences. After the choice of the autopilot.
void take_plan(const std::string& path, mission::MissionConfig& config);

}  // namespace roborun::app
