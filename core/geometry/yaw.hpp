/// Headings: of an attitude, and turns about the vertical.
#pragma once

#include "core/geometry/math.hpp"
#include "core/geometry/vector.hpp"

namespace roborun::core {

/// Of the body's forward axis, from x towards y, in (-pi, pi]. RT-safe: O(1).
[[nodiscard]] inline double yaw_of(const Matrix3& R_WB) noexcept { return atan2(R_WB(1, 0), R_WB(0, 0)); }
[[nodiscard]] inline double yaw_of(const Quaternion& q_WB) noexcept {
  return yaw_of(q_WB.toRotationMatrix());
}

/// A turn from x towards y. RT-safe: O(1).
[[nodiscard]] inline Quaternion turn_z(double angle_rad) noexcept {
  const SinCos half = sin_cos(0.5 * angle_rad);
  return {half.cos, 0.0, 0.0, half.sin};
}

}  // namespace roborun::core
