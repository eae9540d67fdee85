/// Where a ray is inside a box along the axes.
#pragma once

#include <algorithm>

#include "core/geometry/vector.hpp"
#include "platform/sitl/world/voxel_grid.hpp"

namespace roborun::sitl {

/// Distances along the ray, in lengths of its direction. Outside: enter_m is +infinity, or above leave_m.
struct RaySpan {
  double enter_m{0.0};  ///< 0 if it begins inside.
  double leave_m{kInfinity};
};
[[nodiscard]] inline RaySpan span_in(const Aabb& box, const Vector3& o, const Vector3& d) noexcept {
  RaySpan span;
  for (int i = 0; i < 3; ++i) {
    if (d[i] == 0.0) {
      if (o[i] < box.min_W[i] || o[i] > box.max_W[i]) return {kInfinity, 0.0};
      continue;
    }
    const double t0 = (box.min_W[i] - o[i]) / d[i];
    const double t1 = (box.max_W[i] - o[i]) / d[i];
    span.enter_m = std::max(span.enter_m, std::min(t0, t1));
    span.leave_m = std::min(span.leave_m, std::max(t0, t1));
  }
  return span;
}

}  // namespace roborun::sitl
