#include "governor/budget/time_budget.hpp"

#include <algorithm>
#include <cmath>

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

/// Least s + max(b(s), 0) over one segment, speed v and visibility d linear in u = s - begin. With
///   d_stop = q v^2 + l v + c     b = (d - d_stop) / v = (d - c) / v - q v - l
/// the derivative of u + b is
///   (1 - q v') + (d' v - v' (d - c)) / v^2
/// The second numerator does not depend on u (its own derivative is d' v' - v' d' = 0), so there is one
/// stationary speed. Where the rest d - d_stop crosses zero, b ends; below the speed where d_stop is clamped
/// to zero, the same holds with q = l = c = 0.
double least_over_segment_s(const TrajectoryOutlook& a, const TrajectoryOutlook& b,
                            const StoppingModel& model, double longest_s) noexcept {
  const double duration_s = b.time_s - a.time_s;
  const double v_rate = (b.speed_mps - a.speed_mps) / duration_s;
  const double d_rate = (b.visible_m - a.visible_m) / duration_s;
  double best_s = longest_s;
  const auto try_at = [&](double u) {
    if (!(u > 0.0 && u < duration_s)) return;
    best_s = std::min(
        best_s,
        a.time_s + u + raw_budget_s(a.visible_m + d_rate * u, a.speed_mps + v_rate * u, model, longest_s));
  };
  const auto try_speed = [&](double speed_mps) {
    if (v_rate != 0.0) try_at((speed_mps - a.speed_mps) / v_rate);
  };
  const auto try_roots = [&](double x2, double x1, double x0) {
    if (std::fabs(x2) < 1e-12) {
      if (x1 != 0.0) try_at(-x0 / x1);
      return;
    }
    const double inside = x1 * x1 - 4.0 * x2 * x0;
    if (!(inside >= 0.0)) return;
    const double root = std::sqrt(inside);
    try_at((-x1 - root) / (2.0 * x2));
    try_at((-x1 + root) / (2.0 * x2));
  };
  const double q = model.quadratic_s2pm;
  const double l = model.linear_s;
  const double c = model.constant_m;
  const double v0 = a.speed_mps;
  const double fixed = d_rate * v0 - v_rate * (a.visible_m - c);
  const double v2 = -fixed / (1.0 - q * v_rate);
  if (v2 > 0.0) try_speed(std::sqrt(v2));
  const double clamped_v2 = v_rate * a.visible_m - d_rate * v0;
  if (clamped_v2 > 0.0) try_speed(std::sqrt(clamped_v2));
  if (q > 0.0 && l * l - 4.0 * q * c >= 0.0) try_speed((std::sqrt(l * l - 4.0 * q * c) - l) / (2.0 * q));
  // rest(u) = 0, with d_stop and with d_stop clamped to zero.
  try_roots(-q * v_rate * v_rate, d_rate - 2.0 * q * v0 * v_rate - l * v_rate,
            a.visible_m - (q * v0 + l) * v0 - c);
  if (d_rate != 0.0) try_at(-a.visible_m / d_rate);
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
  for (std::size_t i = 0; i < outlook.size(); ++i) {
    const TrajectoryOutlook& a = outlook[i];
    if (!std::isfinite(a.time_s) || std::isnan(a.speed_mps) || std::isnan(a.visible_m))
      return limits.shortest;
    if (a.time_s >= best_s) break;
    best_s = std::min(best_s, a.time_s + raw_budget_s(a.visible_m, a.speed_mps, model, longest_s));
    if (i + 1 == outlook.size()) break;
    const TrajectoryOutlook& b = outlook[i + 1];
    if (std::isnan(b.speed_mps) || std::isnan(b.visible_m) || !(b.time_s >= a.time_s)) return limits.shortest;
    if (b.time_s > a.time_s) best_s = std::min(best_s, least_over_segment_s(a, b, model, longest_s));
  }
  return std::clamp(from_seconds(best_s), limits.shortest, limits.longest);
}

}  // namespace roborun::governor
