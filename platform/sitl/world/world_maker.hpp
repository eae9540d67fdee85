/// Hard worlds, made from a seed: the same on every machine. Mazes and dead ends for the memory of ways, forests, gaps and
/// windows for tight places, thin things for the sensors.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

enum class WorldKind : std::uint8_t {
  kForest,  ///< 60 m through trees, one per square of `spacing_m` (3.5), moved aside at random.
  kMaze,    ///< 8 x 8 cells of `width_m` (5.6), one way between any two, walls to above the bounds.
  kTrap,    ///< A U of `size_m` (20 to 60, by the seed) depth, open towards the start; the goal is behind it.
  kWalls,   ///< One to three walls `size_m` (14 to 60) wide across the way, free on both sides.
  kGaps,    ///< Three walls from side to side, a gap of `width_m` (2 radius + 0.4) in each.
  kWindows,  ///< The same with a window, as high as wide.
  kPoles,    ///< 40 m through upright poles of 2, 5 and 10 cm diameter, one per square of `spacing_m` (4).
  kWires,    ///< 40 m across level wires of 2, 5 and 10 cm, one per `spacing_m` (4) of the way.
  kOffice,   ///< Two rows of rooms along a corridor under a ceiling; doors of `width_m` (2 radius + 0.4).
  kCave,     ///< A winding tunnel with two dead ends, at least `width_m` (2 radius + 2) wide.
};
inline constexpr std::array<std::string_view, 10> kWorldKindName{
    "forest", "maze", "trap", "walls", "gaps", "windows", "poles", "wires", "office", "cave"};
/// By name. Throws InputError that lists them.
[[nodiscard]] WorldKind world_kind_of(const std::string& name);

struct WorldMakerOptions {
  double radius_m{0.6};             ///< Of the vehicle: default widths follow it. (0, 2]
  std::optional<double> width_m;    ///< (0, 20]. Of openings, corridors, tunnels.
  std::optional<double> spacing_m;  ///< [0.5, 20]. Of trees, poles, wires.
  std::optional<double> size_m;     ///< [5, 80]. Of traps and walls.
  bool closed{false};               ///< Four walls stand around the goal: there is no way.
};

/// With bounds, start and goal, around which it is free. Openings are centred on multiples of 0.2 m, where way_judge looks.
/// Throws InputError for an option out of range, or one that this kind has no use for.
[[nodiscard]] WorldDescription make_world(WorldKind kind, std::uint64_t seed,
                                          const WorldMakerOptions& options);

/// The text of a world file. Precondition: nothing but pillars and boxes on the ground z = 0.
[[nodiscard]] std::string world_toml(const WorldDescription& world, const std::string& comment);

}  // namespace roborun::sitl
