#include "platform/report/known_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "platform/report/scene_drawing.hpp"

namespace roborun::report {
namespace {

constexpr double kPictureLeft = 50.0;
constexpr double kPictureRight = 20.0;
constexpr double kPictureMaxPanel = 700.0;
constexpr double kStep_s = 0.5;
constexpr double kTimesReal = 10.0;
constexpr const char* kUnseen = "#d3d6da";
constexpr const char* kFree = "#e8f3ff";
constexpr const char* kSeen = "#d55e00";  // Okabe and Ito

/// Runs of equal cells in a row are one rectangle.
void draw_known(Svg& svg, const KnownSlice& known, const Aabb& bounds_W, const Frame& f) {
  const auto rect = [&](double x_m, double y_m, double width_m, const char* fill) {
    const double low_x_m = std::max(x_m, bounds_W.min_W.x());
    const double high_x_m = std::min(x_m + width_m, bounds_W.max_W.x());
    const double low_y_m = std::max(y_m, bounds_W.min_W.y());
    const double high_y_m = std::min(y_m + known.cell_m, bounds_W.max_W.y());
    if (high_x_m <= low_x_m || high_y_m <= low_y_m) return;
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}"/>)", f.x(low_x_m),
            f.y(high_y_m), (high_x_m - low_x_m) * f.scale + 0.2, (high_y_m - low_y_m) * f.scale + 0.2, fill);
  };
  for (int row = 0; row < known.rows; ++row) {
    const auto* cell = known.cell.data() + static_cast<std::ptrdiff_t>(row) * known.columns;
    for (int begin = 0, end = 0; begin < known.columns; begin = end) {
      while (end < known.columns && cell[end] == cell[begin]) ++end;
      if (cell[begin] == KnownSlice::Cell::kUnknown) continue;
      rect(known.x_m + begin * known.cell_m, known.y_m + row * known.cell_m, (end - begin) * known.cell_m,
           cell[begin] == KnownSlice::Cell::kFree ? kFree : kSeen);
    }
  }
}

/// The vehicle on its way, `kTimesReal` as fast, over and over. Points of equal times: what lies between them is interpolated.
void draw_vehicle(Svg& svg, const MissionReport& mission, const Frame& f) {
  std::string x, y;
  double next_s = 0.0;
  int steps = -1;
  for (const PathPoint& p : mission.path) {
    if (p.time_s < next_s) continue;
    x += fmt::format("{}{:.0f}", x.empty() ? "" : ";", f.x(p.p_WB.x()));
    y += fmt::format("{}{:.0f}", y.empty() ? "" : ";", f.y(p.p_WB.y()));
    next_s += kStep_s;
    ++steps;
  }
  if (steps < 1) return;
  svg.add(R"(<circle class="vehicle" r="7" fill="#e12d39" stroke="#ffffff" stroke-width="2">)");
  for (const auto& [axis, values] : {std::pair{"cx", &x}, std::pair{"cy", &y}}) {
    svg.add(R"(<animate attributeName="{}" values="{}" dur="{:.1f}s" repeatCount="indefinite"/>)", axis,
            *values, steps * kStep_s / kTimesReal);
  }
  svg.add("</circle>");
}

struct Key {
  const char* fill;
  const char* text;
  double width;
};

}  // namespace

std::string known_svg(const Scene& scene, std::span<const MissionReport> missions) {
  Svg svg;
  Scene plain = scene;
  plain.heat_rows = 0;
  plain.zone_borders_m.clear();
  plain.background = kUnseen;
  const Vector3 size = scene.bounds_W.size();
  const double scale =
      std::min((kPictureWidth - kPictureLeft - kPictureRight) / size.x(), kPictureMaxPanel / size.y());
  const double panel = size.y() * scale;
  const std::string finding = finding_of(missions);
  draw_titles(svg, finding, scene, kPictureLeft);
  const Quantity coloured = quantity(PathColour::kSpeed, missions);
  draw_legend(svg, coloured, kPictureWidth - kPictureRight, 54);
  constexpr std::array<Key, 4> kKeys{{{kFree, "known to be free", 140},
                                      {kSeen, "known to be occupied", 170},
                                      {kUnseen, "not known", 95},
                                      {"#3e4c59", "obstacle (the truth)", 0}}};
  double x = kPictureLeft;
  for (const Key& key : kKeys) {
    svg.add(R"(<rect x="{:.1f}" y="94" width="13" height="13" fill="{}" stroke="{}" stroke-width="0.5"/>)", x,
            key.fill, kSoft);
    svg.text(x + 19, 105, key.text, "start", 13);
    x += key.width + 19;
  }
  svg.add("<style>@media (prefers-reduced-motion) {{ .vehicle {{ display: none }} }}</style>");
  double y = 134;
  for (const MissionReport& mission : missions) {
    const MissionResult& r = mission.result;
    svg.text(kPictureLeft, y,
             fmt::format("{}: {} in {:.0f} s, {:.0f} m flown, mean {:.2f} m/s; the map is cut {:g} m high",
                         r.design, outcome(r), r.mission_time_s, r.distance_m, r.mean_velocity_mps,
                         mission.known.height_m),
             "start", 13);
    const Frame f{scene.bounds_W.min_W.x(), scene.bounds_W.max_W.y(), scale, kPictureLeft, y + 10};
    draw_world(svg, plain, f, panel, [&] { draw_known(svg, mission.known, scene.bounds_W, f); });
    draw_path(svg, mission, f, coloured);
    draw_ends(svg, scene, f);
    draw_vehicle(svg, mission, f);
    y += panel + 56;
  }
  return svg.finish(
      y - 20, finding,
      "Worlds from above: the way flown, coloured by speed, over what the vehicle's map knew to be "
      "free, knew to be occupied, and did not know when the flight ended. A red dot flies the way at "
      "ten times its speed. " +
          scene.title);
}

}  // namespace roborun::report
