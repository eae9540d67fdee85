/// Where a camera is when its vehicle is somewhere.
#pragma once

#include "core/geometry/vector.hpp"
#include "firmware_if/depth_camera.hpp"

namespace roborun::core {

/// Pose of the camera frame C in the world, X_WC, for a vehicle at X_WB. RT-safe.
[[nodiscard]] inline Pose camera_pose(const Pose& X_WB, const firmware_if::CameraMount& mount) noexcept {
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Matrix3 R_BC = Eigen::Map<const RowMajor3>(mount.R_BC.data());
  const Vector3 p_BC = Eigen::Map<const Vector3>(mount.p_BC_m.data());
  return {X_WB.R_RT * R_BC, X_WB * p_BC};
}

}  // namespace roborun::core
