#include "stages/control/mixer.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace roborun::stages {
namespace {

// Front left, front right, rear left, rear right: sign of each motor's torque about x, y, z.
constexpr std::array<std::array<double, 3>, 4> kSign{{{1, -1, 1}, {-1, -1, -1}, {1, 1, -1}, {-1, 1, 1}}};

}  // namespace

firmware_if::MotorCommand mix(const VehicleModel& vehicle, double thrust_N,
                              const Vector3& torque_B_Nm) noexcept {
  firmware_if::MotorCommand command;
  if (!std::isfinite(thrust_N) || !is_finite(torque_B_Nm)) return command;

  const double max_N = vehicle.max_thrust_N;
  std::array<double, 4> tilt_N{};
  double low_N = 0.0;
  double high_N = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    tilt_N[i] = (kSign[i][0] * torque_B_Nm.x() + kSign[i][1] * torque_B_Nm.y()) / (4.0 * vehicle.arm_m);
    low_N = std::min(low_N, tilt_N[i]);
    high_N = std::max(high_N, tilt_N[i]);
  }
  const double scale = high_N - low_N > max_N ? max_N / (high_N - low_N) : 1.0;
  const double base_N = std::clamp(0.25 * thrust_N, -scale * low_N, max_N - scale * high_N);

  // Yaw gets what the worst motor has left.
  const double yaw_N = torque_B_Nm.z() / (4.0 * vehicle.yaw_torque_m);
  double share = 1.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double at_N = base_N + scale * tilt_N[i];
    const double wanted_N = kSign[i][2] * yaw_N;
    if (wanted_N > 0.0) share = std::min(share, std::max(max_N - at_N, 0.0) / wanted_N);
    if (wanted_N < 0.0) share = std::min(share, std::max(at_N, 0.0) / -wanted_N);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const double motor_N = base_N + scale * tilt_N[i] + share * kSign[i][2] * yaw_N;
    command.thrust_ratio[i] = std::clamp(motor_N / max_N, 0.0, 1.0);
  }
  return command;
}

}  // namespace roborun::stages
