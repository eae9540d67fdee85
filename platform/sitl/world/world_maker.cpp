#include "platform/sitl/world/world_maker.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/geometry/math.hpp"
#include "core/random/counter_rng.hpp"
#include "firmware_if/assert.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::sitl {
namespace {

using core::CounterRng;

constexpr double kGrid_m = 0.2;  // openings are centred on its multiples
constexpr double kLow_m = 1.0;   // bounds, and walls that nobody flies over
constexpr double kHigh_m = 7.0;
constexpr double kTop_m = 12.0;
constexpr double kCruise_m = 3.0;
constexpr double kWall_m = 0.4;
constexpr double kClear_m = 2.5;  // around start and goal nothing stands

double snapped(double value_m) { return kGrid_m * std::round(value_m / kGrid_m); }
double between(CounterRng& rng, double low, double high) { return low + (high - low) * rng.uniform(); }

WorldDescription open_world(double length_m, double half_width_m) {
  WorldDescription world;
  world.bounds_W = {{-10.0, -half_width_m, kLow_m}, {length_m + 10.0, half_width_m, kHigh_m}};
  world.start_W = {0.0, 0.0, kCruise_m};
  world.goal_W = {length_m, 0.0, kCruise_m};
  return world;
}

void add_wall(WorldDescription& world, double x0_m, double y0_m, double x1_m, double y1_m,
              double top_m = kTop_m) {
  world.boxes.push_back({{x0_m, y0_m, 0.0}, {x1_m, y1_m, top_m}});
}

bool near_an_end(const WorldDescription& world, double x_m, double y_m, double radius_m) {
  for (const Vector3& end : {world.start_W, world.goal_W})
    if (core::hypot2(x_m - end.x(), y_m - end.y()) < kClear_m + radius_m) return true;
  return false;
}

/// A pillar at a random place of each square between the ends.
WorldDescription scattered(CounterRng& rng, double length_m, double spacing_m, double low_radius_m,
                           std::initializer_list<double> radii_m) {
  WorldDescription world = open_world(length_m, 20.0);
  for (double y_m = -20.0 + 0.5 * spacing_m; y_m < 20.0; y_m += spacing_m) {
    for (double x_m = 0.5 * spacing_m - 5.0; x_m < length_m + 5.0; x_m += spacing_m) {
      // Always the same draws a square.
      const double dx_m = between(rng, -0.25, 0.25) * spacing_m;
      const double dy_m = between(rng, -0.25, 0.25) * spacing_m;
      const double size = rng.uniform();
      double radius_m = low_radius_m * (1.0 + size);
      if (radii_m.size() > 0)
        radius_m =
            *(radii_m.begin() + static_cast<std::ptrdiff_t>(size * static_cast<double>(radii_m.size())));
      if (!near_an_end(world, x_m + dx_m, y_m + dy_m, radius_m))
        world.pillars.push_back({x_m + dx_m, y_m + dy_m, radius_m, 0.0, kTop_m});
    }
  }
  return world;
}

WorldDescription make_maze(CounterRng& rng, double width_m) {
  constexpr int kCells = 8;
  const double pitch_m = width_m + kWall_m;
  const double size_m = kCells * pitch_m;
  WorldDescription world;
  world.bounds_W = {{0.0, 0.0, kLow_m}, {size_m, size_m, kHigh_m - 2.0}};
  world.start_W = {0.5 * pitch_m, 0.5 * pitch_m, kCruise_m};
  world.goal_W = {size_m - 0.5 * pitch_m, size_m - 0.5 * pitch_m, kCruise_m};
  // Depth first from the start: every cell is reached by one way. Walls to the right of and behind a cell.
  std::array<std::array<bool, kCells>, kCells> seen{};
  std::array<std::array<std::array<bool, 2>, kCells>, kCells> wall{};
  for (auto& row : wall)
    for (auto& cell : row) cell = {true, true};
  const auto at = [](auto& grid, int x, int y) -> auto& {
    return grid[static_cast<std::size_t>(x)][static_cast<std::size_t>(y)];
  };
  std::vector<std::pair<int, int>> way{{0, 0}};
  seen[0][0] = true;
  while (!way.empty()) {
    const auto [x, y] = way.back();
    std::vector<std::pair<int, int>> next;
    for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}}) {
      const int nx = x + dx;
      const int ny = y + dy;
      if (nx >= 0 && ny >= 0 && nx < kCells && ny < kCells && !at(seen, nx, ny)) next.emplace_back(nx, ny);
    }
    if (next.empty()) {
      way.pop_back();
      continue;
    }
    const auto [nx, ny] = next[static_cast<std::size_t>(rng.below(next.size()))];
    at(wall, std::min(x, nx), std::min(y, ny))[nx != x ? 0 : 1] = false;
    at(seen, nx, ny) = true;
    way.emplace_back(nx, ny);
  }
  const double half_m = 0.5 * kWall_m;
  for (int x = 0; x < kCells; ++x) {
    for (int y = 0; y < kCells; ++y) {
      const double right_m = (x + 1) * pitch_m;
      const double back_m = (y + 1) * pitch_m;
      if (x + 1 < kCells && at(wall, x, y)[0])
        add_wall(world, right_m - half_m, back_m - pitch_m - half_m, right_m + half_m, back_m + half_m);
      if (y + 1 < kCells && at(wall, x, y)[1])
        add_wall(world, right_m - pitch_m - half_m, back_m - half_m, right_m + half_m, back_m + half_m);
    }
  }
  add_wall(world, -half_m, -half_m, half_m, size_m + half_m);
  add_wall(world, size_m - half_m, -half_m, size_m + half_m, size_m + half_m);
  add_wall(world, -half_m, -half_m, size_m + half_m, half_m);
  add_wall(world, -half_m, size_m - half_m, size_m + half_m, size_m + half_m);
  return world;
}

