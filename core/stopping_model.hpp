/// How far the vehicle travels until it stands. Source: RoboRun Eq. 2 (printed there with the wrong sign).
#pragma once

#include "core/range.hpp"
#include "firmware_if/status.hpp"

namespace roborun {

/// d_stop(v) = quadratic v^2 + linear v + constant, at least 0.
struct StoppingModel {
  double quadratic_s2pm{};  ///< [0, 10]. Braking with a m/s2 at once: 1 / 2a.
  double linear_s{};        ///< [0, 10]. The time until the brake bites.
  double constant_m{};      ///< [-10, 10]. A fit may be negative at standstill.
  [[nodiscard]] constexpr Status validate() const noexcept {
    const bool ok = core::within(quadratic_s2pm, 0.0, 10.0) && core::within(linear_s, 0.0, 10.0) &&
                    core::within(constant_m, -10.0, 10.0);
    return ok ? Status::kOk : Status::kInvalidArgument;
  }

  /// 0 for a negative speed; NaN gives +infinity: an unknown speed never stops. RT-safe: O(1).
  [[nodiscard]] double distance_m(double speed_mps) const noexcept;
};

/// The authors' simulated drone, fitted on (v m/s, m): (0.995, 0.266) (1.975, 0.598) (3.921, 2.162)
/// (5.834, 3.539) (7.712, 5.985) (9.563, 8.151). Relative mean squared error 1.65 %.
inline constexpr StoppingModel kRoborunStopping{0.05494, 0.3549, -0.2038};

/// The quadrotor of platform/sitl on a stop with 4 m/s2 and 15 m/s3, as trajectories end, wind and tracking error
/// included: measured 0.166, 0.313, 0.835, 1.612, 2.639, 3.917, 5.445 m from 0.5, 1, 2, 3, 4, 5, 6 m/s
/// (tests/platform/sitl/vehicle/stopping_test.cpp); rounded upwards.
inline constexpr StoppingModel kSitlQuadrotorStopping{0.127, 0.18, 0.14};

}  // namespace roborun
