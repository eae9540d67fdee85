/// Instances of Eq. 3 as a generator of numbers makes them, and what a pair of precisions means in them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/random/counter_rng.hpp"
#include "governor/solver/lattice_solver.hpp"
#include "tests/support/limits.hpp"

namespace roborun::governor {

inline SolverProblem random_problem(core::CounterRng& rng) {
  SolverProblem p;
  p.delta_d_s = rng.uniform(-0.1, 3.0);
  for (LatencyModel& m : p.model) {
    const double scale = rng.uniform(0.0, 2e-4);
    for (std::size_t i = 0; i < kPrecisionLevels; ++i) {
      m.fixed_s[i] = rng.uniform(0.0, 0.2) / static_cast<double>(i + 1);
      m.slope_s_per_m3[i] = rng.below(8) == 0 ? 0.0 : scale / static_cast<double>(1ULL << (3 * i));
    }
  }
  p.g_min_m = rng.below(3) == 0 ? rng.uniform(0.0, 12.0) : 0.0;
  p.g_avg_m = rng.below(5) == 0 ? test::kInfinity : rng.uniform(0.0, 12.0);
  p.d_obs_m = rng.below(5) == 0 ? test::kInfinity : rng.uniform(0.0, 12.0);
  p.p1_coarsest_level = static_cast<int>(rng.below(6));
  p.v_sensor_m3 = rng.below(8) == 0 ? 0.0 : rng.uniform(0.0, 5e4);
  p.v_map_m3 = rng.uniform(0.0, 2e5);
  p.v2_max_m3 = rng.uniform(0.0, 1e5);
  return p;
}

/// As random_problem, of milliseconds to minutes, with bounds of all kinds.
inline SolverProblem wide_problem(core::CounterRng& rng) {
  SolverProblem p = random_problem(rng);
  const double scale = std::array<double, 3>{1e-3, 1.0, 30.0}[rng.below(3)];
  p.delta_d_s *= scale;
  for (LatencyModel& m : p.model) {
    for (double& x : m.fixed_s) x *= scale;
    for (double& x : m.slope_s_per_m3) x *= scale;
  }
  const double odd[] = {test::kInfinity, 1e15, 0.0, -1.0, 5.0, 2e4};
  double* const bounds[] = {&p.v_sensor_m3, &p.v_map_m3, &p.v0_max_m3, &p.v1_max_m3, &p.v2_max_m3};
  while (rng.below(2) == 0) *bounds[rng.below(5)] = odd[rng.below(6)];
  if (rng.below(16) == 0) p.v_sensor_m3 = p.v_map_m3 = p.v1_max_m3 = test::kInfinity;
  if (rng.below(16) == 0) p.levels = static_cast<int>(rng.below(9)) - 1;
  if (rng.below(16) == 0) p.p_min_m = rng.uniform(0.0, 1.0);
  if (rng.below(16) == 0) p.model[rng.below(3)].slope_s_per_m3[rng.below(6)] = test::kInfinity;
  if (rng.below(32) == 0) p.delta_d_s = test::kInfinity;
  if (rng.below(32) == 0) p.p1_coarsest_level = -1;
  if (rng.below(16) == 0)
    p.g_min_m = p.g_avg_m = PrecisionLattice{}.cell_size_m(static_cast<int>(rng.below(6)));
  if (rng.below(16) == 0)
    (rng.below(2) == 0 ? p.g_avg_m : p.d_obs_m) =
        PrecisionLattice{}.cell_size_m(static_cast<int>(rng.below(6)));
  return p;
}

inline double dot(const std::array<double, 3>& a, const std::array<double, 3>& v) {
  return a[0] * v[0] + a[1] * v[1] + a[2] * v[2];
}

/// What one pair of precisions costs, and whether it may be chosen.
struct Pair {
  double fixed_s{};
  std::array<double, 3> slope{};
  bool allowed{};
};

inline Pair pair_of(const SolverProblem& p, int p0, int p1) {
  Pair pair;
  if (p0 < 0 || p1 < 0 || p0 >= p.levels || p1 >= p.levels) return pair;
  const auto& [perceive, hand_on, plan] = static_cast<const std::array<LatencyModel, 3>&>(p.model);
  const double cell_m = std::ldexp(p.p_min_m, p0);
  const bool in_interval = cell_m >= p.g_min_m && cell_m <= std::min(p.g_avg_m, p.d_obs_m);
  const auto fine = static_cast<std::size_t>(p0);
  const auto coarse = static_cast<std::size_t>(p1);
  pair.fixed_s = perceive.fixed_s[fine] + hand_on.fixed_s[coarse] + plan.fixed_s[coarse];
  pair.slope = {perceive.slope_s_per_m3[fine], hand_on.slope_s_per_m3[coarse], plan.slope_s_per_m3[coarse]};
  pair.allowed = in_interval && p0 <= p1 && p1 <= std::max(p.p1_coarsest_level, 0);
  return pair;
}

inline double bounded(double x) { return std::min(x, 1e12); }

}  // namespace roborun::governor