WorldDescription make_trap(CounterRng& rng, const WorldMakerOptions& options) {
  const double depth_m = options.size_m.value_or(snapped(between(rng, 20.0, 60.0)));
  const double half_m = snapped(between(rng, 5.0, 10.0));
  const double aside_m = snapped(between(rng, -0.5, 0.5) * half_m);
  WorldDescription world = open_world(depth_m + 30.0, half_m + 25.0);
  const double x0_m = 8.0;
  const double x1_m = x0_m + depth_m;
  add_wall(world, x0_m, aside_m - half_m - kWall_m, x1_m, aside_m - half_m);
  add_wall(world, x0_m, aside_m + half_m, x1_m, aside_m + half_m + kWall_m);
  add_wall(world, x1_m, aside_m - half_m - kWall_m, x1_m + kWall_m, aside_m + half_m + kWall_m);
  return world;
}

WorldDescription make_walls(CounterRng& rng, const WorldMakerOptions& options) {
  const auto count = 1 + static_cast<int>(rng.below(3));
  WorldDescription world = open_world(40.0 + 20.0 * count, 55.0);
  for (int i = 0; i < count; ++i) {
    const double width_m = options.size_m.value_or(snapped(between(rng, 14.0, 60.0)));
    // The straight way meets it, and ten metres are free at least on both sides.
    const double most_m = std::min(0.4 * width_m, 45.0 - 0.5 * width_m);
    const double middle_m = snapped(between(rng, -1.0, 1.0) * std::max(most_m, 0.0));
    const double x_m = 20.0 + 20.0 * i;
    add_wall(world, x_m, middle_m - 0.5 * width_m, x_m + 0.6, middle_m + 0.5 * width_m);
  }
  return world;
}

/// Three walls from side to side, with an opening each: full height, or a window as high as it is wide.
WorldDescription make_openings(CounterRng& rng, double width_m, bool window) {
  WorldDescription world = open_world(60.0, 15.0);
  for (int i = 0; i < 3; ++i) {
    const double x_m = 15.0 + 15.0 * i;
    const double y_m = snapped(between(rng, -10.0, 10.0));
    const double z_m = snapped(between(rng, kLow_m + 0.5, kHigh_m - 1.5));
    const double half_m = 0.5 * width_m;
    add_wall(world, x_m, -16.0, x_m + kWall_m, y_m - half_m);
    add_wall(world, x_m, y_m + half_m, x_m + kWall_m, 16.0);
    if (!window) continue;
    if (z_m > half_m) add_wall(world, x_m, y_m - half_m, x_m + kWall_m, y_m + half_m, z_m - half_m);
    world.boxes.push_back({{x_m, y_m - half_m, z_m + half_m}, {x_m + kWall_m, y_m + half_m, kTop_m}});
  }
  return world;
}

