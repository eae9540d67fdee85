#include "toolchain/bench/planner_problems.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "core/precision.hpp"
#include "core/random/counter_rng.hpp"

namespace roborun::bench {
namespace {

using stages::PlanRequest;

constexpr double kRadius_m = 0.9;
constexpr double kTop_m = 20.0;
constexpr double kWall_m = 0.6;

double on_grid(double x) { return kPublishedCell_m * std::round(x / kPublishedCell_m); }

/// Free space of this size around a start at (0, 0) and a goal at (length, 0).
Problem empty(double length_m, double half_width_m, std::uint64_t number) {
  Problem p;
  p.view.free_W = {Vector3(-9, -half_width_m - 4, 0), Vector3(length_m + 9, half_width_m + 4, 12)};
  PlanRequest& r = p.request;
  r.start_W = Vector3(0, 0, 5);
  r.goal_W = Vector3(length_m, 0, 5);
  r.bounds_W = {Vector3(-8, -half_width_m, 1.5), Vector3(length_m + 8, half_width_m, 10)};
  r.radius_m = kRadius_m;
  r.volume_m3 = std::numeric_limits<double>::infinity();
  r.horizon_m = 3.0 * (length_m + half_width_m);
  r.seed = number;
  return p;
}

void box(Problem& p, double x0, double y0, double x1, double y1, double z0 = 0.0, double z1 = kTop_m) {
  p.view.occupied.push_back(
      {Vector3(on_grid(x0), on_grid(y0), on_grid(z0)), Vector3(on_grid(x1), on_grid(y1), on_grid(z1))});
}

/// Boxes at random until there are so many; none near start or goal.
template <typename Draw>
void scatter(Problem& p, std::size_t count, double room_m, const Draw& draw) {
  const PlanRequest& r = p.request;
  std::uint64_t lookups = 0;
  while (p.view.occupied.size() < count) {
    draw(p.view.occupied.empty());
    if (!p.view.is_free(Aabb::around(r.start_W, room_m), lookups) ||
        !p.view.is_free(Aabb::around(r.goal_W, room_m), lookups))
      p.view.occupied.pop_back();
  }
}

Problem pillars(double length_m, std::uint64_t number) {
  Problem p = empty(length_m, 20.0, number);
  core::CounterRng rng(number, 60);
  scatter(p, static_cast<std::size_t>(length_m * 40.0 / 160.0), 3.0, [&](bool first) {
    const double width_m = on_grid(rng.uniform(1.5, 4.5));
    const double depth_m = on_grid(rng.uniform(1.5, 4.5));
    const double x_m = on_grid(first ? rng.uniform(0.2, 0.8) * length_m : rng.uniform(0.0, length_m));
    const double y_m = on_grid(first ? rng.uniform(-0.4, 0.4) * width_m - 0.5 * width_m : rng.uniform(-24.0, 20.0));
    box(p, x_m, y_m, x_m + depth_m, y_m + width_m);
  });
  return p;
}

Problem forest(std::uint64_t number) {
  Problem p = empty(60.0, 20.0, number);
  core::CounterRng rng(number, 61);
  scatter(p, static_cast<std::size_t>(76.0 * 40.0 / (3.5 * 3.5)), 2.0, [&](bool) {
    const double width_m = rng.uniform(0.6, 1.2);
    const double x_m = rng.uniform(-8.0, 68.0);
    const double y_m = rng.uniform(-20.0, 20.0);
    box(p, x_m, y_m, x_m + width_m, y_m + width_m);
  });
  return p;
}

Problem trap(std::uint64_t number) {
  const double size_m = 20.0 + 4.0 * static_cast<double>(number % 8);
  Problem p = empty(80.0, 0.5 * size_m + 20.0, number);
  p.request.bounds_W.max_W.x() += 20.0;
  p.view.free_W.max_W.x() += 20.0;
  const double x0 = 80.0 - 0.5 * size_m, x1 = 80.0 + 0.5 * size_m, y = 0.5 * size_m;
  box(p, x0, -y, x0 + kWall_m, y);
  box(p, x0, y, x1, y + kWall_m);
  box(p, x0, -y - kWall_m, x1, -y);
  return p;
}

Problem maze(std::uint64_t number) {
  constexpr int kRooms = 8;
  constexpr std::size_t kAll = std::size_t{kRooms} * kRooms;
  constexpr double kPitch_m = 6.2;  // corridors of 5.6 m
  const double side_m = kRooms * kPitch_m;
  Problem p = empty(side_m - kPitch_m, 0.5 * side_m, number);
  p.request.start_W.y() = 0.5 * kPitch_m - 0.5 * side_m;
  p.request.goal_W.y() = 0.5 * side_m - 0.5 * kPitch_m;
  // A spanning tree by depth first: a wall wherever it does not go.
  core::CounterRng rng(number, 62);
  std::array<bool, kAll> seen{};
  std::array<std::array<bool, 2>, kAll> open{};  // to the next in x, in y
  std::vector<int> stack{0};
  seen[0] = true;
  while (!stack.empty()) {
    const int at = stack.back();
    std::vector<int> next;
    const auto look = [&](int to) {
      if (!seen[static_cast<std::size_t>(to)]) next.push_back(to);
    };
    if (at % kRooms > 0) look(at - 1);
    if (at % kRooms < kRooms - 1) look(at + 1);
    if (at / kRooms > 0) look(at - kRooms);
    if (at / kRooms < kRooms - 1) look(at + kRooms);
    if (next.empty()) {
      stack.pop_back();
      continue;
    }
    const int to = next[static_cast<std::size_t>(rng.uniform() * static_cast<double>(next.size()))];
    open[static_cast<std::size_t>(std::min(at, to))][std::abs(at - to) == 1 ? 0 : 1] = true;
    seen[static_cast<std::size_t>(to)] = true;
    stack.push_back(to);
  }
  const double x0 = -0.5 * kPitch_m, y0 = -0.5 * side_m;
  for (int room = 0; room < kRooms * kRooms; ++room) {
    const int column = room % kRooms + 1, row = room / kRooms + 1;
    const double x = x0 + kPitch_m * column, y = y0 + kPitch_m * row;
    if (!open[static_cast<std::size_t>(room)][0]) box(p, x - 0.3, y - kPitch_m - 0.3, x + 0.3, y + 0.3);
    if (!open[static_cast<std::size_t>(room)][1]) box(p, x - kPitch_m - 0.3, y - 0.3, x + 0.3, y + 0.3);
  }
  box(p, x0 - 0.3, y0 - 0.3, x0 + 0.3, -y0 + 0.3);
  box(p, x0 - 0.3, y0 - 0.3, x0 + side_m + 0.3, y0 + 0.3);
  return p;
}

Problem serpentine(std::uint64_t number) {
  Problem p = empty(60.0, 15.0, number);
  core::CounterRng rng(number, 63);
  const double opening_m = rng.uniform(4.0, 6.0);
  for (int wall = 0; wall < 8; ++wall) {
    const double x_m = 4.0 + 7.0 * wall;
    const bool left = (static_cast<std::uint64_t>(wall) + number) % 2 == 0;
    box(p, x_m, left ? -19.0 : -15.0 + opening_m, x_m + kWall_m, left ? 15.0 - opening_m : 19.0);
  }
  return p;
}

Problem walls(std::uint64_t number, bool window) {
  Problem p = empty(60.0, 20.0, number);
  core::CounterRng rng(number, window ? 65 : 64);
  constexpr double kOpening_m = 2.4;
  for (int wall = 0; wall < 3; ++wall) {
    const double x_m = 15.0 * (wall + 1);
    const double y_m = on_grid(rng.uniform(-18.0, 18.0 - kOpening_m));
    const double z_m = on_grid(rng.uniform(2.0, 9.0 - kOpening_m));
    box(p, x_m, -24.0, x_m + kWall_m, y_m);
    box(p, x_m, y_m + kOpening_m, x_m + kWall_m, 24.0);
    if (!window) continue;
    box(p, x_m, y_m, x_m + kWall_m, y_m + kOpening_m, 0.0, z_m);
    box(p, x_m, y_m, x_m + kWall_m, y_m + kOpening_m, z_m + kOpening_m);
  }
  return p;
}

}  // namespace

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> kKinds{{"pillars60", 100}, {"pillars150", 100}, {"forest", 20}, {"trap", 8},
                                        {"maze", 20},       {"serpentine", 20},  {"slots", 20},  {"windows", 20}};
  return kKinds;
}

Problem problem_of(std::string_view kind, std::uint64_t number) {
  if (kind == "pillars60") return pillars(60.0, number);
  if (kind == "pillars150") return pillars(150.0, number);
  if (kind == "forest") return forest(number);
  if (kind == "trap") return trap(number);
  if (kind == "maze") return maze(number);
  if (kind == "serpentine") return serpentine(number);
  return walls(number, kind == "windows");
}

}  // namespace roborun::bench
