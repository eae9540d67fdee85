/// A mission file as what is flown: places in the world, and what is done at them.
#pragma once

#include "platform/mavlink/mission_file.hpp"
#include "platform/mission/route.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::live {

using mission::check_route;
using mission::Route;
using mission::RouteFlight;
using mission::RouteStep;

/// East, north and up from `origin`; heights over home are heights of the world. Throws InputError "line 4: ...".
[[nodiscard]] Route route_of(const mavlink::MissionFile& file, const sensor_port::EarthPlace& origin);

}  // namespace roborun::live
