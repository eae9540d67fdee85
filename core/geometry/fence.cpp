#include "core/geometry/fence.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::core {
namespace {

constexpr double kFarthest_m = 16000.0;

bool usable(double value) noexcept { return std::fabs(value) <= kFarthest_m; }

/// Twice the area of the triangle a, b, c; above 0 if c lies to the left of a -> b.
double turn(const FencePoint& a, const FencePoint& b, const FencePoint& c) noexcept {
  return (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
}

bool boxes_meet(const FencePoint& a, const FencePoint& b, const FencePoint& c, const FencePoint& d) noexcept {
  return std::max(a.x_m, b.x_m) >= std::min(c.x_m, d.x_m) &&
         std::max(c.x_m, d.x_m) >= std::min(a.x_m, b.x_m) &&
         std::max(a.y_m, b.y_m) >= std::min(c.y_m, d.y_m) && std::max(c.y_m, d.y_m) >= std::min(a.y_m, b.y_m);
}

/// Closed segments a-b and c-d have a point in common.
bool segments_meet(const FencePoint& a, const FencePoint& b, const FencePoint& c,
                   const FencePoint& d) noexcept {
  const auto apart = [](double s, double t) { return (s > 0.0 && t > 0.0) || (s < 0.0 && t < 0.0); };
  return boxes_meet(a, b, c, d) && !apart(turn(a, b, c), turn(a, b, d)) &&
         !apart(turn(c, d, a), turn(c, d, b));
}

/// Neighbouring edges a-b and b-c have more than b in common.
bool folds_back(const FencePoint& a, const FencePoint& b, const FencePoint& c) noexcept {
  const double ahead = (b.x_m - a.x_m) * (c.x_m - b.x_m) + (b.y_m - a.y_m) * (c.y_m - b.y_m);
  return turn(a, b, c) == 0.0 && ahead <= 0.0;
}

bool touches_itself(std::span<const FencePoint> p) noexcept {
  const std::size_t n = p.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (folds_back(p[i], p[(i + 1) % n], p[(i + 2) % n])) return true;
    for (std::size_t k = i + 2; k < n; ++k) {
      if ((k + 1) % n != i && segments_meet(p[i], p[i + 1], p[k], p[(k + 1) % n])) return true;
    }
  }
  return false;
}

}  // namespace

FenceFault Fence::add_polygon(FenceSide side, std::span<const FencePoint> points) noexcept {
  if (points.size() < 3) return FenceFault::kTooFewPoints;
  if (points.size() > kMaxPoints) return FenceFault::kTooManyPoints;
  for (const FencePoint& p : points) {
    if (!usable(p.x_m) || !usable(p.y_m)) return FenceFault::kNotFinite;
  }
  if (touches_itself(points)) return FenceFault::kTouchesItself;
  Area area;
  area.side = side;
  area.count = points.size();
  std::copy(points.begin(), points.end(), area.point.begin());
  return areas_.push_back(area) ? FenceFault::kNone : FenceFault::kTooManyAreas;
}

FenceFault Fence::add_circle(FenceSide side, const FencePoint& center, double radius_m) noexcept {
  if (!usable(center.x_m) || !usable(center.y_m) || !usable(radius_m)) return FenceFault::kNotFinite;
  if (!(radius_m > 0.0)) return FenceFault::kRadius;
  Area area;
  area.side = side;
  area.radius_m = radius_m;
  area.count = 1;
  area.point[0] = center;
  return areas_.push_back(area) ? FenceFault::kNone : FenceFault::kTooManyAreas;
}

FenceFault Fence::set_altitude(double lowest_m, double highest_m) noexcept {
  if (!usable(lowest_m) || !usable(highest_m)) return FenceFault::kNotFinite;
  if (!(highest_m > lowest_m)) return FenceFault::kAltitude;
  lowest_m_ = lowest_m;
  highest_m_ = highest_m;
  return FenceFault::kNone;
}

bool Fence::circle_allows(const Area& area, const Rectangle& r) noexcept {
  const FencePoint& c = area.point[0];
  const double radius2 = area.radius_m * area.radius_m;
  if (area.side == FenceSide::kKeepIn) {
    const double x = std::max(std::fabs(r.x0_m - c.x_m), std::fabs(r.x1_m - c.x_m));
    const double y = std::max(std::fabs(r.y0_m - c.y_m), std::fabs(r.y1_m - c.y_m));
    return x * x + y * y < radius2;
  }
  const double x = std::clamp(c.x_m, r.x0_m, r.x1_m) - c.x_m;
  const double y = std::clamp(c.y_m, r.y0_m, r.y1_m) - c.y_m;
  return x * x + y * y > radius2;
}

bool Fence::polygon_allows(const Area& area, const Rectangle& r) noexcept {
  const std::array<FencePoint, 4> corner{
      {{r.x0_m, r.y0_m}, {r.x1_m, r.y0_m}, {r.x1_m, r.y1_m}, {r.x0_m, r.y1_m}}};
  int winding = 0;
  for (std::size_t i = 0; i < area.count; ++i) {
    const FencePoint& a = area.point[i];
    const FencePoint& b = area.point[(i + 1) % area.count];
    std::array<double, 4> side{};
    for (std::size_t k = 0; k < 4; ++k) side[k] = turn(a, b, corner[k]);
    // An edge that touches the rectangle: no axis separates them.
    const auto [least, most] = std::minmax_element(side.begin(), side.end());
    if (boxes_meet(a, b, corner[0], corner[2]) && *least <= 0.0 && *most >= 0.0) return false;
    // No edge touches: one corner stands for all. Winding number of the polygon around it.
    if (a.y_m <= corner[0].y_m) {
      winding += b.y_m > corner[0].y_m && side[0] > 0.0 ? 1 : 0;
    } else {
      winding -= b.y_m <= corner[0].y_m && side[0] < 0.0 ? 1 : 0;
    }
  }
  return (winding != 0) == (area.side == FenceSide::kKeepIn);
}

bool Fence::allows_over_ground(const Aabb& box_W) const noexcept {
  const Rectangle r{box_W.min_W.x(), box_W.max_W.x(), box_W.min_W.y(), box_W.max_W.y()};
  // Written so that NaN is refused; 2^-10 m steps stay exact up to twice the farthest point of an area.
  const bool sound = r.x0_m >= -2.0 * kFarthest_m && r.x1_m <= 2.0 * kFarthest_m && r.x0_m <= r.x1_m &&
                     r.y0_m >= -2.0 * kFarthest_m && r.y1_m <= 2.0 * kFarthest_m && r.y0_m <= r.y1_m;
  if (!sound) return areas_.empty() && is_finite(box_W.min_W) && is_finite(box_W.max_W);
  for (const Area& area : areas_) {
    if (!(area.radius_m > 0.0 ? circle_allows(area, r) : polygon_allows(area, r))) return false;
  }
  return true;
}

const char* to_string(FenceFault fault) noexcept {
  constexpr std::array<const char*, 8> kText{"nothing is wrong",
                                             "must be finite numbers of at most 16000 m",
                                             "must have at least three points",
                                             "must have at most 32 points",
                                             "must not touch or cross itself, and no two points may be equal",
                                             "must be above 0",
                                             "the upper limit must be above the lower one",
                                             "must be at most 16 areas"};
  return kText[static_cast<std::size_t>(fault)];
}

}  // namespace roborun::core
