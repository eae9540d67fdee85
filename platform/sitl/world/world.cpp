#include "platform/sitl/world/world.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "platform/input/input_error.hpp"
#include "platform/sitl/world/ray_span.hpp"

namespace roborun::sitl {
namespace {

constexpr double kColumn_m = 5.0;

double hit_pillar_m(const Pillar& pillar, const Vector3& o, const Vector3& d) noexcept {
  const double ox = o.x() - pillar.x_m;
  const double oy = o.y() - pillar.y_m;
  const double a = d.x() * d.x() + d.y() * d.y();
  const double b = ox * d.x() + oy * d.y();
  const double c = ox * ox + oy * oy - pillar.radius_m * pillar.radius_m;
  double enter_m = -kInfinity;
  double leave_m = kInfinity;
  if (a > 0.0) {
    const double discriminant = b * b - a * c;
    if (discriminant < 0.0) return kInfinity;
    const double root = std::sqrt(discriminant);
    enter_m = (-b - root) / a;
    leave_m = (-b + root) / a;
  } else if (c > 0.0) {
    return kInfinity;
  }
  if (d.z() != 0.0) {
    const double t0 = (pillar.bottom_m - o.z()) / d.z();
    const double t1 = (pillar.top_m - o.z()) / d.z();
    enter_m = std::max(enter_m, std::min(t0, t1));
    leave_m = std::min(leave_m, std::max(t0, t1));
  } else if (o.z() < pillar.bottom_m || o.z() > pillar.top_m) {
    return kInfinity;
  }
  if (enter_m > leave_m || leave_m < 0.0) return kInfinity;
  return std::max(enter_m, 0.0);
}

double hit_box_m(const Aabb& box, const Vector3& o, const Vector3& d) noexcept {
  const RaySpan span = span_in(box, o, d);
  return span.enter_m > span.leave_m ? kInfinity : span.enter_m;
}

double pillar_distance_m(const Pillar& pillar, const Vector3& p) noexcept {
  const double side_m = std::max(core::hypot2(p.x() - pillar.x_m, p.y() - pillar.y_m) - pillar.radius_m, 0.0);
  const double height_m = std::max({pillar.bottom_m - p.z(), p.z() - pillar.top_m, 0.0});
  return core::hypot2(side_m, height_m);
}

double box_distance_m(const Aabb& box, const Vector3& p) noexcept {
  return (p - p.cwiseMax(box.min_W).cwiseMin(box.max_W)).norm();
}

Pillar cylinder_of(const Body& body, const Vector3& center_W) noexcept {
  const double half_m = 0.5 * body.height_m;
  return {center_W.x(), center_W.y(), body.radius_m, center_W.z() - half_m, center_W.z() + half_m};
}

double hit_sphere_m(const Vector3& center_W, double radius_m, const Vector3& o, const Vector3& d) noexcept {
  const Vector3 to_center = center_W - o;
  const double along_m = to_center.dot(d);
  const double c = to_center.squaredNorm() - radius_m * radius_m;
  const double discriminant = along_m * along_m - c;
  if (c <= 0.0) return 0.0;
  return discriminant < 0.0 || along_m < 0.0 ? kInfinity : along_m - std::sqrt(discriminant);
}

Aabb extent_of(const Pillar& p) noexcept {
  return {Vector3(p.x_m - p.radius_m, p.y_m - p.radius_m, p.bottom_m),
          Vector3(p.x_m + p.radius_m, p.y_m + p.radius_m, p.top_m)};
}

Aabb extent_of(const Ball& ball) noexcept { return Aabb::around(ball.center_W, ball.radius_m); }

Aabb extent_of(const Turned& turned) noexcept {
  const Aabb* box = std::get_if<Aabb>(&turned.shape_S);
  const Aabb own = box != nullptr ? *box : extent_of(std::get<Pillar>(turned.shape_S));
  const Vector3 center_W = turned.X_WS * own.center();
  const Vector3 half_m = turned.X_WS.R_RT.cwiseAbs() * (0.5 * own.size());
  return {center_W - half_m, center_W + half_m};
}

double hit_turned_m(const Turned& turned, const Vector3& o_W, const Vector3& d_W) noexcept {
  const Vector3 o_S = turned.X_WS.inverse_times(o_W);
  const Vector3 d_S = turned.X_WS.R_RT.transpose() * d_W;
  const Aabb* box = std::get_if<Aabb>(&turned.shape_S);
  return box != nullptr ? hit_box_m(*box, o_S, d_S)
                        : hit_pillar_m(std::get<Pillar>(turned.shape_S), o_S, d_S);
}

double turned_distance_m(const Turned& turned, const Vector3& p_W) noexcept {
  const Vector3 p_S = turned.X_WS.inverse_times(p_W);
  const Aabb* box = std::get_if<Aabb>(&turned.shape_S);
  return box != nullptr ? box_distance_m(*box, p_S)
                        : pillar_distance_m(std::get<Pillar>(turned.shape_S), p_S);
}

}  // namespace

Vector3 Body::center_W(MonotonicTime when) const noexcept {
  double left_m = std::max(seconds(when.time_since_epoch()) - start_s, 0.0) * speed_mps;
  for (std::size_t i = 1; i < path_W.size(); ++i) {
    const Vector3 way = path_W[i] - path_W[i - 1];
    const double length_m = way.norm();
    if (left_m < length_m) return path_W[i - 1] + (left_m / length_m) * way;
    left_m -= length_m;
  }
  return path_W.back();
}

Aabb extent_W(const WorldDescription& world) noexcept {
  Aabb all{Vector3::Constant(kInfinity), Vector3::Constant(-kInfinity)};
  const auto add = [&all](const Aabb& box) {
    all = {all.min_W.cwiseMin(box.min_W), all.max_W.cwiseMax(box.max_W)};
  };
  for (const Pillar& pillar : world.pillars) add(extent_of(pillar));
  for (const Aabb& box : world.boxes) add(box);
  for (const Ball& ball : world.balls) add(extent_of(ball));
  for (const Turned& turned : world.turned) add(extent_of(turned));
  if (!world.mesh.empty()) add(world.mesh.bounds_W());
  if (!world.voxels.empty()) add(world.voxels.bounds_W());
  return all;
}

World::World(WorldDescription description) : description_(std::move(description)) {
  const Aabb& b = description_.bounds_W;
  if (!is_finite(b.min_W) || !is_finite(b.max_W) || !(b.size().minCoeff() > 0.0) ||
      b.size().maxCoeff() > 20e3) {
    throw InputError("world: bounds must be finite, with min < max on every axis and at most 20 km a side");
  }
  for (const auto& [name, p] :
       {std::pair{"start", description_.start_W}, std::pair{"goal", description_.goal_W}}) {
    if (!is_finite(p) || !b.contains(p)) {
      throw InputError(fmt::format(
          "world: {} ({}, {}, {}) is outside the bounds x {}..{}, y {}..{}, z {}..{} m", name, p.x(), p.y(),
          p.z(), b.min_W.x(), b.max_W.x(), b.min_W.y(), b.max_W.y(), b.min_W.z(), b.max_W.z()));
    }
  }

  std::vector<Aabb> extents;
  for (const Pillar& pillar : description_.pillars) extents.push_back(extent_of(pillar));
  extents.insert(extents.end(), description_.boxes.begin(), description_.boxes.end());
  for (const Ball& ball : description_.balls) extents.push_back(extent_of(ball));
  for (const Turned& turned : description_.turned) extents.push_back(extent_of(turned));

  // One column more on each side, so that a ray that starts at the border meets a square.
  grid_min_W_ = b.min_W - Vector3::Constant(kColumn_m);
  nx_ = static_cast<std::int64_t>(b.size().x() / kColumn_m) + 3;
  ny_ = static_cast<std::int64_t>(b.size().y() / kColumn_m) + 3;
  std::vector<std::vector<std::uint32_t>> columns(static_cast<std::size_t>(nx_ * ny_));
  for (std::size_t i = 0; i < extents.size(); ++i) {
    const auto clamp_index = [](double raw, std::int64_t count) {
      return static_cast<std::int64_t>(std::clamp(std::floor(raw), 0.0, static_cast<double>(count - 1)));
    };
    const std::int64_t x0 = clamp_index((extents[i].min_W.x() - grid_min_W_.x()) / kColumn_m, nx_);
    const std::int64_t x1 = clamp_index((extents[i].max_W.x() - grid_min_W_.x()) / kColumn_m, nx_);
    const std::int64_t y0 = clamp_index((extents[i].min_W.y() - grid_min_W_.y()) / kColumn_m, ny_);
    const std::int64_t y1 = clamp_index((extents[i].max_W.y() - grid_min_W_.y()) / kColumn_m, ny_);
    for (std::int64_t y = y0; y <= y1; ++y) {
      for (std::int64_t x = x0; x <= x1; ++x) columns[column(x, y)].push_back(static_cast<std::uint32_t>(i));
    }
  }
  for (const auto& list : columns) {
    column_.push_back({static_cast<std::uint32_t>(object_.size()), static_cast<std::uint32_t>(list.size())});
    object_.insert(object_.end(), list.begin(), list.end());
  }
}

std::size_t World::column(std::int64_t ix, std::int64_t iy) const noexcept {
  return static_cast<std::size_t>(iy * nx_ + ix);
}

double World::hit_object_m(std::uint32_t object, const Vector3& origin_W,
                           const Vector3& direction_W) const noexcept {
  const WorldDescription& d = description_;
  std::size_t i = object;
  if (i < d.pillars.size()) return hit_pillar_m(d.pillars[i], origin_W, direction_W);
  i -= d.pillars.size();
  if (i < d.boxes.size()) return hit_box_m(d.boxes[i], origin_W, direction_W);
  i -= d.boxes.size();
  if (i < d.balls.size())
    return hit_sphere_m(d.balls[i].center_W, d.balls[i].radius_m, origin_W, direction_W);
  return hit_turned_m(d.turned[i - d.balls.size()], origin_W, direction_W);
}

double World::object_distance_m(std::uint32_t object, const Vector3& p_W) const noexcept {
  const WorldDescription& d = description_;
  std::size_t i = object;
  if (i < d.pillars.size()) return pillar_distance_m(d.pillars[i], p_W);
  i -= d.pillars.size();
  if (i < d.boxes.size()) return box_distance_m(d.boxes[i], p_W);
  i -= d.boxes.size();
  if (i < d.balls.size()) return std::max((p_W - d.balls[i].center_W).norm() - d.balls[i].radius_m, 0.0);
  return turned_distance_m(d.turned[i - d.balls.size()], p_W);
}

double World::hit_distance_m(const Vector3& origin_W, const Vector3& direction_W,
                             double max_m) const noexcept {
  double best_m = description_.voxels.hit_distance_m(origin_W, direction_W, max_m);
  best_m = std::min(best_m, description_.mesh.hit_distance_m(origin_W, direction_W, max_m));
  if (direction_W.z() < 0.0)
    best_m = std::min(best_m, std::max(origin_W.z() - description_.ground_m, 0.0) / -direction_W.z());
  best_m = std::min(best_m, max_m);
  bool hit = best_m < max_m;

  const double gx = (origin_W.x() - grid_min_W_.x()) / kColumn_m;
  const double gy = (origin_W.y() - grid_min_W_.y()) / kColumn_m;
  auto ix = static_cast<std::int64_t>(std::clamp(std::floor(gx), -1.0, static_cast<double>(nx_)));
  auto iy = static_cast<std::int64_t>(std::clamp(std::floor(gy), -1.0, static_cast<double>(ny_)));
  const double dx = direction_W.x() / kColumn_m;
  const double dy = direction_W.y() / kColumn_m;
  const std::int64_t sx = dx > 0.0 ? 1 : -1;
  const std::int64_t sy = dy > 0.0 ? 1 : -1;
  const double step_x_m = dx == 0.0 ? kInfinity : 1.0 / std::fabs(dx);
  const double step_y_m = dy == 0.0 ? kInfinity : 1.0 / std::fabs(dy);
  double next_x_m = dx == 0.0 ? kInfinity : (static_cast<double>(ix + (sx > 0 ? 1 : 0)) - gx) / dx;
  double next_y_m = dy == 0.0 ? kInfinity : (static_cast<double>(iy + (sy > 0 ? 1 : 0)) - gy) / dy;
  double at_m = 0.0;
  while (at_m <= best_m && ix >= 0 && iy >= 0 && ix < nx_ && iy < ny_) {
    const Range range = column_[column(ix, iy)];
    for (std::uint32_t i = range.first; i < range.first + range.count; ++i) {
      const double distance_m = hit_object_m(object_[i], origin_W, direction_W);
      if (distance_m <= best_m) {
        best_m = distance_m;
        hit = true;
      }
    }
    if (next_x_m < next_y_m) {
      at_m = next_x_m;
      next_x_m += step_x_m;
      ix += sx;
    } else {
      at_m = next_y_m;
      if (at_m == kInfinity) break;  // straight up or down: one column is all there is
      next_y_m += step_y_m;
      iy += sy;
    }
  }
  return hit ? best_m : kInfinity;
}

double World::clearance_m(const Vector3& p_W, double cap_m) const noexcept {
  double best_m = description_.mesh.clearance_m(p_W, description_.voxels.clearance_m(p_W, cap_m));
  const auto index = [](double raw, std::int64_t count) {
    return static_cast<std::int64_t>(std::clamp(std::floor(raw), 0.0, static_cast<double>(count - 1)));
  };
  const std::int64_t x0 = index((p_W.x() - cap_m - grid_min_W_.x()) / kColumn_m, nx_);
  const std::int64_t x1 = index((p_W.x() + cap_m - grid_min_W_.x()) / kColumn_m, nx_);
  const std::int64_t y0 = index((p_W.y() - cap_m - grid_min_W_.y()) / kColumn_m, ny_);
  const std::int64_t y1 = index((p_W.y() + cap_m - grid_min_W_.y()) / kColumn_m, ny_);
  for (std::int64_t y = y0; y <= y1; ++y) {
    for (std::int64_t x = x0; x <= x1; ++x) {
      const Range range = column_[column(x, y)];
      for (std::uint32_t i = range.first; i < range.first + range.count; ++i)
        best_m = std::min(best_m, object_distance_m(object_[i], p_W));
    }
  }
  return best_m;
}

double World::ground_below_m(const Vector3& p_W) const noexcept {
  constexpr double kDeepest_m = 1e5;
  return p_W.z() - hit_distance_m(p_W, -Vector3::UnitZ(), kDeepest_m);
}

void World::add(const std::vector<Body>& bodies) {
  description_.bodies.insert(description_.bodies.end(), bodies.begin(), bodies.end());
}

double World::hit_distance_m(const Vector3& origin_W, const Vector3& direction_W, double max_m,
                             MonotonicTime when) const noexcept {
  double best_m = hit_distance_m(origin_W, direction_W, max_m);
  for (const Body& body : description_.bodies) {
    const Vector3 center_W = body.center_W(when);
    const double hit_m = body.height_m > 0.0
                             ? hit_pillar_m(cylinder_of(body, center_W), origin_W, direction_W)
                             : hit_sphere_m(center_W, body.radius_m, origin_W, direction_W);
    if (hit_m <= max_m) best_m = std::min(best_m, hit_m);
  }
  return best_m;
}

std::optional<World::NearestBody> World::nearest_body(const Vector3& p_W, double cap_m,
                                                      MonotonicTime when) const noexcept {
  std::optional<NearestBody> nearest;
  for (const Body& body : description_.bodies) {
    Vector3 core_W = body.center_W(when);
    const double distance_m = body.height_m > 0.0 ? pillar_distance_m(cylinder_of(body, core_W), p_W)
                                                  : std::max((p_W - core_W).norm() - body.radius_m, 0.0);
    if (distance_m >= (nearest ? nearest->distance_m : cap_m)) continue;
    const double half_m = 0.5 * body.height_m;
    core_W.z() = std::clamp(p_W.z(), core_W.z() - half_m, core_W.z() + half_m);
    nearest = {distance_m, core_W};
  }
  return nearest;
}

double World::congestion_ratio(double x_m, double y_m) const noexcept {
  constexpr double kReach_m = 30.0;
  constexpr double kCell_m = 10.0;
  constexpr double kHalfDiagonal_m = 7.08;
  int occupied = 0;
  int cells = 0;
  const double z_m = description_.start_W.z();
  for (double dy_m = -kReach_m; dy_m <= kReach_m; dy_m += kCell_m) {
    for (double dx_m = -kReach_m; dx_m <= kReach_m; dx_m += kCell_m) {
      if (dx_m * dx_m + dy_m * dy_m > kReach_m * kReach_m) continue;
      ++cells;
      const Vector3 cell_W(x_m + dx_m, y_m + dy_m, z_m);
      if (clearance_m(cell_W, kHalfDiagonal_m) < kHalfDiagonal_m) ++occupied;
    }
  }
  return static_cast<double>(occupied) / cells;
}

std::string why_no_room(const World& world, double radius_m) {
  constexpr double kStep_m = 0.1;
  constexpr double kUneven_m = 0.3;  // of the ground that it stands on
  const Vector3& start_W = world.start_W();
  const auto place = [](const Vector3& p_W) {
    return fmt::format("({:.2f}, {:.2f}, {:.2f})", p_W.x(), p_W.y(), p_W.z());
  };
  for (const auto& [name, p_W] : {std::pair{"start", start_W}, std::pair{"goal", world.goal_W()}}) {
    if (world.clearance_m(p_W, radius_m) < radius_m)
      return fmt::format("{} {} is closer than {} m to an obstacle: must be free", name, place(p_W),
                         radius_m);
  }
  const double ground_m = world.ground_below_m(start_W);
  if (!std::isfinite(ground_m))
    return fmt::format("no ground below the start {}: must have some, or --ground Z", place(start_W));
  for (Vector3 p_W = start_W; p_W.z() > ground_m + radius_m + kUneven_m; p_W.z() -= kStep_m) {
    if (world.clearance_m(p_W, radius_m) < radius_m)
      return fmt::format(
          "start {}: no room to climb to it from the ground at {:.2f} m: {} m at {:.2f} m must be free",
          place(start_W), ground_m, radius_m, p_W.z());
  }
  return {};
}

}  // namespace roborun::sitl