WorldDescription make_wires(CounterRng& rng, double spacing_m) {
  WorldDescription world = open_world(40.0, 15.0);
  for (double x_m = 6.0; x_m < 36.0; x_m += spacing_m) {
    const double at_m = x_m + between(rng, -0.25, 0.25) * spacing_m;
    const double z_m = between(rng, kLow_m + 0.5, kHigh_m - 0.5);
    constexpr std::array<double, 3> kRadius_m{0.01, 0.025, 0.05};
    const double r = kRadius_m[static_cast<std::size_t>(rng.below(kRadius_m.size()))];
    world.boxes.push_back({{at_m - r, -16.0, z_m - r}, {at_m + r, 16.0, z_m + r}});
  }
  return world;
}

WorldDescription make_office(CounterRng& rng, double radius_m, double door_m) {
  constexpr int kRooms = 6;        // in a row
  constexpr double kRoom_m = 8.0;  // between the middles of walls
  constexpr double kCeiling_m = 3.6;
  const double corridor_m = std::max(door_m, 3.2);
  const double half_m =
      snapped(0.5 * corridor_m + 0.1) + 0.5 * kWall_m;  // to the middle of the corridor's walls
  const double length_m = kRooms * kRoom_m;
  const double outside_m = half_m + kRoom_m;
  WorldDescription world;
  world.bounds_W = {{0.0, -outside_m, radius_m + 0.3}, {length_m, outside_m, kCeiling_m - radius_m - 0.1}};
  const double cruise_m = 1.8;
  world.start_W = {0.5 * kRoom_m, -half_m - 0.5 * kRoom_m, cruise_m};
  world.goal_W = {length_m - 0.5 * kRoom_m, half_m + 0.5 * kRoom_m, cruise_m};
  const double w = 0.5 * kWall_m;
  world.boxes.push_back({{-w, -outside_m - w, kCeiling_m}, {length_m + w, outside_m + w, kCeiling_m + 0.3}});
  const auto wall = [&](double x0, double y0, double x1, double y1) {
    add_wall(world, x0, y0, x1, y1, kCeiling_m);
  };
  wall(-w, -outside_m - w, w, outside_m + w);
  wall(length_m - w, -outside_m - w, length_m + w, outside_m + w);
  for (const double side : {-1.0, 1.0}) {
    const double y_m = side * half_m;
    wall(-w, side * outside_m - w, length_m + w, side * outside_m + w);
    double from_m = -w;
    for (int i = 0; i < kRooms; ++i) {
      // A door to the corridor, and now and then one to the next room.
      const double middle_m = (i + 0.5) * kRoom_m;
      const double door_at_m = snapped(middle_m + between(rng, -0.5, 0.5) * (kRoom_m - door_m - 1.0));
      wall(from_m, y_m - w, door_at_m - 0.5 * door_m, y_m + w);
      from_m = door_at_m + 0.5 * door_m;
      const double right_m = (i + 1) * kRoom_m;
      const double low_m = side < 0.0 ? -outside_m : half_m;
      const bool opens = rng.uniform() < 0.3;
      if (i + 1 < kRooms && !opens) wall(right_m - w, low_m, right_m + w, low_m + kRoom_m);
      if (i + 1 < kRooms && opens) {
        const double at_m = snapped(low_m + 0.5 * kRoom_m);
        wall(right_m - w, low_m, right_m + w, at_m - 0.5 * door_m);
        wall(right_m - w, at_m + 0.5 * door_m, right_m + w, low_m + kRoom_m);
      }
      // A cupboard at the wall across from the door.
      const double cupboard_m = middle_m + between(rng, -2.5, 2.5);
      const double depth_m = between(rng, 0.4, 0.8);
      const double deep_m = side * (outside_m - w);
      wall(cupboard_m - 0.6, std::min(deep_m, deep_m - side * depth_m), cupboard_m + 0.6,
           std::max(deep_m, deep_m - side * depth_m));
    }
    wall(from_m, y_m - w, length_m + w, y_m + w);
  }
  return world;
}

