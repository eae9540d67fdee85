// A wall 10 m in front of the origin, for sensors that look at it.
#pragma once

#include "core/geometry/vector.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

inline const Pose kAt5m{Matrix3::Identity(), Vector3(0.0, 0.0, 5.0)};

inline World one_wall() {
  WorldDescription d;
  d.bounds_W = {{-50.0, -50.0, 0.5}, {50.0, 50.0, 15.0}};
  d.start_W = {0.0, 0.0, 5.0};
  d.goal_W = {5.0, 0.0, 5.0};
  d.boxes = {{{10.0, -40.0, 0.0}, {11.0, 40.0, 40.0}}};
  return World(d);
}

}  // namespace roborun::sitl
