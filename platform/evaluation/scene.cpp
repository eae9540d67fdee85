#include "platform/evaluation/scene.hpp"

#include <algorithm>

namespace roborun::evaluation {

report::Scene scene_of(const sitl::World& world, const std::string& title, double zone_m) {
  report::Scene scene;
  scene.title = title;
  scene.bounds_W = world.bounds_W();
  scene.start_W = world.start_W();
  scene.goal_W = world.goal_W();
  for (const sitl::Pillar& p : world.pillars()) scene.circles.push_back({p.x_m, p.y_m, p.radius_m});
  for (const Aabb& b : world.boxes())
    scene.rects.push_back({b.min_W.x(), b.min_W.y(), b.size().x(), b.size().y()});
  if (zone_m > 0.0) scene.zone_borders_m = {world.start_W().x() + zone_m, world.goal_W().x() - zone_m};
  const sitl::VoxelGrid& voxels = world.voxels();
  if (!voxels.empty()) {
    // Columns with something at flight height, as runs along x.
    const Aabb box = voxels.bounds_W();
    const double step_m = std::max(voxels.cell_m(), box.size().x() / 400.0);
    for (double y_m = box.min_W.y() + 0.5 * step_m; y_m < box.max_W.y(); y_m += step_m) {
      double run_m = 0.0;
      for (double x_m = box.min_W.x() + 0.5 * step_m; x_m < box.max_W.x() + step_m; x_m += step_m) {
        if (voxels.occupied(Vector3(x_m, y_m, world.start_W().z()))) {
          run_m += step_m;
        } else if (run_m > 0.0) {
          scene.rects.push_back({x_m - 0.5 * step_m - run_m, y_m - 0.5 * step_m, run_m, step_m});
          run_m = 0.0;
        }
      }
    }
    return scene;
  }
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

}  // namespace roborun::evaluation
