/// What a map or a planner is made for, whoever makes it: the backends by name, a plugin, the reader's program.
#pragma once

#include <cstdint>

#include "core/geometry/vector.hpp"
#include "core/vehicle_model.hpp"

namespace roborun::board {

/// What the map must be able to take.
struct ImageLimits {
  std::uint16_t side_pixels{};                       ///< The longer side of the largest image.
  double range_m{};                                  ///< The farthest that a camera sees.
  double vehicle_radius_m{VehicleModel{}.radius_m};  ///< Where the vehicle is, nothing else is.
};

struct PartRequest {
  Aabb map_bounds_W{};  ///< What the map must hold: the flight's bounds and a margin.
  ImageLimits images{};
};

}  // namespace roborun::board
