/// Whether a world has a way at all, how wide and how long: the yardstick of every flight in it. It knows the true world and
/// shares no code with the map, the planner, or anything that flies.
///
/// Positions are looked at on a lattice of `resolution_m`, whose clearances are exact; between its points the straight way is
/// divided until its ends prove it free. So a way that is found is one (to 1 cm), its length is an upper bound (any-angle: 0
/// to 3 % above the shortest, measured on shapes with known answers), and a passage that is wider than the vehicle by less
/// than about a resolution may be overlooked, unless it is centred on the lattice.
/// Sources: Nash, Koenig, Tovey, Lazy Theta* (2010); the widest path by Dijkstra's algorithm.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

struct WayQuestion {
  double radius_m{};  ///< Of what flies, its margin included. (0, 10]
  double resolution_m{
      0.0};  ///< 0: 0.2 m, or less: a third of the radius; in large worlds coarser, where that finds a way.
  /// Called now and then with the number of places looked at; may be empty.
  std::function<void(std::uint64_t)> progress{};
};

struct WayVerdict {
  bool way{};                     ///< From start to goal for the radius, inside the bounds.
  double narrowest_m{};           ///< Diameter of the largest ball that gets from start to goal, at most
                                  ///< 2 kWidest_m; 0: none larger than about a resolution does.
  double shortest_m{};            ///< Length of the way for the radius; +infinity without one.
  std::vector<Vector3> way_W;     ///< The shortest, corner by corner; empty without one.
  std::vector<Vector3> widest_W;  ///< That of the largest ball.
  Vector3 narrowest_W = Vector3::Zero();  ///< Where that is narrowest.
  double resolution_m{};
  std::uint64_t places{};  ///< Looked at.
};

inline constexpr double kWidest_m = 3.0;  ///< Half of it is not told from more.
inline constexpr double kMostPlaces =
    40e6;  ///< Of the lattice in the world's bounds, unless a resolution is asked for.

/// Seconds for 300 x 100 x 10 m. Throws InputError for a radius or resolution out of range.
[[nodiscard]] WayVerdict judge_way(const World& world, const WayQuestion& question);

}  // namespace roborun::sitl
