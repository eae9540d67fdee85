#include "toolchain/bench/map_scans.hpp"

#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "core/random/counter_rng.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"

namespace roborun::bench {
namespace {

sitl::World make_world() {
  sitl::WorldDescription description;
  description.bounds_W = {Vector3(-100, -100, 1), Vector3(100, 100, 60)};
  description.start_W = Vector3(0, 0, 5);
  description.goal_W = Vector3(20, 0, 5);
  core::CounterRng rng(14);
  while (description.pillars.size() < 60) {
    const sitl::Pillar pillar{rng.uniform(-45.0, 45.0), rng.uniform(-45.0, 45.0), rng.uniform(0.4, 1.2), 0.0,
                              20.0};
    if (std::fabs(pillar.y_m) > 2.5 + pillar.radius_m) description.pillars.push_back(pillar);
  }
  return sitl::World(std::move(description));
}

Matrix3 attitude(int n) {
  const double yaw = 0.15 + 0.06 * n, pitch = 0.08, roll = -0.05;
  return (Eigen::AngleAxisd(yaw, Vector3::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3::UnitY()) *
          Eigen::AngleAxisd(roll, Vector3::UnitX()))
      .toRotationMatrix();
}

Vector3 ray_C(int u, int v, int pixels) {
  return {1.0, 1.0 - (u + 0.5) * 2.0 / pixels, 1.0 - (v + 0.5) * 2.0 / pixels};
}

}  // namespace

const sitl::World& pillar_world() {
  static const sitl::World world = make_world();
  return world;
}

bool is_solid(const sitl::World& world, const Vector3& p_W) {
  return p_W.z() < 0.0 || world.clearance_m(p_W, 0.01) <= 0.0;
}

Scan::Scan(const sitl::World& world, int n, int pixels, double range_m)
    : p_WB_(n, 0.2, 5.0), range_m_(range_m) {
  const Matrix3 R_WB = attitude(n);
  const auto mounts = sitl::six_camera_mounts();
  for (std::size_t c = 0; c < 6; ++c) {
    stages::PosedDepthFrame posed;
    Matrix3 R_BC;
    for (int i = 0; i < 9; ++i) R_BC(i / 3, i % 3) = mounts[c].R_BC[static_cast<std::size_t>(i)];
    posed.X_WC = {R_WB * R_BC, p_WB_};
    for (int v = 0; v < pixels; ++v) {
      for (int u = 0; u < pixels; ++u) {
        const Vector3 ray = ray_C(u, v, pixels);
        const double length = ray.norm();
        const double hit_m =
            world.hit_distance_m(p_WB_, posed.X_WC.R_RT * (ray / length), range_m * length) / length;
        image_[c].push_back(static_cast<float>(hit_m));
      }
    }
    posed.frame.width = posed.frame.height = static_cast<std::uint16_t>(pixels);
    posed.frame.tan_half_width = posed.frame.tan_half_height = 1.0F;
    posed.frame.range_m = static_cast<float>(range_m);
    posed.frame.depth_m = image_[c];
    frames_.push_back(posed);
  }
}

std::vector<Vector3> Scan::points_W(double cell_m) const {
  std::vector<Vector3> points;
  for (const stages::PosedDepthFrame& posed : frames_) {
    for (int v = 0; v < posed.frame.height; ++v) {
      for (int u = 0; u < posed.frame.width; ++u) {
        const float raw_m = posed.frame.depth_m[static_cast<std::size_t>(v * posed.frame.width + u)];
        const double depth_m =
            raw_m < posed.frame.range_m ? static_cast<double>(raw_m) : 1.05 * std::sqrt(3.0) * range_m_;
        points.push_back(posed.X_WC * (depth_m * ray_C(u, v, posed.frame.width)));
      }
    }
  }
  if (cell_m <= 0.0) return points;
  std::map<std::tuple<double, double, double>, std::pair<Vector3, double>> cells;
  for (const Vector3& p_W : points) {
    const auto [at, fresh] = cells.try_emplace(
        {std::floor(p_W.x() / cell_m), std::floor(p_W.y() / cell_m), std::floor(p_W.z() / cell_m)},
        Vector3(0, 0, 0), 0.0);
    at->second.first += p_W;
    at->second.second += 1.0;
  }
  points.clear();
  for (const auto& [key, mean] : cells) points.emplace_back(mean.first / mean.second);
  return points;
}

}  // namespace roborun::bench
