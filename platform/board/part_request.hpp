/// What a map, a planner or a memory of ways is made for, whoever makes it: the backends by name, a plugin, the reader's program.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/geometry/fence.hpp"
#include "core/geometry/vector.hpp"
#include "core/precision.hpp"
#include "core/vehicle_model.hpp"

namespace roborun::board {

/// What the map must be able to take.
struct ImageLimits {
  std::uint16_t width{}, height{};  ///< Pixels of the largest image, clouds' images included.
  double range_m{};                 ///< The farthest that a sensor sees.
  std::size_t frames{6};            ///< Most images of one scan.
  /// So many images of cameras see all around; 0: there are not enough of them. (BrickMap::Config)
  std::size_t all_around_frames{6};
  double vehicle_radius_m{VehicleModel{}.radius_m};  ///< Where the vehicle is, nothing else is.
  PrecisionLattice lattice{};                        ///< Precisions that are asked for.
  double thinnest_m{VehicleModel{}.thinnest_m};      ///< Must not be forgotten once it was seen.
};

struct PartRequest {
  Aabb map_bounds_W{};  ///< What the map must hold: the flight's bounds and a margin.
  ImageLimits images{};
  Aabb flight_bounds_W{};                  ///< The vehicle's centre stays inside.
  double room_m{VehicleModel{}.radius_m};  ///< Radius that is free wherever it flies, as slowly as it can.
  core::Fence fence{};                     ///< What it forbids is no way.
};

}  // namespace roborun::board
