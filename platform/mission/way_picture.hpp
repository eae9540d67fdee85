/// The verdict about a world as a picture.
#pragma once

#include <string>

#include "platform/sitl/judge/way_judge.hpp"

namespace roborun::mission {

/// SVG: the world from above, cut at the heights of start and goal, with what is solid, what is too narrow, and the ways.
[[nodiscard]] std::string way_svg(const sitl::World& world, double radius_m, const sitl::WayVerdict& verdict,
                                  const std::string& name);

}  // namespace roborun::mission
