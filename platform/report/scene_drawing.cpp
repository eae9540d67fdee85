#include "platform/report/scene_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace roborun::report {
namespace {

double nice_step(double span) {
  const double raw = span / 8.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw) return factor * power;
  }
  return 10.0 * power;
}

/// 0 .. 1 in 24 steps, so that neighbouring points share a colour and a polyline. Speed is that of the path,
/// everything else that of the decision before.
int colour_step(const MissionReport& mission, const PathPoint& point, const Quantity& q) {
  double value = q.value == nullptr ? point.speed_mps : 0.0;
  for (const DecisionRecord& d : mission.decisions) {
    if (q.value == nullptr || d.time_s > point.time_s) break;
    value = q.value(d);
  }
  return static_cast<int>(std::lround(24.0 * q.ratio(std::isfinite(value) ? value : q.high)));
}

}  // namespace

std::string finding_of(std::span<const MissionReport> missions) {
  std::string finding;
  for (const MissionReport& m : missions) {
    finding += fmt::format("{}{} {} in {:.0f} s", finding.empty() ? "" : ", ", m.result.design,
                           outcome(m.result), m.result.mission_time_s);
  }
  return finding;
}

void draw_titles(Svg& svg, const std::string& finding, const Scene& scene, double left) {
  svg.text(left, 26, finding, "start", finding.size() < 90 ? 15 : 12, kInk, "bold");
  svg.text(left, 44, scene.title, "start", 12, kSoft);
}

void draw_world(Svg& svg, const Scene& scene, const Frame& f, double height,
                const std::function<void()>& below) {
  const Vector3 size = scene.bounds_W.size();
  svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" stroke="#cbd2d9"/>)",
          f.left, f.top, size.x() * f.scale, height, scene.background);
  if (below) below();
  const double cell = scene.heat_cell_m * f.scale;
  for (int k = 0; k < scene.heat_rows; ++k) {
    for (int i = 0; i < scene.heat_columns; ++i) {
      const double ratio =
          scene.heat_ratio[static_cast<std::size_t>(k) * static_cast<std::size_t>(scene.heat_columns) +
                           static_cast<std::size_t>(i)];
      if (ratio < 0.02) continue;
      const double x = f.x(scene.bounds_W.min_W.x() + i * scene.heat_cell_m);
      const double y = f.y(scene.bounds_W.min_W.y() + (k + 1) * scene.heat_cell_m);
      svg.add(
          R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="#c0392b" fill-opacity="{:.2f}"/>)",
          x, y, std::min(cell, f.x(scene.bounds_W.max_W.x()) - x), std::min(cell, cell),
          0.04 + 0.5 * std::min(ratio, 0.6));
    }
  }
  for (const Scene::Rect& r : scene.rects) {
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.2f}" height="{:.2f}" fill="#3e4c59"/>)", f.x(r.x_m),
            f.y(r.y_m + r.height_m), r.width_m * f.scale, r.height_m * f.scale);
  }
  for (const Scene::Circle& c : scene.circles) {
    svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.2f}" fill="#3e4c59"/>)", f.x(c.x_m), f.y(c.y_m),
            std::max(c.radius_m * f.scale, 0.8));
  }
  for (const auto& outline : scene.outlines) {
    std::string points;
    for (const auto& [x_m, y_m] : outline) points += fmt::format("{:.2f},{:.2f} ", f.x(x_m), f.y(y_m));
    svg.add(R"(<polygon points="{}" fill="#3e4c59" stroke="#3e4c59" stroke-width="0.8"/>)", points);
  }
  const std::array<const char*, 3> zone{"A", "B", "C"};
  std::vector<double> borders{scene.bounds_W.min_W.x()};
  borders.insert(borders.end(), scene.zone_borders_m.begin(), scene.zone_borders_m.end());
  borders.push_back(scene.bounds_W.max_W.x());
  for (std::size_t i = 1; i + 1 < borders.size(); ++i) {
    svg.add(
        R"(<line x1="{0:.1f}" x2="{0:.1f}" y1="{1:.1f}" y2="{2:.1f}" stroke="{3}" stroke-dasharray="6 5"/>)",
        f.x(borders[i]), f.top, f.top + height, kSoft);
  }
  for (std::size_t i = 0; borders.size() == 4 && i < 3; ++i) {
    svg.text(f.x(0.5 * (borders[i] + borders[i + 1])), f.top + 18, fmt::format("zone {}", zone[i]), "middle",
             13, kSoft);
  }
  const double step = nice_step(size.x());
  for (double x_m = std::ceil(scene.bounds_W.min_W.x() / step) * step; x_m <= scene.bounds_W.max_W.x();
       x_m += step) {
    svg.add(R"(<line x1="{0:.1f}" x2="{0:.1f}" y1="{1:.1f}" y2="{2:.1f}" stroke="{3}"/>)", f.x(x_m),
            f.top + height, f.top + height + 4, kSoft);
    svg.text(f.x(x_m), f.top + height + 17, fmt::format("{:g} m", x_m + 0.0), "middle", 11, kSoft);
  }
  for (double y_m = std::ceil(scene.bounds_W.min_W.y() / 50.0) * 50.0; y_m <= scene.bounds_W.max_W.y();
       y_m += 50.0) {
    svg.text(f.left - 8, f.y(y_m) + 4, fmt::format("{:g} m", y_m + 0.0), "end", 11, kSoft);
  }
}