/// What is free is a row of balls, and what is not are columns of rock between them.
WorldDescription make_cave(CounterRng& rng, double width_m) {
  constexpr double kLength_m = 60.0;
  constexpr double kColumn_m = 0.5;
  constexpr double kRoof_m = 16.0;
  constexpr double kStep_m = 0.5;
  std::vector<Ball> rooms;
  const auto dig = [&](Vector3 from_W, double length_m, double side) {
    const double turn = between(rng, 0.0, 2.0 * core::kPi);
    const double sway_m = between(rng, 3.0, 6.0);
    const double climb_m = between(rng, 0.5, 1.5);
    const double start_y = from_W.y() - sway_m * core::sin(turn);
    const double start_z = from_W.z() - climb_m * core::sin(2.0 * turn);
    for (double s_m = 0.0; s_m <= length_m; s_m += kStep_m) {
      const double phase = turn + s_m / 6.0;
      const Vector3 at_W(from_W.x() + s_m, start_y + sway_m * core::sin(phase) + side * s_m,
                         start_z + climb_m * core::sin(2.0 * phase));
      rooms.push_back({at_W, 0.5 * width_m * (1.0 + 0.4 * rng.uniform()) + kColumn_m});
    }
  };
  const Vector3 start_W(0.0, 0.0, 7.0);
  dig(start_W, kLength_m, 0.0);
  const Vector3 goal_W = rooms.back().center_W;
  for (const double side : {-0.8, 0.8}) {
    const auto from = static_cast<std::size_t>(between(rng, 0.2, 0.6) * static_cast<double>(rooms.size()));
    dig(rooms[from].center_W, between(rng, 12.0, 20.0), side);
  }
  rooms.push_back({start_W, 0.5 * width_m + 1.0});
  rooms.push_back({goal_W, 0.5 * width_m + 1.0});

  WorldDescription world;
  world.start_W = start_W;
  world.goal_W = goal_W;
  Aabb all{start_W, start_W};
  for (const Ball& room : rooms) {
    const Vector3 reach = Vector3::Constant(room.radius_m + kColumn_m);
    all = {all.min_W.cwiseMin(room.center_W - reach), all.max_W.cwiseMax(room.center_W + reach)};
  }
  world.bounds_W = {{std::floor(all.min_W.x()), std::floor(all.min_W.y()), kLow_m},
                    {std::ceil(all.max_W.x()), std::ceil(all.max_W.y()), kRoof_m - 1.0}};
  const Aabb& b = world.bounds_W;
  for (double y_m = b.min_W.y(); y_m < b.max_W.y(); y_m += kColumn_m) {
    for (double x_m = b.min_W.x(); x_m < b.max_W.x(); x_m += kColumn_m) {
      std::vector<std::pair<double, double>> free;
      for (const Ball& room : rooms) {
        const double side_m = core::hypot2(x_m + 0.5 * kColumn_m - room.center_W.x(),
                                           y_m + 0.5 * kColumn_m - room.center_W.y());
        if (side_m >= room.radius_m) continue;
        const double half_m = std::sqrt(room.radius_m * room.radius_m - side_m * side_m);
        free.emplace_back(room.center_W.z() - half_m, room.center_W.z() + half_m);
      }
      std::sort(free.begin(), free.end());
      const auto rock = [&](double low_m, double high_m) {
        if (high_m - low_m < 1e-6) return;
        // One box with the column before, where that is as high.
        if (!world.boxes.empty()) {
          Aabb& last = world.boxes.back();
          if (last.max_W.x() == x_m && last.min_W.y() == y_m && last.min_W.z() == low_m &&
              last.max_W.z() == high_m) {
            last.max_W.x() = x_m + kColumn_m;
            return;
          }
        }
        world.boxes.push_back({{x_m, y_m, low_m}, {x_m + kColumn_m, y_m + kColumn_m, high_m}});
      };
      double from_m = 0.0;
      for (const auto& [low_m, high_m] : free) {
        rock(from_m, std::max(low_m, from_m));
        from_m = std::max(from_m, high_m);
      }
      rock(from_m, kRoof_m);
    }
  }
  return world;
}

double checked(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw InputError(fmt::format("--{}: {} must be from {} to {} m", name, value, low, high));
  return value;
}

void refuse_unused(WorldKind kind, const WorldMakerOptions& o) {
  const auto any_of = [kind](std::initializer_list<WorldKind> kinds) {
    return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
  };
  const auto name = kWorldKindName[static_cast<std::size_t>(kind)];
  using enum WorldKind;
  if (o.width_m && !any_of({kMaze, kGaps, kWindows, kOffice, kCave}))
    throw InputError(
        fmt::format("--width does not go with {}: must be maze, gaps, windows, office or cave", name));
  if (o.spacing_m && !any_of({kForest, kPoles, kWires}))
    throw InputError(fmt::format("--spacing does not go with {}: must be forest, poles or wires", name));
  if (o.size_m && !any_of({kTrap, kWalls}))
    throw InputError(fmt::format("--size does not go with {}: must be trap or walls", name));
}

}  // namespace

