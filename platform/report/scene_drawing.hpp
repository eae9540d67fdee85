/// The parts of pictures of missions: a world from above, a path over it, legends.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "platform/report/svg.hpp"
#include "platform/report/svg_plot.hpp"

namespace roborun::report {

/// World metres to picture points.
struct Frame {
  double x0, y0, scale, left, top;
  [[nodiscard]] double x(double x_m) const { return left + (x_m - x0) * scale; }
  [[nodiscard]] double y(double y_m) const { return top + (y0 - y_m) * scale; }
};

/// What a path can be coloured by, and the scale of the colours.
struct Quantity {
  std::string label;
  bool logarithmic;
  double low, high;
  int parts;  ///< Of the legend.
  double (*value)(const DecisionRecord&);

  [[nodiscard]] double ratio(double x) const {
    const double r =
        logarithmic ? std::log(std::max(x, low) / low) / std::log(high / low) : (x - low) / (high - low);
    return std::clamp(r, 0.0, 1.0);
  }
  [[nodiscard]] double at(double r) const {
    return logarithmic ? low * std::pow(high / low, r) : low + r * (high - low);
  }
};

[[nodiscard]] Quantity quantity(PathColour colour, std::span<const MissionReport> missions);

/// What a picture of missions shows first: who arrived, and when.
[[nodiscard]] std::string finding_of(std::span<const MissionReport> missions);
/// The finding, and below it what world and settings these were.
void draw_titles(Svg& svg, const std::string& finding, const Scene& scene, double left);
/// Bounds, congestion, obstacles, zones and axes, `height` points high. `below` (may be empty) draws what lies below the
/// obstacles.
void draw_world(Svg& svg, const Scene& scene, const Frame& f, double height,
                const std::function<void()>& below = {});
void draw_path(Svg& svg, const MissionReport& mission, const Frame& f, const Quantity& quantity);
/// Of the path's colours; its right end is `right`.
void draw_legend(Svg& svg, const Quantity& q, double right, double y);
/// Start and goal.
void draw_ends(Svg& svg, const Scene& scene, const Frame& f);
[[nodiscard]] const char* outcome(const MissionResult& r);

}  // namespace roborun::report
