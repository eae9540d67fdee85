#include "platform/sitl/sensors/visual_odometry.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "platform/sitl/sensors/draws.hpp"

namespace roborun::sitl {
VisualOdometry::VisualOdometry(OdometryModel model, std::uint64_t seed) noexcept
    : model_(model), rng_(seed, 30) {
  scale_ = rng_.uniform() < 0.5 ? -errors_.scale_ratio : errors_.scale_ratio;
  climb_ = rng_.uniform() < 0.5 ? -errors_.climb_ratio : errors_.climb_ratio;
  reset_at_ = MonotonicTime{} + next_reset();
}

Nanos VisualOdometry::next_reset() noexcept {
  return from_seconds(errors_.reset_every_s * (0.5 + rng_.uniform()));
}

void VisualOdometry::follow(const VehicleState& state) noexcept {
  const double decay = core::exp(-1.0 / (errors_.rate_Hz * errors_.yaw_s));
  yaw_error_rad_ = decay * yaw_error_rad_ + std::sqrt(1.0 - decay * decay) * errors_.yaw_rad * rng_.normal();
  const Vector3 way_W = state.p_WB - last_W_;
  last_W_ = state.p_WB;
  p_O_ += core::turn_z(frame_yaw_rad_ + yaw_error_rad_).toRotationMatrix() * ((1.0 + scale_) * way_W);
  p_O_.z() += climb_ * way_W.norm();
}

void VisualOdometry::begin_anew(const VehicleState& state) noexcept {
  ++resets_;
  const Matrix3 R_WB = state.q_WB.toRotationMatrix();
  frame_yaw_rad_ = -core::yaw_of(R_WB);
  yaw_error_rad_ = 0.0;
  p_O_ = Vector3::Zero();
  reset_at_ = now_ + next_reset();
  next_ = now_ + from_seconds(errors_.silent_s);
}

void VisualOdometry::sample(MonotonicTime now, const VehicleState& state) noexcept {
  now_ = now;
  if (model_ == OdometryModel::kNone || now < next_) return;
  next_ = now + from_seconds(1.0 / errors_.rate_Hz);
  if (!begun_) p_O_ = last_W_ = state.p_WB;
  begun_ = true;
  follow(state);
  if (now >= reset_at_) return begin_anew(state);
  const OdometryErrors& e = errors_;
  const Quaternion q_OW = core::turn_z(frame_yaw_rad_ + yaw_error_rad_);
  const Vector3 tilt = normal3(rng_, 0.5 * e.attitude_rad);
  const Quaternion q_OB =
      (Quaternion(1.0, tilt.x(), tilt.y(), tilt.z()).normalized() * q_OW * state.q_WB).normalized();
  const Vector3 p_m = p_O_ + normal3(rng_, e.position_m);
  const Vector3 v_mps = q_OW.toRotationMatrix() * ((1.0 + scale_) * state.v_WB) + normal3(rng_, e.speed_mps);
  firmware_if::OdometrySample s;
  s.stamp = now;
  s.sequence = ++sequence_;
  s.reset_counter = resets_;
  s.p_OB_m = {p_m.x(), p_m.y(), p_m.z()};
  s.q_OB = {q_OB.w(), q_OB.x(), q_OB.y(), q_OB.z()};
  s.v_OB_mps = {v_mps.x(), v_mps.y(), v_mps.z()};
  s.sigma_position_m = e.said_m;
  s.sigma_attitude_rad = e.said_rad;
  s.sigma_speed_mps = e.said_mps;
  line_.push(s, now + from_seconds(e.latency_s));
}

}  // namespace roborun::sitl
