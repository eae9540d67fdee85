/// How an autopilot moves its target: limited in acceleration and jerk, towards a position, a velocity, or both.
#pragma once

#include "core/geometry/vector.hpp"
#include "core/trajectory.hpp"

namespace roborun::sitl {

/// What a set-point asks for; world frame (ENU).
struct Target {
  bool has_position{false}, has_velocity{false}, has_acceleration{false};
  Vector3 p_W = Vector3::Zero();
  Vector3 v_W = Vector3::Zero();
  Vector3 a_W = Vector3::Zero();
  [[nodiscard]] static Target stop() noexcept {
    Target target;
    target.has_velocity = true;
    return target;
  }
  [[nodiscard]] static Target at(const Vector3& p_W) noexcept {
    Target target;
    target.has_position = true;
    target.p_W = p_W;
    return target;
  }
};

struct ShaperLimits {
  double acceleration_mps2{2.5};
  double climb_acceleration_mps2{1.0};
  double jerk_mps3{5.0};
  double speed_mps{10.0};  ///< Towards positions alone, as the two below.
  double climb_mps{2.5};
  double descent_mps{1.5};
};

/// v_d = v + c(p - p_s), a_d = a + k (v_d - v_s) within the acceleration, and a_s follows a_d within the jerk; p_s, v_s,
/// a_s are what the vehicle is then led along. c(e) = P e near the target, and what the acceleration can stop in, farther
/// away. Horizontal and vertical apart.
class SetPointShaper {
 public:
  /// At rest in the sense of the accelerations.
  void begin(const Vector3& p_W, const Vector3& v_W) noexcept;
  /// The target moves on with its velocity. RT-safe: O(1), no allocation.
  void step(double dt_s, const ShaperLimits& limits, Target& target) noexcept;
  [[nodiscard]] const Vector3& p_W() const noexcept { return p_W_; }
  [[nodiscard]] const Vector3& v_W() const noexcept { return v_W_; }
  [[nodiscard]] const Vector3& a_W() const noexcept { return a_W_; }

 private:
  Vector3 p_W_ = Vector3::Zero();
  Vector3 v_W_ = Vector3::Zero();
  Vector3 a_W_ = Vector3::Zero();
};

/// A heading that turns with limited rate and acceleration.
class YawShaper {
 public:
  void begin(double yaw_rad) noexcept {
    yaw_rad_ = yaw_rad;
    rate_radps_ = 0.0;
  }
  void turn_to(double yaw_rad, double dt_s) noexcept;
  void turn_at(double rate_radps, double dt_s) noexcept;
  [[nodiscard]] double yaw_rad() const noexcept { return yaw_rad_; }

 private:
  double yaw_rad_{0.0};
  double rate_radps_{0.0};
};

}  // namespace roborun::sitl
