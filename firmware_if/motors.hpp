/// The four motors of a quadrotor, behind whatever carries the command (CAN, PWM, a simulator).
#pragma once

#include <array>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

/// Thrust ratio of each motor, 0 = stopped, 1 = full thrust. Order: front left, front right, rear left, rear
/// right. Front left and rear right turn clockwise seen from above (their reaction torque yaws the body
/// counter-clockwise).
struct MotorCommand {
  std::array<double, 4> thrust_ratio{};
};

/// Contract: command() neither blocks nor allocates. Values outside [0, 1] or not finite are refused with
/// kInvalidArgument and the previous command stays.
class Motors {
 public:
  virtual ~Motors() = default;
  [[nodiscard]] virtual Status command(const MotorCommand& command) noexcept = 0;
};

}  // namespace roborun::firmware_if
