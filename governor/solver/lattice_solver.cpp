#include "governor/solver/lattice_solver.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::governor {
namespace {

constexpr double kSameObjective_s2 = 1e-12;
constexpr double kSameVolume_m3 = 1e-6;

/// Into [0, 1e12]; NaN gives 0. The upper end keeps infinite bounds out of differences.
double at_least_zero(double value) noexcept { return value > 0.0 ? std::min(value, 1e12) : 0.0; }

struct Bounds {
  int finest{};    ///< Of p0.
  int coarsest{};  ///< Of p0.
  int p1_coarsest{};
  bool empty{};
  double v1_max_m3{};
  double v0_max_m3{};
  double v2_max_m3{};
};

Bounds bounds_of(const SolverProblem& p) noexcept {
  Bounds b;
  const double upper_m = std::min(at_least_zero(p.g_avg_m), at_least_zero(p.d_obs_m));
  b.p1_coarsest = std::clamp(p.p1_coarsest_level, 0, kPrecisionLevels - 1);
  b.coarsest = std::min(coarsest_level_within(upper_m), b.p1_coarsest);
  b.empty = cell_size_m(0) > upper_m;
  b.finest = std::clamp(p.p0_finest_level, 0, kPrecisionLevels - 1);
  const double lower_m = at_least_zero(p.g_min_m);
  while (b.finest + 1 < kPrecisionLevels && cell_size_m(b.finest) < lower_m) ++b.finest;
  if (b.finest > b.coarsest) {
    b.empty = true;
    b.finest = b.coarsest;
  }
  b.v1_max_m3 =
      std::min({at_least_zero(p.v_sensor_m3), at_least_zero(p.v_map_m3), at_least_zero(p.v1_max_m3)});
  b.v0_max_m3 = std::min(at_least_zero(p.v0_max_m3), b.v1_max_m3);
  b.v2_max_m3 = at_least_zero(p.v2_max_m3);
  return b;
}

/// Largest x in [0, most] with slope * x <= time; all of it if it costs nothing.
double affordable(double time_s, double slope, double most) noexcept {
  return !(slope > 0.0) || slope * most <= time_s ? most : std::max(time_s, 0.0) / slope;
}

bool better(const SolverSolution& a, const SolverSolution& b) noexcept {
  if (std::fabs(a.objective_s2 - b.objective_s2) > kSameObjective_s2) return a.objective_s2 < b.objective_s2;
  if (std::fabs(a.v0_m3 - b.v0_m3) > kSameVolume_m3) return a.v0_m3 > b.v0_m3;
  if (std::fabs(a.v2_m3 - b.v2_m3) > kSameVolume_m3) return a.v2_m3 > b.v2_m3;
  if (a.p0_level != b.p0_level) return a.p0_level < b.p0_level;
  if (a.p1_level != b.p1_level) return a.p1_level < b.p1_level;
  return a.v1_m3 > b.v1_m3;
}

double latency_of(const SolverProblem& p, const SolverSolution& s) noexcept {
  return p.model[0].latency_s(s.p0_level, s.v0_m3) + p.model[1].latency_s(s.p1_level, s.v1_m3) +
         p.model[2].latency_s(s.p1_level, s.v2_m3);
}

SolverSolution solve_pair(const SolverProblem& p, const Bounds& b, double delta_d_s, int p0,
                          int p1) noexcept {
  SolverSolution s;
  s.p0_level = p0;
  s.p1_level = p1;
  const auto i0 = static_cast<std::size_t>(p0);
  const auto i1 = static_cast<std::size_t>(p1);
  const double a = p.model[0].slope_s_per_m3[i0];
  const double e = p.model[1].slope_s_per_m3[i1];
  const double c = p.model[2].slope_s_per_m3[i1];
  double rest_s = delta_d_s - (p.model[0].fixed_s[i0] + p.model[1].fixed_s[i1] + p.model[2].fixed_s[i1]);
  if (!(rest_s >= 0.0)) {
    s.status = Status::kInfeasible;
  } else {
    s.status = Status::kOk;
    // What is perceived must also be handed on: v1 = v0 comes with it.
    s.v0_m3 = affordable(rest_s, a + e, b.v0_max_m3);
    rest_s -= (a + e) * s.v0_m3;
    s.v2_m3 = affordable(rest_s, c, b.v2_max_m3);
    rest_s -= c * s.v2_m3;
    s.v1_m3 = s.v0_m3 + affordable(rest_s, e, b.v1_max_m3 - s.v0_m3);
  }
  s.latency_s = latency_of(p, s);
  const double slack_s = delta_d_s - s.latency_s;
  s.objective_s2 = slack_s * slack_s;
  return s;
}

}  // namespace

