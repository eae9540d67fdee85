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

/// The quadrotor of platform/sitl on a minimum-snap stop with 4 m/s2 at its peak, as trajectories end, wind
/// and tracking error included: measured 0.109, 0.304, 1.110, 2.465, 4.342, 6.714, 9.619 m from 0.5, 1, 2, 3,
/// 4, 5, 6 m/s; rounded upwards. When the way is blocked it brakes harder: 0.144, 0.274, 0.767, 1.511, 2.512,
/// 3.772, 5.284 m (tests/platform/sitl/vehicle/stopping_test.cpp).
inline constexpr StoppingModel kSitlQuadrotorStopping{0.262, 0.03, 0.15};

}  // namespace roborun
