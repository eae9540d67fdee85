#include "platform/flight/camera_watch.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/math.hpp"
#include "core/memory/static_vector.hpp"

namespace roborun::flight {
namespace {

constexpr std::size_t kSide = 16;  // samples of a row, and of a column
constexpr double kReach_m = 10.0;
constexpr double kNear_m = 1.0;
constexpr double kBeside_m = 0.6;  // what an estimate of centimetres and cells of 0.3 m may be off by
constexpr double kSigmas = 3.0;
constexpr int kLeastSurfaces = 6;  // of a part that counts
constexpr int kLeastParts = 3;
// A quarter of the image: a body in front of the open sky is no measure of a mount.
constexpr std::size_t kLeastOfAll = 64;

// What turns are compared by, with candidates that may be 5 degrees beside the true one.
constexpr double kCell_m = 0.3;
constexpr double kBeside_rad = 0.07;
constexpr double kBefore_m = 0.6;  // in front of a surface, beyond what it may be off by
constexpr std::array<double, 2> kTurns_deg{8.0, 16.0};
constexpr int kDirections = 12;
constexpr double kBody_m =
    2.0;  // across, seen from above: what contradicts within so little may be one body that moves

constexpr double kFar_m = 1e9;

struct Part {
  int surfaces{0}, contradictions{0};
};

/// What a pixel shows, in the camera's frame.
struct Surface {
  Vector3 p_C;
  double half_m;  ///< Its place is known so well.
};
using Surfaces = core::StaticVector<Surface, kSide * kSide>;

/// How surfaces lie in the map.
struct Fit {
  int in_free{0};  ///< Within known free space.
  int at_end{0};   ///< Where it ends.
  Vector3 lowest_W = Vector3::Constant(kFar_m),
          highest_W = Vector3::Constant(-kFar_m);  ///< Of those in free space.
};

Fit fit_of(const Surfaces& surfaces, const Pose& X_WC, const stages::MapView& known) noexcept {
  Fit fit;
  std::uint64_t lookups = 0;
  for (const Surface& surface : surfaces) {
    const Vector3 p_W = X_WC * surface.p_C;
    if (known.is_free_at_finest(Aabb::around(p_W, surface.half_m), lookups)) {
      ++fit.in_free;
      fit.lowest_W = fit.lowest_W.cwiseMin(p_W);
      fit.highest_W = fit.highest_W.cwiseMax(p_W);
      continue;
    }
    const double range_m = surface.p_C.norm();
    const double before_m = range_m - surface.half_m - kBefore_m;
    if (before_m <= 0.0) continue;
    const Vector3 before_W = X_WC * Vector3(before_m / range_m * surface.p_C);
    if (known.is_free_at_finest(Aabb::around(before_W, 0.5 * kCell_m), lookups)) ++fit.at_end;
  }
  return fit;
}

/// Turns the optical axis by an angle, towards a direction about it.
Matrix3 turn(double angle_rad, double direction_rad) noexcept {
  const core::SinCos angle = core::sin_cos(angle_rad), direction = core::sin_cos(direction_rad);
  const Vector3 axis_C(0.0, direction.cos, direction.sin);
  Matrix3 cross;
  cross << 0.0, -axis_C.z(), axis_C.y(), axis_C.z(), 0.0, -axis_C.x(), -axis_C.y(), axis_C.x(), 0.0;
  return Matrix3::Identity() + angle.sin * cross + (1.0 - angle.cos) * (cross * cross);
}

bool is_turned(const Surfaces& surfaces, const Fit& as_is, const Pose& X_WC,
               const stages::MapView& known) noexcept {
  const int all = static_cast<int>(surfaces.size());
  if (16 * as_is.in_free < all) return false;
  for (const double angle_deg : kTurns_deg) {
    for (int i = 0; i < kDirections; ++i) {
      const Matrix3 R_CT = turn(angle_deg * core::kDegree, 2.0 * core::kPi * i / kDirections);
      const Fit turned = fit_of(surfaces, {X_WC.R_RT * R_CT, X_WC.p_RT}, known);
      if (2 * turned.in_free <= as_is.in_free && 2 * turned.at_end >= all &&
          2 * (turned.at_end - as_is.at_end) >= as_is.in_free)
        return true;
    }
  }
  return false;
}

}  // namespace

Agreement agreement_of(const stages::PosedDepthFrame& posed, const stages::MapView& known) noexcept {
  const firmware_if::DepthFrame& f = posed.frame;
  std::array<Part, 4> part{};
  Surfaces surfaces;
  std::uint64_t lookups = 0;
  for (std::size_t j = 0; j < kSide; ++j) {
    for (std::size_t i = 0; i < kSide; ++i) {
      const std::size_t u = (2 * i + 1) * f.width / (2 * kSide), v = (2 * j + 1) * f.height / (2 * kSide);
      const auto depth_m = static_cast<double>(f.depth_m[v * f.width + u]);
      const double nearest_m = std::max(kNear_m, static_cast<double>(f.range_min_m));
      if (!(depth_m > nearest_m && depth_m < std::min(kReach_m, static_cast<double>(f.range_m)))) continue;
      const Vector3 ray_C(
          1.0, (1.0 - (2.0 * static_cast<double>(u) + 1.0) / f.width) * static_cast<double>(f.tan_half_width),
          (1.0 - (2.0 * static_cast<double>(v) + 1.0) / f.height) * static_cast<double>(f.tan_half_height));
      const Vector3 p_C = depth_m * ray_C;
      const double sigma_m = posed.error.place_m + posed.error.of_point_m(depth_m);
      const double half_m = std::max(kBeside_m, kSigmas * sigma_m);
      (void)surfaces.push_back({p_C, std::max(kCell_m + kBeside_rad * depth_m, kSigmas * sigma_m)});
      Part& of = part[2 * (2 * j / kSide) + 2 * i / kSide];
      ++of.surfaces;
      if (known.is_free_at_finest(Aabb::around(posed.X_WC * p_C, half_m), lookups)) ++of.contradictions;
    }
  }
  Part all;
  int parts = 0;
  bool everywhere = true;
  for (const Part& p : part) {
    if (p.surfaces < kLeastSurfaces) continue;
    ++parts;
    all.surfaces += p.surfaces;
    all.contradictions += p.contradictions;
    everywhere = everywhere && 8 * p.contradictions >= p.surfaces;
  }
  if (surfaces.size() >= kLeastOfAll) {
    const Fit as_is = fit_of(surfaces, posed.X_WC, known);
    const Vector3 spread = as_is.highest_W - as_is.lowest_W;
    const bool may_be_body = spread.x() < kBody_m && spread.y() < kBody_m;
    if (is_turned(surfaces, as_is, posed.X_WC, known))
      return may_be_body ? Agreement::kUnknown : Agreement::kTurned;
  }
  if (parts < kLeastParts || surfaces.size() < kLeastOfAll) return Agreement::kUnknown;
  return everywhere && 3 * all.contradictions >= all.surfaces ? Agreement::kDisagrees : Agreement::kAgrees;
}

}  // namespace roborun::flight
