#include "governor/budget/time_budget.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware_if/assert.hpp"

namespace roborun::governor {
namespace {

/// Eq. 1 without the lower clamp; +infinity at standstill.
double raw_budget_s(double visible_m, double speed_mps, const StoppingModel& model,
                    double longest_s) noexcept {
  const double rest_m = visible_m - model.distance_m(speed_mps);
  // Compared as a product, so that standstill needs no division by zero; NaN falls through to zero.
  if (rest_m > longest_s * speed_mps) return longest_s;
  if (rest_m > 0.0) return rest_m / speed_mps;
  return 0.0;
}

/// Least s + max(b(s), 0) inside one segment, speed v and visibility d linear in u = s - begin. With
///   d_stop = q v^2 + l v + c     b = (d - d_stop) / v = (d - c) / v - q v - l
/// the derivative of u + b is
///   (1 - q v') + (d' v - v' (d - c)) / v^2
/// The second numerator does not depend on u (its own derivative is d' v' - v' d' = 0), so there is one
/// stationary speed; where d_stop is clamped to zero the same holds with q = l = c = 0. Where the rest d - d_stop falls below
/// zero, b ends: at the later zero of a parabola that opens downwards, or of d. Where the clamp of d_stop begins, u + b has no
/// least: its slope falls there. +infinity where none of them lies inside.
double least_over_segment_s(const TrajectoryOutlook& a, const TrajectoryOutlook& b,
                            const StoppingModel& model, double longest_s) noexcept {
  const double duration_s = b.time_s - a.time_s;
  const double v_rate = (b.speed_mps - a.speed_mps) / duration_s;
  const double d_rate = (b.visible_m - a.visible_m) / duration_s;
  double best_s = std::numeric_limits<double>::infinity();
  const auto try_at = [&](double u) {
    if (!(u > 0.0 && u < duration_s)) return;  // NaN, of what does not exist, included
    best_s = std::min(
        best_s,
        a.time_s + u + raw_budget_s(a.visible_m + d_rate * u, a.speed_mps + v_rate * u, model, longest_s));
  };
  const auto try_squared_speed = [&](double v2) { try_at((std::sqrt(v2) - a.speed_mps) / v_rate); };
  const double q = model.quadratic_s2pm;
  const double l = model.linear_s;
  const double c = model.constant_m;
  const double v0 = a.speed_mps;
  try_squared_speed((v_rate * (a.visible_m - c) - d_rate * v0) / (1.0 - q * v_rate));
  try_squared_speed(v_rate * a.visible_m - d_rate * v0);
  const double x2 = -q * v_rate * v_rate;
  const double x1 = d_rate - 2.0 * q * v0 * v_rate - l * v_rate;
  const double x0 = a.visible_m - (q * v0 + l) * v0 - c;
  try_at(2.0 * x0 / (std::sqrt(x1 * x1 - 4.0 * x2 * x0) - x1));
  try_at(-a.visible_m / d_rate);
  return best_s;
}

}  // namespace

Nanos time_budget(double visible_m, double speed_mps, const StoppingModel& model,
                  const BudgetLimits& limits) noexcept {
  ROBORUN_ASSERT(limits.validate() == Status::kOk);
  const double budget_s = raw_budget_s(visible_m, speed_mps, model, seconds(limits.longest));
  return std::clamp(from_seconds(budget_s), limits.shortest, limits.longest);
}

Nanos trajectory_budget(std::span<const TrajectoryOutlook> outlook, const StoppingModel& model,
                        const BudgetLimits& limits) noexcept {
  ROBORUN_ASSERT(limits.validate() == Status::kOk);
  if (outlook.empty()) return limits.shortest;
  const double longest_s = seconds(limits.longest);
  double best_s = longest_s;
  const TrajectoryOutlook* before = outlook.data();
  for (const TrajectoryOutlook& at : outlook) {
    if (!std::isfinite(at.time_s) || std::isnan(at.speed_mps) || std::isnan(at.visible_m) ||
        at.time_s < before->time_s)
      return limits.shortest;
    best_s = std::min(best_s, least_over_segment_s(*before, at, model, longest_s));
    best_s = std::min(best_s, at.time_s + raw_budget_s(at.visible_m, at.speed_mps, model, longest_s));
    before = &at;
  }
  return std::clamp(from_seconds(best_s), limits.shortest, limits.longest);
}

}  // namespace roborun::governor
