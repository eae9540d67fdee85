#include "platform/report/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "platform/report/scene_drawing.hpp"

namespace roborun::report {
namespace {

constexpr double kLeft = 60.0;
constexpr double kRight = 20.0;
constexpr double kChartHeight = 90.0;
constexpr double kMaxPanel = 330.0;
constexpr double kZoomHeight = 240.0;
constexpr std::array<const char*, 4> kDesignColour{"#0072b2", "#d55e00", "#009e73",
                                                   "#cc79a7"};  // Okabe and Ito

struct Series {
  std::string label;
  double top;
  bool logarithmic;
  double (*value)(const DecisionRecord&);
};

void draw_chart(Svg& svg, std::span<const MissionReport> missions, const Series& series, const Frame& f,
                double right, double top) {
  const double left = f.left;
  svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" stroke="#cbd2d9"/>)", left,
          top, right - left, kChartHeight, kPaper);
  svg.text(left, top - 6, series.label, "start", 12, kInk, "bold");
  constexpr double kLow = 0.1;
  const auto y_of = [&](double value) {
    const double ratio = series.logarithmic
                             ? std::log10(std::max(value, kLow) / kLow) / std::log10(series.top / kLow)
                             : value / series.top;
    return top + kChartHeight * (1.0 - std::clamp(ratio, 0.0, 1.0));
  };
  if (series.logarithmic) {
    for (double tick = kLow; tick <= series.top * 1.001; tick *= 10.0) {
      svg.add(R"(<line x1="{0:.1f}" x2="{1:.1f}" y1="{2:.1f}" y2="{2:.1f}" stroke="{3}"/>)", left, right,
              y_of(tick), kGrid);
      svg.text(left - 6, y_of(tick) + 4, fmt::format("{:g}", tick), "end", 11, kSoft);
    }
  } else {
    for (const double tick : {0.0, 0.5 * series.top, series.top}) {
      svg.add(R"(<line x1="{0:.1f}" x2="{1:.1f}" y1="{2:.1f}" y2="{2:.1f}" stroke="{3}"/>)", left, right,
              y_of(tick), kGrid);
      svg.text(left - 6, y_of(tick) + 4, fmt::format("{:g}", tick), "end", 11, kSoft);
    }
  }
  for (std::size_t m = 0; m < missions.size(); ++m) {
    std::string points;
    for (const DecisionRecord& d : missions[m].decisions) {
      fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ", std::clamp(f.x(d.p_WB.x()), left, right),
                     y_of(series.value(d)));
    }
    svg.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="1.3" stroke-opacity="0.85"/>)",
            points, kDesignColour[m % kDesignColour.size()]);
  }
}

/// What lies between two x of the world, and of a flight's path through it.
Scene part_of(const Scene& scene, double low_m, double high_m) {
  Scene part = scene;
  std::erase_if(part.circles, [&](const Scene::Circle& c) {
    return c.x_m + c.radius_m < low_m || c.x_m - c.radius_m > high_m;
  });
  std::erase_if(part.rects,
                [&](const Scene::Rect& r) { return r.x_m + r.width_m < low_m || r.x_m > high_m; });
  part.zone_borders_m.clear();
  part.heat_rows = 0;
  return part;
}

/// The congested ends, larger, with the path of one flight, from `top` on. Returns how much height that takes.
double draw_zooms(Svg& svg, const Scene& scene, const MissionReport& mission, const Quantity& coloured,
                  double top) {
  if (scene.zone_borders_m.size() != 2) return 0.0;
  const double half = 0.5 * (kPictureWidth - kLeft - kRight - 20.0);
  double left = kLeft;
  double tallest = 0.0;
  for (const auto& [name, low_m, high_m] :
       {std::tuple{"A", scene.bounds_W.min_W.x(), scene.zone_borders_m.front()},
        std::tuple{"C", scene.zone_borders_m.back(), scene.bounds_W.max_W.x()}}) {
    MissionReport inside = mission;
    // Named again: Clang 14 captures no structured bindings.
    const auto is_outside = [from_m = low_m, to_m = high_m](const PathPoint& p) {
      return p.p_WB.x() < from_m || p.p_WB.x() > to_m;
    };
    std::erase_if(inside.path, is_outside);
    double low_y_m = scene.start_W.y();
    double high_y_m = scene.start_W.y();
    for (const PathPoint& p : inside.path) {
      low_y_m = std::min(low_y_m, p.p_WB.y());
      high_y_m = std::max(high_y_m, p.p_WB.y());
    }
    constexpr double kBeside_m = 25.0;
    low_y_m = std::max(low_y_m - kBeside_m, scene.bounds_W.min_W.y());
    high_y_m = std::min(high_y_m + kBeside_m, scene.bounds_W.max_W.y());
    const double scale = std::min(half / (high_m - low_m), kZoomHeight / (high_y_m - low_y_m));
    const double width = (high_m - low_m) * scale;
    const double height = (high_y_m - low_y_m) * scale;
    svg.text(left, top,
             fmt::format("zone {} with {}: {:.0f} m x {:.0f} m", name, mission.result.design, high_m - low_m,
                         high_y_m - low_y_m));
    svg.add(R"(<svg x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}">)", left, top + 8.0, width, height);
    const Frame f{low_m, high_y_m, scale, 0.0, 0.0};
    draw_world(svg, part_of(scene, low_m, high_m), f, height);
    draw_path(svg, inside, f, coloured);
    draw_ends(svg, scene, f);
    svg.add("</svg>");
    left += half + 20.0;
    tallest = std::max(tallest, height);
  }
  return tallest + 44.0;
}

}  // namespace

