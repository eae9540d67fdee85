/// What the sources of the estimator share.
#pragma once

#include <array>
#include <cmath>

#include "core/geometry/vector.hpp"
#include "firmware_if/gnss.hpp"

namespace roborun::stages {

inline Vector3 to_vector(const std::array<double, 3>& v) noexcept { return {v[0], v[1], v[2]}; }

/// Rotation by a small vector, to second order, normalised.
inline Quaternion small_rotation(const Vector3& angle_rad) noexcept {
  const Vector3 half = 0.5 * angle_rad;
  return Quaternion(1.0 - 0.5 * half.squaredNorm(), half.x(), half.y(), half.z()).normalized();
}

inline bool has_heading(const firmware_if::GnssFix& fix) noexcept {
  return std::isfinite(fix.heading_rad) && fix.sigma_heading_rad > 0.0;
}

inline double largest_sigma_m(const firmware_if::GnssFix& fix) noexcept {
  return std::fmax(fix.sigma_horizontal_m, fix.sigma_vertical_m);
}

}  // namespace roborun::stages
