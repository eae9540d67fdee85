#include "platform/sitl/autopilot/set_point_shaper.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::sitl {
namespace {

constexpr double kPosition_Hz = 1.0;  // PSC_POSXY_P
// Of the velocity, 1/s: chosen on the measured steps 0 -> 2, 2 -> 5 and 0 -> 9 m/s of ArduCopter.
constexpr double kVelocity_Hz = 1.6;
constexpr double kYawRate_radps = 1.24;  // 71 degrees a second, measured
constexpr double kYawAcceleration_radps2 = 8.0;
constexpr double kYaw_Hz = 6.0;

Vector3 limited(const Vector3& v, double most) noexcept {
  const double norm = v.norm();
  return norm > most ? Vector3(v * (most / norm)) : v;
}

/// The speed towards a target from which the acceleration stops in time.
double approach_mps(double distance_m, double acceleration_mps2) noexcept {
  const double linear_m = acceleration_mps2 / (kPosition_Hz * kPosition_Hz);
  if (distance_m <= linear_m) return kPosition_Hz * distance_m;
  return std::sqrt(2.0 * acceleration_mps2 * (distance_m - 0.5 * linear_m));
}

Vector3 towards(const Vector3& e_m, double acceleration_mps2) noexcept {
  const double distance_m = e_m.norm();
  if (distance_m < 1e-9) return Vector3::Zero();
  return Vector3(e_m * (approach_mps(distance_m, acceleration_mps2) / distance_m));
}

struct Axis {
  Vector3 p_W, v_W, a_W;
};

/// One of the two parts; the others' components are zero throughout.
void advance(Axis& s, const Axis& target, const Target& kind, double acceleration_mps2, double jerk_mps3,
             double dt_s) noexcept {
  Vector3 wanted_mps = kind.has_velocity ? target.v_W : Vector3(Vector3::Zero());
  if (kind.has_position) wanted_mps += towards(target.p_W - s.p_W, acceleration_mps2);
  Vector3 wanted_mps2 = limited(kVelocity_Hz * (wanted_mps - s.v_W), acceleration_mps2);
  if (kind.has_acceleration) wanted_mps2 += target.a_W;
  s.a_W += limited(limited(wanted_mps2, acceleration_mps2) - s.a_W, jerk_mps3 * dt_s);
  s.p_W += dt_s * s.v_W + (0.5 * dt_s * dt_s) * s.a_W;
  s.v_W += dt_s * s.a_W;
}

Vector3 level(const Vector3& v) noexcept { return {v.x(), v.y(), 0.0}; }
Vector3 upright(const Vector3& v) noexcept { return {0.0, 0.0, v.z()}; }

}  // namespace

void SetPointShaper::begin(const Vector3& p_W, const Vector3& v_W) noexcept {
  p_W_ = p_W;
  v_W_ = v_W;
  a_W_.setZero();
}

void SetPointShaper::step(double dt_s, const ShaperLimits& limits, Target& target) noexcept {
  if (target.has_position && target.has_velocity) target.p_W += dt_s * target.v_W;
  Axis side{level(p_W_), level(v_W_), level(a_W_)};
  advance(side, {level(target.p_W), level(target.v_W), level(target.a_W)}, target, limits.acceleration_mps2,
          limits.jerk_mps3, dt_s);
  Axis height{upright(p_W_), upright(v_W_), upright(a_W_)};
  advance(height, {upright(target.p_W), upright(target.v_W), upright(target.a_W)}, target,
          limits.climb_acceleration_mps2, limits.jerk_mps3, dt_s);
  if (target.has_position && !target.has_velocity) {
    side.v_W = limited(side.v_W, limits.speed_mps);
    height.v_W.z() = std::clamp(height.v_W.z(), -limits.descent_mps, limits.climb_mps);
  }
  p_W_ = side.p_W + height.p_W;
  v_W_ = side.v_W + height.v_W;
  a_W_ = side.a_W + height.a_W;
}

void YawShaper::turn_to(double yaw_rad, double dt_s) noexcept {
  turn_at(kYaw_Hz * core::wrap_angle(yaw_rad - yaw_rad_), dt_s);
}

void YawShaper::turn_at(double rate_radps, double dt_s) noexcept {
  const double wanted_radps = std::clamp(rate_radps, -kYawRate_radps, kYawRate_radps);
  const double most = kYawAcceleration_radps2 * dt_s;
  rate_radps_ += std::clamp(wanted_radps - rate_radps_, -most, most);
  yaw_rad_ = core::wrap_angle(yaw_rad_ + dt_s * rate_radps_);
}

}  // namespace roborun::sitl