std::string mission_svg(const Scene& scene, std::span<const MissionReport> missions, PathColour colour) {
  Svg svg;
  const Vector3 size = scene.bounds_W.size();
  const double scale = std::min((kPictureWidth - kLeft - kRight) / size.x(), kMaxPanel / size.y());
  const double panel = size.y() * scale;
  const double right = kLeft + size.x() * scale;
  double top_mps = 1.0;
  for (const MissionReport& m : missions) top_mps = std::max(top_mps, std::ceil(m.result.max_velocity_mps));

  const std::string finding = finding_of(missions);
  draw_titles(svg, finding, scene, kLeft);
  const Quantity coloured = quantity(colour, missions);
  draw_legend(svg, coloured, kPictureWidth - kRight, 58);
  double y = 106;
  for (std::size_t i = 0; i < missions.size(); ++i) {
    const MissionResult& r = missions[i].result;
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="12" height="12" rx="2" fill="{}"/>)", kLeft, y - 11,
            kDesignColour[i % kDesignColour.size()]);
    svg.text(kLeft + 18, y, r.design, "start", 15, kInk, "bold");
    svg.text(
        kLeft + 110, y,
        fmt::format("{} in {:.0f} s, mean {:.2f} m/s, {:.0f} kJ, {} decisions of {:.2f} s median, {} late",
                    outcome(r), r.mission_time_s, r.mean_velocity_mps, r.energy_kJ, r.decisions,
                    r.latency_s.median, r.deadline_misses),
        "start", 13, kInk);
    const Frame f{scene.bounds_W.min_W.x(), scene.bounds_W.max_W.y(), scale, kLeft, y + 10};
    draw_world(svg, scene, f, panel);
    draw_path(svg, missions[i], f, coloured);
    draw_ends(svg, scene, f);
    y += panel + 52;
  }
  if (!missions.empty()) y += draw_zooms(svg, scene, missions.front(), coloured, y);
  const Frame charts{scene.bounds_W.min_W.x(), 0.0, scale, kLeft, 0.0};
  double longest_s = 1.0;
  for (const MissionReport& m : missions) longest_s = std::max(longest_s, m.result.latency_s.max);
  const std::array<Series, 3> series{
      {{"speed at each decision, m/s", top_mps, false, [](const DecisionRecord& d) { return d.speed_mps; }},
       {"latency of each decision, s (logarithmic)", longest_s > 10.0 ? 100.0 : 10.0, true,
        [](const DecisionRecord& d) { return d.latency_s; }},
       {"precision p0, m (logarithmic; lower is finer)", 10.0, true,
        [](const DecisionRecord& d) { return d.p0_m; }}}};
  for (const Series& s : series) {
    draw_chart(svg, missions, s, charts, right, y);
    y += kChartHeight + 34;
  }
  svg.text(kLeft, y - 12,
           "charts: over the way from start to goal, colours as the squares above; dark: "
           "obstacles; red: congestion",
           "start", 12, kSoft);
  return svg.finish(
      y + 4, finding,
      "The world from above with the path of each design, its congested ends larger, and speed, "
      "latency and precision over the way. " +
          scene.title);
}

std::string maps_svg(const Scene& scene, std::span<const MissionReport> missions) {
  Svg svg;
  const std::string finding = finding_of(missions);
  draw_titles(svg, finding, scene, kLeft);
  constexpr double kGap = 60.0;
  const auto columns = static_cast<double>(std::max<std::size_t>(missions.size(), 1));
  const double width = (kPictureWidth - kLeft - kRight - kGap * (columns - 1.0)) / columns;
  const Vector3 size = scene.bounds_W.size();
  const double scale = std::min(width / size.x(), kMaxPanel / size.y());
  const double height = size.y() * scale;
  const auto left = [&](std::size_t i) { return kLeft + (width + kGap) * static_cast<double>(i); };
  for (std::size_t i = 0; i < missions.size(); ++i) {
    const MissionResult& r = missions[i].result;
    svg.text(left(i), 72, fmt::format("{}, mean {:.2f} m/s", r.design, r.mean_velocity_mps), "start", 13,
             kInk, "bold");
  }
  double y = 118.0;
  for (std::size_t k = 0; k < kPathColourName.size(); ++k) {
    const Quantity q = quantity(static_cast<PathColour>(k), missions);
    draw_legend(svg, q, kPictureWidth - kRight, y - 28.0);
    for (std::size_t i = 0; i < missions.size(); ++i) {
      const Frame f{scene.bounds_W.min_W.x(), scene.bounds_W.max_W.y(), scale, left(i), y + 4.0};
      draw_world(svg, scene, f, height);
      draw_path(svg, missions[i], f, q);
      draw_ends(svg, scene, f);
    }
    y += height + 76.0;
  }
  return svg.finish(
      y - 28.0, finding,
      "The same paths from above, coloured in turn by speed, precision, volume, latency, visibility "
      "and deadline. " +
          scene.title);
}

}  // namespace roborun::report
