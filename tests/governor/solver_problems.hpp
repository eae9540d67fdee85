/// Instances of Eq. 3 as a generator of numbers makes them.
#pragma once

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

}  // namespace roborun::governor
