/// From thrust and torques to four motors.
#pragma once

#include "core/geometry/vector.hpp"
#include "core/vehicle_model.hpp"
#include "firmware_if/motors.hpp"

namespace roborun::stages {

/// Solves thrust and torque for the four motors. What does not fit is given up in this order: yaw, then
/// collective thrust (moved until the roll and pitch differences fit), then roll and pitch (scaled).
/// Non-finite input sets all four motors to zero. The result is always in [0, 1]. RT-safe: O(1).
[[nodiscard]] firmware_if::MotorCommand mix(const VehicleModel& vehicle, double thrust_N,
                                            const Vector3& torque_B_Nm) noexcept;

}  // namespace roborun::stages
