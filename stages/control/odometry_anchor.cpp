#include "stages/control/odometry_anchor.hpp"

#include <cmath>

#include "core/geometry/yaw.hpp"
#include "core/range.hpp"

namespace roborun::stages {
namespace {

constexpr double kLengthTolerance = 0.01;

}  // namespace

OdometryAnchor::OdometryAnchor(const OdometryState& in_O, const PastStates::Past& then,
                               std::uint8_t reset_counter) noexcept
    : reset_counter_(reset_counter) {
  q_WO_ = core::turn_z(core::yaw_of(then.q_WB) - core::yaw_of(in_O.q));
  p_WO_ = then.p_WB - q_WO_.toRotationMatrix() * in_O.p_m;
}

OdometryState OdometryAnchor::in_W(const OdometryState& in_O) const noexcept {
  const Matrix3 R_WO = q_WO_.toRotationMatrix();
  return {p_WO_ + R_WO * in_O.p_m, (q_WO_ * in_O.q).normalized(), R_WO * in_O.v_mps};
}

Status read_odometry(const firmware_if::OdometrySample& s, OdometryState& in_O) noexcept {
  const Quaternion q(s.q_OB[0], s.q_OB[1], s.q_OB[2], s.q_OB[3]);
  in_O.p_m = {s.p_OB_m[0], s.p_OB_m[1], s.p_OB_m[2]};
  in_O.v_mps = {s.v_OB_mps[0], s.v_OB_mps[1], s.v_OB_mps[2]};
  const bool usable = is_finite(in_O.p_m) && is_finite(in_O.v_mps) && q.coeffs().allFinite() &&
                      std::fabs(q.norm() - 1.0) <= kLengthTolerance && core::is_sigma(s.sigma_position_m) &&
                      core::is_sigma(s.sigma_attitude_rad) && core::is_sigma(s.sigma_speed_mps);
  if (!usable) return Status::kInvalidArgument;
  in_O.q = q.normalized();
  return Status::kOk;
}

}  // namespace roborun::stages
