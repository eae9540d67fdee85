/// A world as the pictures draw it.
#pragma once

#include <string>

#include "platform/report/svg_plot.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::evaluation {

/// Pillars, boxes, balls and turned shapes: their outlines from above. Cells and triangles: what there is of them at the
/// height of the start. zone_m: how far the congested ends reach from start and goal; 0 if the world has no zones.
[[nodiscard]] report::Scene scene_of(const sitl::World& world, const std::string& title, double zone_m);

}  // namespace roborun::evaluation
