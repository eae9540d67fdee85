/// Vectors, rotations, poses and boxes. Vocabulary of the whole project, hence directly in namespace roborun.
/// Frames: W world (ENU), B body (FLU), C camera (x forward along the optical axis, y left, z up).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace roborun {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Quaternion = Eigen::Quaterniond;

/// Where frame T sits in frame R: p_R = R_RT p_T + p_RT.
struct Pose {
  Matrix3 R_RT = Matrix3::Identity();
  Vector3 p_RT = Vector3::Zero();  ///< Metres.

  [[nodiscard]] Vector3 operator*(const Vector3& p_T) const noexcept { return R_RT * p_T + p_RT; }
  /// The inverse transform of a point: p_T = R_RT^T (p_R - p_RT).
  [[nodiscard]] Vector3 inverse_times(const Vector3& p_R) const noexcept {
    return R_RT.transpose() * (p_R - p_RT);
  }
};

/// Axis-aligned box in the world frame, metres. Empty if any min exceeds its max.
struct Aabb {
  Vector3 min_W = Vector3::Zero();
  Vector3 max_W = Vector3::Zero();

  [[nodiscard]] static Aabb around(const Vector3& center_W, double half_m) noexcept {
    return {center_W - Vector3::Constant(half_m), center_W + Vector3::Constant(half_m)};
  }
  [[nodiscard]] bool contains(const Vector3& p_W) const noexcept {
    return (p_W.array() >= min_W.array()).all() && (p_W.array() <= max_W.array()).all();
  }
  [[nodiscard]] Vector3 center() const noexcept { return 0.5 * (min_W + max_W); }
  [[nodiscard]] Vector3 size() const noexcept { return max_W - min_W; }
};

[[nodiscard]] inline bool is_finite(const Vector3& v) noexcept { return v.allFinite(); }

}  // namespace roborun
