#include "platform/mission/scene.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/geometry/math.hpp"

namespace roborun::mission {
namespace {

using Point = std::array<double, 2>;

/// The convex hull, anticlockwise (Andrew's monotone chain).
std::vector<Point> hull(std::vector<Point> points) {
  const auto turns_left = [](const Point& a, const Point& b, const Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0]);
  };
  std::sort(points.begin(), points.end());
  std::vector<Point> around;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = around.size();
    for (const Point& p : points) {
      while (around.size() >= first + 2 && !turns_left(around[around.size() - 2], around.back(), p))
        around.pop_back();
      around.push_back(p);
    }
    around.pop_back();  // where the other side begins
    std::reverse(points.begin(), points.end());
  }
  return around;
}

/// From above.
std::vector<Point> outline_of(const sitl::Turned& turned) {
  constexpr int kSides = 32;  // of the polygon in the place of a circle
  std::vector<Point> points;
  const auto add = [&](double x_m, double y_m, double z_m) {
    const Vector3 p_W = turned.X_WS * Vector3(x_m, y_m, z_m);
    points.push_back({p_W.x(), p_W.y()});
  };
  if (const Aabb* box = std::get_if<Aabb>(&turned.shape_S)) {
    for (int i = 0; i < 8; ++i)
      add((i & 1 ? box->max_W : box->min_W).x(), (i & 2 ? box->max_W : box->min_W).y(),
          (i & 4 ? box->max_W : box->min_W).z());
  } else {
    const auto& pillar = std::get<sitl::Pillar>(turned.shape_S);
    for (int i = 0; i < kSides; ++i) {
      const core::SinCos at = core::sin_cos(2.0 * core::kPi * i / kSides);
      for (const double z_m : {pillar.bottom_m, pillar.top_m})
        add(pillar.x_m + pillar.radius_m * at.cos, pillar.y_m + pillar.radius_m * at.sin, z_m);
    }
  }
  return hull(std::move(points));
}

/// What stands in a box at one height, as runs of squares along x.
template <class Solid>
void add_cut(const Aabb& box, double height_m, double step_m, report::Scene& scene, Solid&& solid) {
  for (double y_m = box.min_W.y() + 0.5 * step_m; y_m < box.max_W.y(); y_m += step_m) {
    double run_m = 0.0;
    for (double x_m = box.min_W.x() + 0.5 * step_m; x_m < box.max_W.x() + step_m; x_m += step_m) {
      if (solid(Vector3(x_m, y_m, height_m))) {
        run_m += step_m;
      } else if (run_m > 0.0) {
        scene.rects.push_back({x_m - 0.5 * step_m - run_m, y_m - 0.5 * step_m, run_m, step_m});
        run_m = 0.0;
      }
    }
  }
}

report::Scene shapes_of(const sitl::World& world) {
  report::Scene scene;
  scene.bounds_W = world.bounds_W();
  scene.start_W = world.start_W();
  scene.goal_W = world.goal_W();
  for (const sitl::Pillar& p : world.pillars()) scene.circles.push_back({p.x_m, p.y_m, p.radius_m});
  for (const Aabb& b : world.boxes())
    scene.rects.push_back({b.min_W.x(), b.min_W.y(), b.size().x(), b.size().y()});
  for (const sitl::Ball& b : world.balls())
    scene.circles.push_back({b.center_W.x(), b.center_W.y(), b.radius_m});
  for (const sitl::Turned& t : world.turned()) scene.outlines.push_back(outline_of(t));
  constexpr double kSquares = 400.0;  // in a row
  const sitl::VoxelGrid& voxels = world.voxels();
  if (!voxels.empty()) {
    const Aabb box = voxels.bounds_W();
    add_cut(box, world.start_W().z(), std::max(voxels.cell_m(), box.size().x() / kSquares), scene,
            [&](const Vector3& p_W) { return voxels.occupied(p_W); });
  }
  if (!world.mesh().empty()) {
    const Aabb& box = scene.bounds_W;
    const double step_m = std::max(box.size().x(), box.size().y()) / kSquares;
    const double reach_m = std::sqrt(0.5) * step_m;  // to the corners: no surface is too thin
    add_cut(box, world.start_W().z(), step_m, scene,
            [&](const Vector3& p_W) { return world.mesh().clearance_m(p_W, reach_m) < reach_m; });
  }
  return scene;
}

}  // namespace

report::Scene scene_of(const sitl::World& world, const std::string& title, double zone_m) {
  report::Scene scene = shapes_of(world);
  scene.title = title;
  if (zone_m > 0.0) scene.zone_borders_m = {world.start_W().x() + zone_m, world.goal_W().x() - zone_m};
  if (!world.voxels().empty() || !world.mesh().empty()) return scene;
  const Vector3 size = scene.bounds_W.size();
  scene.heat_cell_m = std::max(10.0, size.x() / 150.0);
  scene.heat_columns = static_cast<int>(size.x() / scene.heat_cell_m);
  scene.heat_rows = static_cast<int>(size.y() / scene.heat_cell_m);
  for (int k = 0; k < scene.heat_rows; ++k) {
    for (int i = 0; i < scene.heat_columns; ++i) {
      scene.heat_ratio.push_back(
          world.congestion_ratio(scene.bounds_W.min_W.x() + (i + 0.5) * scene.heat_cell_m,
                                 scene.bounds_W.min_W.y() + (k + 0.5) * scene.heat_cell_m));
    }
  }
  return scene;
}

std::string shapes_json(const report::Scene& scene) {
  using Json = nlohmann::ordered_json;
  const auto short_m = [](double x_m) { return std::round(100.0 * x_m) / 100.0; };
  Json circles = Json::array();
  for (const report::Scene::Circle& c : scene.circles)
    circles.push_back({short_m(c.x_m), short_m(c.y_m), short_m(c.radius_m)});
  Json rings = Json::array();
  for (const report::Scene::Rect& r : scene.rects) {
    const double x_m = short_m(r.x_m + r.width_m);
    const double y_m = short_m(r.y_m + r.height_m);
    rings.push_back(
        {{short_m(r.x_m), short_m(r.y_m)}, {x_m, short_m(r.y_m)}, {x_m, y_m}, {short_m(r.x_m), y_m}});
  }
  for (const auto& outline : scene.outlines) {
    Json ring = Json::array();
    for (const Point& p : outline) ring.push_back({short_m(p[0]), short_m(p[1])});
    rings.push_back(std::move(ring));
  }
  return Json{{"height_m", scene.start_W.z()}, {"circles", std::move(circles)}, {"rings", std::move(rings)}}
      .dump();
}

std::string shapes_json(const sitl::World& world) { return shapes_json(shapes_of(world)); }

}  // namespace roborun::mission
