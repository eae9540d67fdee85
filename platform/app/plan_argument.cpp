#include "platform/app/plan_argument.hpp"

#include <fmt/format.h>

#include "platform/input/input_error.hpp"
#include "platform/live/mission_route.hpp"

namespace roborun::app {

void take_plan(const std::string& path, mission::MissionConfig& config) {
  const mavlink::MissionFile file = mavlink::load_mission(path);
  try {
    const live::Route route =
        live::route_of(file, {file.home.latitude_deg, file.home.longitude_deg, file.home_height_m});
    for (const live::RouteStep& step : route.steps)
      if (step.releases && !config.autopilot)
        throw InputError(
            fmt::format("{}: gripper: goes with --autopilot, the motors have no hook", step.where));
    if (!file.fence.empty() && !config.flight.fence.empty())
      throw InputError("has a fence, and so do the settings: must be one of both");
    if (!file.fence.empty()) config.flight.fence = route.fence;
    config.route = route;
  } catch (const InputError& error) {
    throw InputError(fmt::format("--plan: {}: {}", path, error.what()));
  }
}

}  // namespace roborun::app
