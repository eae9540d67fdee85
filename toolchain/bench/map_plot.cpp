#include "toolchain/bench/map_plot.hpp"

#include <algorithm>
#include <cmath>

#include "platform/report/svg.hpp"

namespace roborun::bench {
namespace {

using report::kInk;
using report::kSoft;

constexpr double kTop = 60, kHeight = 300, kWidth = 330, kLeft = 60, kRight = 470;

struct Point {
  double x, y;
};

/// A panel with logarithmic axes.
class Panel {
 public:
  Panel(report::Svg& svg, double left, Point low, Point high) : svg_(svg), left_(left), low_(low), high_(high) {
    svg.add(R"(<rect x="{}" y="{}" width="{}" height="{}" fill="none" stroke="{}"/>)", left, kTop, kWidth, kHeight, kSoft);
  }
  [[nodiscard]] double x(double value) const { return left_ + kWidth * std::log(value / low_.x) / std::log(high_.x / low_.x); }
  [[nodiscard]] double y(double value) const {
    return kTop + kHeight * (1.0 - std::log(value / low_.y) / std::log(high_.y / low_.y));
  }
  void tick_x(double value) const {
    svg_.add(R"(<line x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}" stroke="{3}"/>)", x(value), kTop, kTop + kHeight, report::kGrid);
    svg_.text(x(value), kTop + kHeight + 16, fmt::format("{:g}", value), "middle", 11);
  }
  void tick_y(double value) const {
    svg_.add(R"(<line x1="{1}" x2="{2}" y1="{0:.1f}" y2="{0:.1f}" stroke="{3}"/>)", y(value), left_, left_ + kWidth, report::kGrid);
    svg_.text(left_ - 6, y(value) + 4, fmt::format("{:g}", value), "end", 11);
  }
  void line(const std::vector<Point>& points, const std::string& colour, bool dashed, const std::string& name,
            bool at_start) const {
    std::string path;
    for (const Point& p : points) path += fmt::format("{:.1f},{:.1f} ", x(p.x), y(p.y));
    svg_.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="2"{}/>)", path, colour,
             dashed ? R"( stroke-dasharray="6 4")" : "");
    for (const Point& p : points) svg_.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="3" fill="{}"/>)", x(p.x), y(p.y), colour);
    const Point& named = at_start ? points.front() : points.back();
    svg_.text(x(named.x) + (at_start ? 10 : 6), y(named.y) - (at_start ? 4 : 8), name, at_start ? "start" : "end", 11,
              colour.c_str());
  }

 private:
  report::Svg& svg_;
  double left_;
  Point low_, high_;
};

}  // namespace

std::string map_cost_svg(const std::vector<CostAtPrecision>& precision, const std::vector<CostOfSpace>& space) {
  report::Svg svg;
  svg.text(kLeft, 24, "What a scan costs: six images of 128 x 128 among pillars", "start", 15, kInk, "bold");
  svg.text(kLeft, 48, "ms a scan, over p0 in m: own solid, stock's best combination dashed", "start", 12);
  double least = 1e9, most = 0;
  for (const CostAtPrecision& c : precision) {
    least = std::min({least, c.own_ms, c.stock_ms});
    most = std::max({most, c.own_ms, c.stock_ms});
  }
  const Panel left(svg, kLeft, {0.25, 0.7 * least}, {12, 1.5 * most});
  for (const double p0_m : {0.3, 0.6, 1.2, 2.4, 4.8, 9.6}) left.tick_x(p0_m);
  for (double ms = 0.01; ms < 1e5; ms *= 10)
    if (ms > 0.7 * least && ms < 1.5 * most) left.tick_y(ms);
  for (const int range_m : {20, 40}) {
    std::vector<Point> own, stock;
    for (const CostAtPrecision& c : precision) {
      if (c.range_m != range_m) continue;
      own.push_back({c.p0_m, c.own_ms});
      stock.push_back({c.p0_m, c.stock_ms});
    }
    const std::string colour = report::ramp_colour(range_m == 20 ? 0.6 : 0.2);
    if (!own.empty()) left.line(own, colour, false, fmt::format("own, {} m", range_m), true);
    if (!stock.empty()) left.line(stock, colour, true, fmt::format("stock, {} m", range_m), true);
  }
  svg.text(kRight, 48, "own time over volume and surface, 10 to 40 m; 10 m is 1", "start", 12);
  double furthest = 2, highest = 2;
  std::vector<Point> volume, surface;
  for (const CostOfSpace& c : space) {
    const double time = c.own_ms / space.front().own_ms;
    volume.push_back({c.known_m3 / space.front().known_m3, time});
    surface.push_back({c.surface_cells / space.front().surface_cells, time});
    furthest = std::max({furthest, volume.back().x, surface.back().x});
    highest = std::max(highest, time);
  }
  const Panel right(svg, kRight, {0.8, 0.8}, {1.3 * furthest, 1.5 * highest});
  for (double v = 1; v < 1e4; v *= v == 1 || std::fmod(std::log10(v), 1.0) < 0.1 ? 3 : 10.0 / 3.0) {
    if (v < 1.3 * furthest) right.tick_x(std::round(v));
    if (v < 1.5 * highest) right.tick_y(std::round(v));
  }
  if (!space.empty()) {
    right.line(volume, report::ramp_colour(0.2), false, "volume", false);
    right.line(surface, report::ramp_colour(0.75), false, "surface", false);
  }
  return svg.finish(400, "What a scan costs: six images of 128 x 128 among pillars",
                    "Left: milliseconds a scan over the precision, own map and stock's best combination, for 20 and 40 m of range. "
                    "Right: time of the own map over known volume and over surface, from 10 to 40 m.");
}

}  // namespace roborun::bench
