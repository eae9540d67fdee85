/// A mission in a world with dead ends: the way flown, over what the vehicle's map knew when it ended.
#pragma once

#include <span>
#include <string>

#include "platform/report/mission_result.hpp"
#include "platform/report/svg_plot.hpp"

namespace roborun::report {

/// A complete SVG file, 830 points wide, without external resources: a panel per mission, true to scale. Needs
/// MissionReport::known.
[[nodiscard]] std::string known_svg(const Scene& scene, std::span<const MissionReport> missions);

}  // namespace roborun::report
