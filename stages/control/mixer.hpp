/// From thrust and torques to four motors.
#pragma once

#include "core/geometry/vector.hpp"
#include "firmware_if/motors.hpp"

namespace roborun::stages {

struct Airframe {
  double mass_kg{4.5};
  Vector3 inertia_kgm2{0.080, 0.080, 0.140};
  double arm_m{0.30};
  double max_thrust_N{24.5};   ///< One motor.
  double yaw_torque_m{0.018};  ///< Reaction torque per newton.
};

/// Solves thrust and torque for the four motors. What does not fit is given up in this order: yaw, then
/// collective thrust (moved until the roll and pitch differences fit), then roll and pitch (scaled).
/// Non-finite input: all motors at the last resort of equal thrust zero. Result always in [0, 1]. RT-safe:
/// O(1).
[[nodiscard]] firmware_if::MotorCommand mix(const Airframe& airframe, double thrust_N,
                                            const Vector3& torque_B_Nm) noexcept;

}  // namespace roborun::stages
