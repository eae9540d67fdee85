/// The heading of an attitude.
#pragma once

#include "core/geometry/math.hpp"
#include "core/geometry/vector.hpp"

namespace roborun::stages {

/// Of the body's forward axis, from x towards y, in (-pi, pi]. RT-safe: O(1).
[[nodiscard]] inline double yaw_of(const Quaternion& q) noexcept {
  const Matrix3 R = q.toRotationMatrix();
  return core::atan2(R(1, 0), R(0, 0));
}

}  // namespace roborun::stages
