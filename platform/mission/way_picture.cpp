#include "platform/mission/way_picture.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "platform/report/svg.hpp"

namespace roborun::mission {
namespace {

constexpr double kMargin_px = 20.0, kHead_px = 64.0, kCaption_px = 24.0;
constexpr double kWide_px = report::kPictureWidth - 2.0 * kMargin_px;
constexpr const char* kSolid = "#444";
constexpr const char* kTooNear = "#d4d4d4";
constexpr const char* kOpen = "#fff";  // on dark screens, too
constexpr const char* kWayColour = "#0072b2";
constexpr const char* kWidestColour = "#e69f00";
constexpr const char* kStartColour = "#009e73";
constexpr const char* kGoalColour = "#d55e00";

/// One cut through a world, from above.
class Cut {
 public:
  Cut(const sitl::World& world, double z_m, double top_px) : world_(world), z_m_(z_m), top_px_(top_px) {}

  [[nodiscard]] static double px_per_m(const sitl::World& world) {
    return kWide_px / world.bounds_W().size().x();
  }
  [[nodiscard]] static double height_px(const sitl::World& world) {
    return kCaption_px + px_per_m(world) * world.bounds_W().size().y();
  }

  void draw(double radius_m, report::Svg& svg) const {
    const Aabb& box = world_.bounds_W();
    svg.text(kMargin_px, top_px_ + 16.0,
             fmt::format("z = {:.2f} m; x {:g} to {:g} m to the right, y {:g} to {:g} m up", z_m_,
                         box.min_W.x(), box.max_W.x(), box.min_W.y(), box.max_W.y()));
    svg.add(R"(<rect x="{}" y="{:.1f}" width="{}" height="{:.1f}" fill="{}" stroke="{}"/>)", kMargin_px,
            top_px_ + kCaption_px, kWide_px, height_px(world_) - kCaption_px, kOpen, report::kSoft);
    const double cell_m = std::max(1.0 / px_per_m(world_), 0.02);
    const int columns = std::max(static_cast<int>(box.size().x() / cell_m), 1);
    const int rows = std::max(static_cast<int>(box.size().y() / cell_m), 1);
    // Runs of one colour in a row are one rectangle.
    for (int row = 0; row < rows; ++row) {
      int from = 0;
      for (int column = 1; column <= columns; ++column) {
        const std::string_view colour = colour_of(from, row, cell_m, radius_m);
        if (column < columns && colour_of(column, row, cell_m, radius_m) == colour) continue;
        if (!colour.empty()) add_run(from, column, row, cell_m, colour, svg);
        from = column;
      }
    }
  }
  void draw(const std::vector<Vector3>& way_W, const char* style, report::Svg& svg) const {
    if (way_W.empty()) return;
    std::string points;
    for (const Vector3& p_W : way_W) points += fmt::format("{:.1f},{:.1f} ", x_px(p_W.x()), y_px(p_W.y()));
    svg.add(R"(<polyline points="{}" fill="none" {}/>)", points, style);
  }
  void draw(const Vector3& p_W, const char* colour, report::Svg& svg) const {
    svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="5" fill="{}"/>)", x_px(p_W.x()), y_px(p_W.y()), colour);
  }

 private:
  [[nodiscard]] double x_px(double x_m) const {
    return kMargin_px + px_per_m(world_) * (x_m - world_.bounds_W().min_W.x());
  }
  [[nodiscard]] double y_px(double y_m) const {
    return top_px_ + kCaption_px + px_per_m(world_) * (world_.bounds_W().max_W.y() - y_m);
  }
  [[nodiscard]] std::string_view colour_of(int column, int row, double cell_m, double radius_m) const {
    const Vector3& low = world_.bounds_W().min_W;
    const double m = world_.clearance_m(
        {low.x() + (column + 0.5) * cell_m, low.y() + (row + 0.5) * cell_m, z_m_}, radius_m);
    return m < 0.5 * cell_m ? kSolid : m < radius_m ? kTooNear : "";
  }
  void add_run(int from, int to, int row, double cell_m, std::string_view colour, report::Svg& svg) const {
    const Vector3& low = world_.bounds_W().min_W;
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}"/>)",
            x_px(low.x() + from * cell_m), y_px(low.y() + (row + 1) * cell_m),
            px_per_m(world_) * cell_m * (to - from), px_per_m(world_) * cell_m, colour);
  }

  const sitl::World& world_;
  double z_m_, top_px_;
};

void draw_legend(report::Svg& svg) {
  constexpr double kY_px = 50.0;
  double x_px = kMargin_px;
  const auto entry = [&](const char* colour, const char* what, double width_px) {
    svg.add(R"(<rect x="{}" y="{}" width="12" height="12" fill="{}"/>)", x_px, kY_px - 11.0, colour);
    svg.text(x_px + 18.0, kY_px, what);
    x_px += width_px;
  };
  entry(kSolid, "solid", 75.0);
  entry(kTooNear, "too near for its radius", 175.0);
  entry(kWayColour, "shortest way", 120.0);
  entry(kWidestColour, "widest way", 110.0);
  entry(kStartColour, "start", 70.0);
  entry(kGoalColour, "goal", 70.0);
}

}  // namespace

std::string way_svg(const sitl::World& world, double radius_m, const sitl::WayVerdict& verdict,
                    const std::string& name) {
  std::vector<double> heights_m{world.start_W().z()};
  if (std::fabs(world.goal_W().z() - heights_m[0]) > radius_m) heights_m.push_back(world.goal_W().z());
  const std::string finding =
      verdict.way ? fmt::format("{}: a way of {:.1f} m, {:.2f} m wide at its narrowest", name,
                                verdict.shortest_m, verdict.narrowest_m)
                  : fmt::format("{}: no way for a radius of {:.2f} m; the widest is {:.2f} m wide", name,
                                radius_m, verdict.narrowest_m);
  report::Svg svg;
  svg.text(kMargin_px, 26.0, finding, "start", 16);
  draw_legend(svg);
  double top_px = kHead_px;
  for (const double z_m : heights_m) {
    const Cut cut(world, z_m, top_px);
    cut.draw(radius_m, svg);
    cut.draw(verdict.widest_W, fmt::format(R"(stroke="{}" stroke-dasharray="5 4")", kWidestColour).c_str(),
             svg);
    cut.draw(verdict.way_W, fmt::format(R"(stroke="{}" stroke-width="2")", kWayColour).c_str(), svg);
    cut.draw(world.start_W(), kStartColour, svg);
    cut.draw(world.goal_W(), kGoalColour, svg);
    top_px += Cut::height_px(world) + kMargin_px;
  }
  return svg.finish(
      top_px, finding,
      "The world from above, cut at the heights of start and goal: obstacles dark, what is too near to "
      "them grey, the shortest way and the widest one.");
}

}  // namespace roborun::mission
