#include "stages/control/tracker.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::stages {
namespace {

Vector3 clamp_norm(const Vector3& v, double limit) noexcept {
  const double norm = v.norm();
  return norm > limit ? Vector3(v * (limit / norm)) : v;
}

/// What holds against drag in still air: an integral alone would learn it after every change of speed.
Vector3 drag_W_mps2(const VehicleModel& v, const Vector3& v_W) noexcept {
  return (v.drag_linear_Nspm + v.drag_quadratic_Ns2pm2 * v_W.norm()) / v.mass_kg * v_W;
}

}  // namespace

Tracker::Config Tracker::config_for(const VehicleModel& vehicle, double period_s) noexcept {
  constexpr double kTunedLag_s = 0.040;
  const double quicker = std::clamp(kTunedLag_s / vehicle.motor_lag_s, 0.4, 2.5);
  Config config;
  config.vehicle = vehicle;
  config.position_gain_Hz *= quicker;
  config.velocity_gain_Hz *= quicker;
  config.velocity_integral_Hz2 *= quicker * quicker;
  config.attitude_gain_Hz *= quicker;
  config.rate_gain_Hz *= quicker;
  config.integral_limit_mps2 =
      std::clamp(1.2 * drag_mps2(vehicle, vehicle.speed_mps), config.integral_limit_mps2, 10.0);
  config.period_s = period_s;
  return config;
}

Vector3 Tracker::acceleration_W(const Input& in) noexcept {
  const Vector3 correction =
      clamp_norm(config_.position_gain_Hz * (in.reference.p_W - in.state.p_WB), config_.correction_limit_mps);
  const Vector3 error_W_mps = in.reference.v_W + correction - in.state.v_WB;
  integral_W_mps2_ =
      clamp_norm(integral_W_mps2_ + config_.velocity_integral_Hz2 * config_.period_s * error_W_mps,
                 config_.integral_limit_mps2);
  Vector3 a_W = in.reference.a_W + drag_W_mps2(config_.vehicle, in.reference.v_W) +
                config_.velocity_gain_Hz * error_W_mps + integral_W_mps2_;
  // Never ask for less than half of hover thrust: attitude needs something to work with.
  a_W.z() = std::clamp(a_W.z(), -0.5 * core::kGravity_mps2, 0.6 * core::kGravity_mps2);
  const core::SinCos tilt = core::sin_cos(config_.vehicle.tilt_rad);
  const double side_limit = (core::kGravity_mps2 + a_W.z()) * tilt.sin / tilt.cos;
  const double side = core::hypot2(a_W.x(), a_W.y());
  if (side > side_limit) {
    a_W.x() *= side_limit / side;
    a_W.y() *= side_limit / side;
    ++counters_.tilt_limited;
  }
  return a_W;
}

Status Tracker::step(const Input& in, firmware_if::MotorCommand& out) noexcept {
  const bool finite = is_finite(in.state.p_WB) && is_finite(in.state.v_WB) && is_finite(in.state.w_WB_B) &&
                      in.state.q_WB.coeffs().allFinite() && is_finite(in.reference.p_W) &&
                      is_finite(in.reference.v_W) && is_finite(in.reference.a_W) &&
                      is_finite(in.reference.j_W) && std::isfinite(in.yaw_rad);
  if (!finite) {
    ++counters_.refused;
    return Status::kInvalidArgument;
  }
  ++counters_.steps;
  const VehicleModel& vehicle = config_.vehicle;
  const Vector3 inertia_kgm2 = vehicle.inertia_kgm2();
  const Vector3 force_W = acceleration_W(in) + Vector3(0.0, 0.0, core::kGravity_mps2);
  const Matrix3 R_WB = in.state.q_WB.toRotationMatrix();

  const core::SinCos yaw = core::sin_cos(core::wrap_angle(in.yaw_rad));
  const Vector3 z_W = force_W / force_W.norm();
  const Vector3 y_W = z_W.cross(Vector3(yaw.cos, yaw.sin, 0.0)).normalized();
  Matrix3 R_WD;
  R_WD.col(0) = y_W.cross(z_W);
  R_WD.col(1) = y_W;
  R_WD.col(2) = z_W;

  const Matrix3 error = R_WD.transpose() * R_WB;
  const Vector3 error_B(0.5 * (error(2, 1) - error(1, 2)), 0.5 * (error(0, 2) - error(2, 0)),
                        0.5 * (error(1, 0) - error(0, 1)));
  // The jerk of the trajectory turns the thrust vector at a known rate.
  const Vector3 turn_W = (in.reference.j_W - z_W * z_W.dot(in.reference.j_W)) / force_W.norm();
  const Vector3 feed_B(-turn_W.dot(R_WB.col(1)), turn_W.dot(R_WB.col(0)), 0.0);
  const Vector3 rate_B = feed_B - config_.attitude_gain_Hz * error_B.cwiseProduct(Vector3(1.0, 1.0, 0.4));

  const Vector3 momentum = inertia_kgm2.cwiseProduct(in.state.w_WB_B);
  const Vector3 torque_B = config_.rate_gain_Hz * inertia_kgm2.cwiseProduct(rate_B - in.state.w_WB_B) +
                           in.state.w_WB_B.cross(momentum);
  const double thrust_N = vehicle.mass_kg * std::max(force_W.dot(R_WB.col(2)), 0.0);
  out = mix(vehicle, thrust_N, torque_B);
  return Status::kOk;
}

}  // namespace roborun::stages