SolverSolution solve(const SolverProblem& problem) noexcept {
  const Bounds b = bounds_of(problem);
  const double delta_d_s = std::isfinite(problem.delta_d_s) ? problem.delta_d_s : 0.0;
  SolverSolution best;
  for (int p0 = b.finest; p0 <= b.coarsest; ++p0) {
    for (int p1 = p0; p1 <= b.p1_coarsest; ++p1) {
      const SolverSolution s = solve_pair(problem, b, delta_d_s, p0, p1);
      if (s.status == Status::kOk && (best.status != Status::kOk || better(s, best))) best = s;
    }
  }
  if (best.status != Status::kOk) best = solve_pair(problem, b, delta_d_s, b.coarsest, b.p1_coarsest);

  const auto flag = [&best](bool on, Active bit) {
    if (on) best.active = static_cast<std::uint16_t>(best.active | bit);
  };
  const double next_m = cell_size_m(best.p0_level + 1);
  flag(best.objective_s2 <= 1e-9, kActiveDeadline);
  flag(best.p0_level == b.coarsest && next_m > at_least_zero(problem.g_avg_m), kActiveGapAverage);
  flag(best.p0_level == b.coarsest && next_m > at_least_zero(problem.d_obs_m), kActiveObstacle);
  flag(best.p0_level == b.finest && b.finest > 0, kActiveGapMin);
  flag(best.v1_m3 >= at_least_zero(problem.v_sensor_m3), kActiveSensorVolume);
  flag(best.v1_m3 >= at_least_zero(problem.v_map_m3), kActiveMapVolume);
  flag(best.v0_m3 >= b.v0_max_m3, kActiveV0);
  flag(best.v2_m3 >= b.v2_max_m3, kActiveV2);
  flag(b.empty, kEmptyPrecision);
  return best;
}

bool is_feasible(const SolverProblem& p, const SolverSolution& s) noexcept {
  if (s.status != Status::kOk) return false;
  const Bounds b = bounds_of(p);
  const bool precision_ok = s.p0_level >= b.finest && s.p0_level <= b.coarsest && s.p1_level >= s.p0_level &&
                            s.p1_level <= b.p1_coarsest;
  const double slack = 1e-9;
  const bool volume_ok = s.v0_m3 >= 0.0 && s.v0_m3 <= b.v0_max_m3 * (1.0 + slack) &&
                         s.v1_m3 >= s.v0_m3 * (1.0 - slack) && s.v1_m3 <= b.v1_max_m3 * (1.0 + slack) &&
                         s.v2_m3 >= 0.0 && s.v2_m3 <= b.v2_max_m3 * (1.0 + slack);
  if (!precision_ok || !volume_ok) return false;
  const double latency_s = latency_of(p, s);
  const double gap_s = p.delta_d_s - latency_s;
  return latency_s <= p.delta_d_s * (1.0 + slack) + slack &&
         std::fabs(latency_s - s.latency_s) <= slack * (1.0 + latency_s) &&
         std::fabs(gap_s * gap_s - s.objective_s2) <= slack * (1.0 + gap_s * gap_s);
}

}  // namespace roborun::governor
