#include "platform/sitl/sensors/lidar_effects.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "platform/sitl/sensors/draws.hpp"

namespace roborun::sitl {
namespace {

/// Flatter than this is an edge, not a surface.
constexpr double kSteepest = 12.0;
constexpr double kSpeck_m = 4.0;

}  // namespace

Pose SweepMotion::at(double share) const noexcept {
  const double place = std::clamp(share, 0.0, 1.0) * (kKnots - 1);
  const auto knot = std::min(static_cast<std::size_t>(place), kKnots - 2);
  const double between = place - static_cast<double>(knot);
  const Pose &a = X_WL[knot], &b = X_WL[knot + 1];
  // A turn of 3 rad/s is 2 degrees between knots: the mean of two rotations is one to 1 in 10,000.
  return {a.R_RT + between * (b.R_RT - a.R_RT), a.p_RT + between * (b.p_RT - a.p_RT)};
}

LidarEffects::LidarEffects(const LidarErrors& errors, double rain_mmph, std::uint64_t seed,
                           std::uint32_t lidar)
    : errors_(errors),
      extinction_pm_(rain_mmph > 0.0 ? 1.076 * core::exp(0.67 * core::log(rain_mmph)) / 4343.0 : 0.0),
      speck_ratio_(errors.false_ratio + 1e-4 * rain_mmph),
      lattice_(seed) {
  core::CounterRng mount(seed, 0x320000U + lidar);
  const Vector3 half_rad = 0.5 * errors.mount_deg * core::kDegree * normal3(mount);
  R_LE_ = Quaternion(1.0, half_rad.x(), half_rad.y(), half_rad.z()).normalized().toRotationMatrix();
  p_LE_ = errors.mount_m * normal3(mount);
}

Echo LidarEffects::measure(const World& world, const Pose& X_WL, const Vector3& ray_L, double range_m,
                           MonotonicTime when, core::CounterRng& rng) const noexcept {
  // As many draws for each ray, whatever it meets.
  const double speck = rng.uniform(), speck_share = rng.uniform();
  const std::uint64_t bits = rng.next(), shape = rng.next();
  const double side = SurfaceLattice::uniform(shape), share = SurfaceLattice::uniform(shape << 24U);

  const Vector3 ray_W = X_WL.R_RT * ray_L;
  const double first_m = world.hit_distance_m(X_WL.p_RT, ray_W, range_m, when);
  if (speck < speck_ratio_) {
    const double speck_m = -kSpeck_m * core::log(1.0 - speck_share);
    if (speck_m < first_m && speck_m < range_m) return {true, speck_m};
  }

  // Another ray of the same beam: up or aside by the beam's mean radius.
  const double off_rad = errors_.divergence_rad / 3.0;
  const Vector3 across_L =
      side < 0.5 ? Vector3(-ray_L.y(), ray_L.x(), 0.0) : Vector3(0.0, 0.0, 1.0) - ray_L.z() * ray_L;
  const Vector3 second_W = (ray_W + off_rad * (X_WL.R_RT * across_L)).normalized();
  const double second_m = world.hit_distance_m(X_WL.p_RT, second_W, range_m, when);
  double hit_m = first_m, cosine = 1.0;
  const double apart_m = std::fabs(second_m - first_m);
  const double slope = first_m < range_m && second_m < range_m ? apart_m / (off_rad * first_m) : kInfinity;
  if (slope < kSteepest) {
    cosine = 1.0 / std::sqrt(1.0 + slope * slope);
  } else if (apart_m < errors_.pulse_m) {
    hit_m = first_m + share * (second_m - first_m);
  } else if (share < 0.5) {
    hit_m = second_m;
  }
  if (!(hit_m < range_m)) return {};
  const Vector3 p_T = SurfaceLattice::turn() * (X_WL.p_RT + hit_m * ray_W);
  const double reflectivity = 0.05 + 0.75 * SurfaceLattice::uniform(lattice_.bits(p_T, 0.5));
  const double tenth_m = errors_.tenth_range_m;
  const double left = extinction_pm_ > 0.0 ? core::exp(-2.0 * extinction_pm_ * hit_m) : 1.0;
  if (reflectivity * cosine * left * tenth_m * tenth_m < 0.1 * hit_m * hit_m) return {};
  return {true, hit_m + bounded_normal(bits) * errors_.noise_m};
}

}  // namespace roborun::sitl
