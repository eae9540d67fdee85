/// A world as the pictures draw it.
#pragma once

#include <string>

#include "platform/report/svg_plot.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::mission {

/// Pillars, boxes, balls and turned shapes: their outlines from above. Cells and triangles: what there is of them at the
/// height of the start. zone_m: how far the congested ends reach from start and goal; 0 if the world has no zones.
/// Bodies that move are in no picture.
[[nodiscard]] report::Scene scene_of(const sitl::World& world, const std::string& title, double zone_m);

/// The shapes of a scene as `/world` of a log and the page of a flight have them: {height_m, circles [[x, y, radius]], rings [[[x, y],
/// ...]]}, rounded to centimetres. JSON.
[[nodiscard]] std::string shapes_json(const report::Scene& scene);
/// The same of a world, without the heat map's cost.
[[nodiscard]] std::string shapes_json(const sitl::World& world);

}  // namespace roborun::mission
