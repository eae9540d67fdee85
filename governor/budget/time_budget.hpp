/// How long the vehicle can afford to think. Source: RoboRun Eq. 1 and Algorithm 1.
#pragma once

#include <span>

#include "core/space_profile.hpp"
#include "core/stopping_model.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::governor {

struct BudgetLimits {
  Nanos shortest{50'000'000};     ///< > 0. Below this nothing useful can be decided.
  Nanos longest{15'000'000'000};  ///< >= shortest. What a standing vehicle gets; the authors' cap.
  [[nodiscard]] constexpr Status validate() const noexcept {
    return shortest > Nanos{0} && longest >= shortest ? Status::kOk : Status::kInvalidArgument;
  }
};

/// Eq. 1: budget = (visible - d_stop(v)) / v, clamped to `limits`.
/// Every input has an answer: NaN in either argument gives the shortest (an unknown distance is a near one),
/// standstill the longest if anything is visible.
/// Precondition, asserted: limits.validate() is kOk. RT-safe: O(1).
[[nodiscard]] Nanos time_budget(double visible_m, double speed_mps, const StoppingModel& model,
                                const BudgetLimits& limits) noexcept;

/// Algorithm 1, exact. With b(s) = Eq. 1 at the point of the trajectory that is reached after s (speed and
/// visibility linear between the samples, the last one held), the algorithm's running minimum has the closed
/// form
///     budget = min over s >= 0 of (s + max(b(s), 0))
/// at no earlier instant of following the trajectory does the remaining budget run out. Whole segments are
/// not needed, and nothing is lost after the last way-point. Within a segment the minimum is at one of
/// four points in closed form. No sample: Eq. 1 is for the caller; gives the shortest, as do NaN and times that fall.
/// Precondition, asserted: limits.validate() is kOk. RT-safe: O(samples).
[[nodiscard]] Nanos trajectory_budget(std::span<const TrajectoryOutlook> outlook, const StoppingModel& model,
                                      const BudgetLimits& limits) noexcept;

}  // namespace roborun::governor
