/// From thrust and torques to four motors.
#pragma once

#include "core/geometry/vector.hpp"
#include "core/range.hpp"
#include "firmware_if/motors.hpp"
#include "firmware_if/status.hpp"

namespace roborun::stages {

/// The rigid body and its motors. The defaults are the vehicle of RoboRun's simulation in its size.
struct Airframe {
  double mass_kg{4.5};                        ///< (0, 1000]. With battery and package.
  Vector3 inertia_kgm2{0.080, 0.080, 0.140};  ///< Each (0, 1000]. About the axes of the body.
  double arm_m{0.30};                         ///< (0, 10]. From the centre to a motor along x and along y.
  double max_thrust_N{24.5};                  ///< (0, 10000]. One motor: four of them lift twice the mass.
  double yaw_torque_m{0.018};                 ///< (0, 1]. Reaction torque per newton of thrust.
  [[nodiscard]] Status validate() const noexcept {
    const bool ok = core::above(mass_kg, 0.0, 1000.0) && inertia_kgm2.minCoeff() > 0.0 &&
                    inertia_kgm2.maxCoeff() <= 1000.0 && core::above(arm_m, 0.0, 10.0) &&
                    core::above(max_thrust_N, 0.0, 10000.0) && core::above(yaw_torque_m, 0.0, 1.0);
    return ok ? Status::kOk : Status::kInvalidArgument;
  }
};

/// Solves thrust and torque for the four motors. What does not fit is given up in this order: yaw, then
/// collective thrust (moved until the roll and pitch differences fit), then roll and pitch (scaled).
/// Non-finite input sets all four motors to zero. The result is always in [0, 1]. RT-safe: O(1).
[[nodiscard]] firmware_if::MotorCommand mix(const Airframe& airframe, double thrust_N,
                                            const Vector3& torque_B_Nm) noexcept;

}  // namespace roborun::stages