WorldKind world_kind_of(const std::string& name) {
  const auto found = std::find(kWorldKindName.begin(), kWorldKindName.end(), name);
  if (found == kWorldKindName.end())
    throw InputError(
        fmt::format("unknown kind of world '{}': must be {}", name, fmt::join(kWorldKindName, ", ")));
  return static_cast<WorldKind>(found - kWorldKindName.begin());
}

WorldDescription make_world(WorldKind kind, std::uint64_t seed, const WorldMakerOptions& o) {
  refuse_unused(kind, o);
  const double radius_m = checked("radius", o.radius_m, 0.01, 2.0);
  const auto width = [&](double otherwise_m, double low_m, double high_m) {
    return checked("width", o.width_m.value_or(otherwise_m), low_m, high_m);
  };
  const auto spacing = [&](double otherwise_m) {
    return checked("spacing", o.spacing_m.value_or(otherwise_m), 0.5, 20.0);
  };
  if (o.size_m) (void)checked("size", *o.size_m, 5.0, 80.0);
  const double opening_m = 2.0 * radius_m + 0.4;
  CounterRng rng(seed, 100 + static_cast<std::uint64_t>(kind));
  const auto made = [&]() -> WorldDescription {
    switch (kind) {
      case WorldKind::kForest:
        return scattered(rng, 60.0, spacing(3.5), 0.15, {});
      case WorldKind::kMaze:
        return make_maze(rng, width(5.6, 0.4, 20.0));
      case WorldKind::kTrap:
        return make_trap(rng, o);
      case WorldKind::kWalls:
        return make_walls(rng, o);
      case WorldKind::kGaps:
        return make_openings(rng, width(opening_m, 0.1, 8.0), false);
      case WorldKind::kWindows:
        return make_openings(rng, width(opening_m, 0.1, 8.0), true);
      case WorldKind::kPoles:
        return scattered(rng, 40.0, spacing(4.0), 0.0, {0.01, 0.025, 0.05});
      case WorldKind::kWires:
        return make_wires(rng, spacing(4.0));
      case WorldKind::kOffice:
        return make_office(rng, radius_m, width(opening_m, 0.1, 6.0));
      default:
        return make_cave(rng, width(2.0 * radius_m + 2.0, 0.5, 8.0));
    }
  };
  WorldDescription world = made();
  if (o.closed) {
    const Vector3& goal = world.goal_W;
    const double in_m = std::max(radius_m + 0.3, 1.2);
    const double out_m = in_m + 0.2;
    add_wall(world, goal.x() - out_m, goal.y() - out_m, goal.x() - in_m, goal.y() + out_m, 20.0);
    add_wall(world, goal.x() + in_m, goal.y() - out_m, goal.x() + out_m, goal.y() + out_m, 20.0);
    add_wall(world, goal.x() - out_m, goal.y() - out_m, goal.x() + out_m, goal.y() - in_m, 20.0);
    add_wall(world, goal.x() - out_m, goal.y() + in_m, goal.x() + out_m, goal.y() + out_m, 20.0);
  }
  return world;
}

std::string world_toml(const WorldDescription& world, const std::string& comment) {
  ROBORUN_ASSERT(world.balls.empty() && world.turned.empty() && world.mesh.empty() && world.voxels.empty() &&
                 world.bodies.empty() && world.ground_m == 0.0);
  const auto point = [](const Vector3& p) { return fmt::format("[{}, {}, {}]", p.x(), p.y(), p.z()); };
  std::string text = fmt::format("# {}\n[world]\nbounds = [{}, {}]\nstart = {}\ngoal = {}\n", comment,
                                 point(world.bounds_W.min_W), point(world.bounds_W.max_W),
                                 point(world.start_W), point(world.goal_W));
  for (const Pillar& p : world.pillars)
    text += fmt::format("\n[[pillar]]\nx = {}\ny = {}\nradius = {}\nbottom = {}\ntop = {}\n", p.x_m, p.y_m,
                        p.radius_m, p.bottom_m, p.top_m);
  for (const Aabb& box : world.boxes)
    text += fmt::format("\n[[box]]\nmin = {}\nmax = {}\n", point(box.min_W), point(box.max_W));
  return text;
}

}  // namespace roborun::sitl