Quantity quantity(PathColour colour, std::span<const MissionReport> missions) {
  const auto most = [missions](double least, double (*value)(const DecisionRecord&)) {
    double high = least;
    for (const MissionReport& m : missions) {
      for (const DecisionRecord& d : m.decisions)
        high = std::isfinite(value(d)) ? std::max(high, value(d)) : high;
    }
    return high;
  };
  const auto volume = [](const DecisionRecord& d) { return 1e-3 * d.v0_m3; };
  const auto latency = [](const DecisionRecord& d) { return d.latency_s; };
  const auto visible = [](const DecisionRecord& d) { return d.visible_m; };
  const auto deadline = [](const DecisionRecord& d) { return d.deadline_s; };
  double top_mps = 1.0;
  for (const MissionReport& m : missions) top_mps = std::max(top_mps, std::ceil(m.result.max_velocity_mps));
  switch (colour) {
    case PathColour::kSpeed:
      break;
    case PathColour::kPrecision:
      return {"precision p0, m", true, 0.3, 9.6, 5, [](const DecisionRecord& d) { return d.p0_m; }};
    case PathColour::kVolume:
      return {"map volume, 1000 m3", false, 0.0, std::ceil(most(1.0, volume)), 4, volume};
    case PathColour::kLatency:
      return {"latency, s", true, 0.1, most(1.0, latency), 4, latency};
    case PathColour::kVisibility:
      return {"visibility, m", false, 0.0, std::ceil(most(1.0, visible)), 4, visible};
    case PathColour::kDeadline:
      return {"deadline, s", true, 0.1, most(1.0, deadline), 4, deadline};
  }
  return {"speed, m/s", false, 0.0, top_mps, 4, nullptr};
}

void draw_path(Svg& svg, const MissionReport& mission, const Frame& f, const Quantity& quantity) {
  std::string points;
  int step = -1;
  const auto flush = [&] {
    if (!points.empty())
      svg.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="2.6" stroke-linejoin="round"/>)",
              points, ramp_colour(step / 24.0));
    points.clear();
  };
  Vector3 last_W = Vector3::Constant(1e9);
  for (const PathPoint& p : mission.path) {
    if ((p.p_WB - last_W).head<2>().norm() * f.scale < 2.0) continue;
    const std::string here = fmt::format("{:.1f},{:.1f} ", f.x(p.p_WB.x()), f.y(p.p_WB.y()));
    const int next = colour_step(mission, p, quantity);
    if (next != step) {
      points += here;  // the segments meet
      flush();
      step = next;
    }
    points += here;
    last_W = p.p_WB;
  }
  flush();
}

void draw_legend(Svg& svg, const Quantity& q, double right, double y) {
  const double width = 240.0;
  const double left = right - width;
  for (int i = 0; i <= 24; ++i) {
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="10" fill="{}"/>)", left + i * width / 25.0,
            y, width / 25.0 + 0.5, ramp_colour(i / 24.0));
  }
  svg.text(left - 8, y + 10, "path: " + q.label, "end", 12, kInk);
  for (int i = 0; i <= q.parts; ++i) {
    const double ratio = static_cast<double>(i) / q.parts;
    svg.text(left + ratio * width, y + 23, fmt::format("{:.3g}", q.at(ratio)), "middle", 11, kSoft);
  }
}

void draw_ends(Svg& svg, const Scene& scene, const Frame& f) {
  svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="6" fill="#ffffff" stroke="{}" stroke-width="2.5"/>)",
          f.x(scene.start_W.x()), f.y(scene.start_W.y()), kInk);
  svg.add(
      R"(<path d="M {0:.1f} {1:.1f} l 0 -18 l 13 5 l -13 5" fill="#e12d39" stroke="{2}" stroke-width="1.5"/>)",
      f.x(scene.goal_W.x()), f.y(scene.goal_W.y()), kInk);
}

const char* outcome(const MissionResult& r) {
  return r.reason == "reached_goal" ? "reached the goal" : r.reason.c_str();
}

}  // namespace roborun::report
