#include "platform/live/obstacle_sectors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/math.hpp"
#include "core/geometry/vector.hpp"

namespace roborun::live {
namespace {

constexpr double kLevel = 0.05;  // rise over run
constexpr float kNone_m = std::numeric_limits<float>::infinity();

/// Of a direction, level (FLU).
std::size_t sector_of(const Vector3& v_L) {
  const double clockwise_deg = -core::atan2(v_L.y(), v_L.x()) / core::kDegree;
  const auto nearest = static_cast<int>(std::lround(clockwise_deg / 5.0));
  constexpr int kCount = ObstacleSectors::kSectors;
  return static_cast<std::size_t>((nearest % kCount + kCount) % kCount);
}

}  // namespace

Matrix3 level_of(double roll_rad, double pitch_rad) {
  const core::SinCos r = core::sin_cos(roll_rad),
                     p = core::sin_cos(-pitch_rad);  // about forward, and about left
  Matrix3 R_LB;
  R_LB << p.cos, p.sin * r.sin, p.sin * r.cos, 0.0, r.cos, -r.sin, -p.sin, p.cos * r.sin, p.cos * r.cos;
  return R_LB;
}

Matrix3 level_of(const std::array<double, 4>& q) {
  const auto [w, x, y, z] = q;
  return level_of(core::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
                  core::asin(std::clamp(2.0 * (w * y - z * x), -1.0, 1.0)));
}

void ObstacleSectors::see(std::size_t camera, const firmware_if::DepthFrame& f,
                          const firmware_if::CameraMount& mount, const Matrix3& R_LB) {
  Camera& c = camera_.at(camera);
  c.stamp = f.stamp;
  c.range_min_m = static_cast<double>(f.range_min_m);
  c.range_m = static_cast<double>(f.range_m);
  c.sector.fill({kNone_m, 0, 0});
  const Matrix3 R_LC =
      R_LB * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(mount.R_BC.data());
  const Vector3 p_LC = R_LB * Vector3(mount.p_BC_m[0], mount.p_BC_m[1], mount.p_BC_m[2]);
  for (std::size_t v = 0; v < f.height; ++v)
    for (std::size_t u = 0; u < f.width; ++u) {
      const auto across = [](std::size_t i, std::uint16_t count, float tangent) {
        return -(2.0 * (static_cast<double>(i) + 0.5) / count - 1.0) * static_cast<double>(tangent);
      };
      const Vector3 ray_L =
          R_LC * Vector3(1.0, across(u, f.width, f.tan_half_width), across(v, f.height, f.tan_half_height));
      const auto depth_m = static_cast<double>(f.depth_m[v * f.width + u]);
      const bool silent = !(depth_m > c.range_min_m);  // also NaN
      const bool empty = depth_m > c.range_m;
      if (silent || empty) {
        if (std::fabs(ray_L.z()) > kLevel * core::hypot2(ray_L.x(), ray_L.y())) continue;
        Sector& sector = c.sector.at(sector_of(ray_L));
        ++(silent ? sector.silent : sector.free);
        continue;
      }
      const Vector3 hit_L = p_LC + depth_m * ray_L;
      if (std::fabs(hit_L.z()) > band_m_) continue;
      Sector& sector = c.sector.at(sector_of(hit_L));
      sector.hit_m = std::min(sector.hit_m, static_cast<float>(core::hypot2(hit_L.x(), hit_L.y())));
    }
}

ObstacleSectors::Sector ObstacleSectors::merged(std::size_t index, MonotonicTime now) const {
  Sector all{kNone_m, 0, 0};
  for (const Camera& camera : camera_) {
    if (camera.stamp == MonotonicTime::min() || now - camera.stamp > kOld) continue;
    const Sector& one = camera.sector.at(index);
    all.hit_m = std::min(all.hit_m, one.hit_m);
    all.free += one.free;
    all.silent += one.silent;
  }
  return all;
}

double ObstacleSectors::nearest_m(MonotonicTime now) const {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kSectors; ++i)
    nearest_m = std::min(nearest_m, static_cast<double>(merged(i, now).hit_m));
  return nearest_m;
}

double ObstacleSectors::clear_m(const firmware_if::mavlink::ObstacleDistance& message, double clockwise_rad,
                                double half_rad) {
  constexpr std::size_t kMostUnknown = 5;  // one in so many: single silent pixels make a sector unknown
  double clear_cm = message.max_distance;
  std::size_t count = 0, unknown = 0;
  for (std::size_t i = 0; i < kSectors; ++i) {
    const double beside_rad = core::wrap_angle(5.0 * core::kDegree * static_cast<double>(i) - clockwise_rad);
    if (std::fabs(beside_rad) > half_rad) continue;
    const std::uint16_t distance_cm = message.distances.at(i);
    ++count;
    unknown += distance_cm == kUnknown ? 1 : 0;
    clear_cm = std::min(clear_cm, static_cast<double>(distance_cm));
  }
  return unknown * kMostUnknown <= count ? 0.01 * clear_cm : 0.0;
}

firmware_if::mavlink::ObstacleDistance ObstacleSectors::message(MonotonicTime now) const {
  constexpr double kMost_cm = 65000.0;
  double least_m = 0.0, most_m = kMost_cm / 100.0;
  for (const Camera& camera : camera_) {
    if (camera.stamp == MonotonicTime::min()) continue;
    least_m = std::max(least_m, camera.range_min_m);
    most_m = std::min(most_m, camera.range_m);
  }
  firmware_if::mavlink::ObstacleDistance m;
  m.time_usec = static_cast<std::uint64_t>(now.time_since_epoch().count() / 1000);
  m.sensor_type = 4;  // unknown: a camera is none of the others
  m.increment = 5;
  m.frame = 12;
  m.min_distance = static_cast<std::uint16_t>(std::ceil(100.0 * least_m));
  m.max_distance = static_cast<std::uint16_t>(std::floor(100.0 * most_m));
  for (std::size_t i = 0; i < kSectors; ++i) {
    const Sector sector = merged(i, now);
    const double hit_cm =
        std::max(100.0 * static_cast<double>(sector.hit_m), static_cast<double>(m.min_distance));
    if (hit_cm <= m.max_distance)
      m.distances.at(i) = static_cast<std::uint16_t>(hit_cm);
    else if (sector.free > sector.silent)
      m.distances.at(i) = static_cast<std::uint16_t>(m.max_distance + 1);
    else
      m.distances.at(i) = kUnknown;
  }
  return m;
}

}  // namespace roborun::live
