/// What a map or a planner is made for, whoever makes it: the backends by name, a plugin, the reader's program.
#pragma once

#include <cstdint>

#include "core/geometry/vector.hpp"

namespace roborun::board {

/// What the map must be able to take.
struct ImageLimits {
  std::uint16_t side_pixels{};  ///< The longer side of the largest image.
  double range_m{};             ///< The farthest that a camera sees.
};

struct PartRequest {
  Aabb map_bounds_W{};  ///< What the map must hold: the flight's bounds and a margin.
  ImageLimits images{};
};

}  // namespace roborun::board
