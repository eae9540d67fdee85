#include "governor/budget/time_budget.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::governor {
namespace {

constexpr int kPieces = 16;

/// Eq. 1 without the lower clamp; +infinity at standstill.
double raw_budget_s(double visible_m, double speed_mps, const StoppingModel& model,
                    double longest_s) noexcept {
  const double rest_m = visible_m - model.distance_m(speed_mps);
  // Compared as a product, so that standstill needs no division by zero; NaN falls through to zero.
  if (rest_m > longest_s * speed_mps) return longest_s;
  if (rest_m > 0.0) return rest_m / speed_mps;
  return 0.0;
}

}  // namespace

Nanos time_budget(double visible_m, double speed_mps, const StoppingModel& model,
                  const BudgetLimits& limits) noexcept {
  const double budget_s = raw_budget_s(visible_m, speed_mps, model, seconds(limits.longest));
  return std::clamp(from_seconds(budget_s), limits.shortest, limits.longest);
}

Nanos trajectory_budget(std::span<const TrajectoryOutlook> outlook, const StoppingModel& model,
                        const BudgetLimits& limits) noexcept {
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
    for (int k = 0; k < kPieces; ++k) {
      const double from = static_cast<double>(k) / kPieces;
      const double to = static_cast<double>(k + 1) / kPieces;
      const auto mix = [](double x, double y, double share) { return x + (y - x) * share; };
      const double speed_mps =
          std::max(mix(a.speed_mps, b.speed_mps, from), mix(a.speed_mps, b.speed_mps, to));
      const double visible_m =
          std::min(mix(a.visible_m, b.visible_m, from), mix(a.visible_m, b.visible_m, to));
      const double begin_s = mix(a.time_s, b.time_s, from);
      best_s = std::min(best_s, begin_s + raw_budget_s(visible_m, speed_mps, model, longest_s));
    }
  }
  return std::clamp(from_seconds(best_s), limits.shortest, limits.longest);
}

}  // namespace roborun::governor
