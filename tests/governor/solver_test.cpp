#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "governor/solver/lattice_solver.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::governor {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

SolverProblem random_problem(core::CounterRng& rng) {
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
  p.g_avg_m = rng.below(5) == 0 ? kInfinity : rng.uniform(0.0, 12.0);
  p.d_obs_m = rng.below(5) == 0 ? kInfinity : rng.uniform(0.0, 12.0);
  p.p1_coarsest_level = static_cast<int>(rng.below(6));
  p.v_sensor_m3 = rng.below(8) == 0 ? 0.0 : rng.uniform(0.0, 5e4);
  p.v_map_m3 = rng.uniform(0.0, 2e5);
  p.v2_max_m3 = rng.uniform(0.0, 1e5);
  return p;
}

/// Exhaustive: every lattice pair, volumes on a dense grid. Least objective that it finds.
double exhaustive(const SolverProblem& p) {
  double best = kInfinity;
  const double v1_max = std::min({p.v_sensor_m3, p.v_map_m3, p.v1_max_m3});
  const double v0_max = std::min(p.v0_max_m3, v1_max);
  for (int p0 = 0; p0 < kPrecisionLevels; ++p0) {
    if (cell_size_m(p0) > std::min(p.g_avg_m, p.d_obs_m) || cell_size_m(p0) < p.g_min_m) continue;
    for (int p1 = p0; p1 <= p.p1_coarsest_level; ++p1) {
      for (int i = 0; i <= 10; ++i) {
        for (int k = 0; k <= 10; ++k) {
          for (int n = 0; n <= 10; ++n) {
            const double v0 = v0_max * i / 10.0;
            const double v1 = v0 + (v1_max - v0) * k / 10.0;
            const double v2 = p.v2_max_m3 * n / 10.0;
            const double latency =
                p.model[0].latency_s(p0, v0) + p.model[1].latency_s(p1, v1) + p.model[2].latency_s(p1, v2);
            if (latency <= p.delta_d_s)
              best = std::min(best, (p.delta_d_s - latency) * (p.delta_d_s - latency));
          }
        }
      }
    }
  }
  return best;
}

TEST(LatticeSolver, IsNeverWorseThanAnExhaustiveSearchAndNeverLate) {
  core::CounterRng rng(1);
  int feasible = 0;
  for (int n = 0; n < 3000; ++n) {
    const SolverProblem p = random_problem(rng);
    const SolverSolution s = solve(p);
    const double reference = exhaustive(p);
    if (s.status != Status::kOk) {
      ASSERT_EQ(reference, kInfinity) << "found what the solver called infeasible";
      continue;
    }
    ++feasible;
    ASSERT_LE(s.latency_s, p.delta_d_s * (1.0 + 1e-9) + 1e-12);
    ASSERT_TRUE(is_feasible(p, s));
    if ((s.active & kEmptyPrecision) == 0) {
      ASSERT_LE(s.objective_s2, reference * (1.0 + 1e-9) + 1e-12);
    }
  }
  EXPECT_GT(feasible, 1500);
}

TEST(LatticeSolver, CheckerRejectsCorruptedAnswers) {
  core::CounterRng rng(2);
  int checked = 0;
  for (int n = 0; n < 2000; ++n) {
    const SolverProblem p = random_problem(rng);
    const SolverSolution s = solve(p);
    if (s.status != Status::kOk) continue;
    ++checked;
    for (int field = 0; field < 6; ++field) {
      SolverSolution bad = s;
      if (field == 0) bad.v0_m3 = bad.v1_m3 + 1.0;
      if (field == 1) bad.v1_m3 = std::min(p.v_sensor_m3, p.v_map_m3) + 1.0;
      if (field == 2) bad.v2_m3 = p.v2_max_m3 + 1.0;
      if (field == 3) bad.p0_level = bad.p1_level + 1;
      if (field == 4) bad.latency_s += 0.001;
      if (field == 5) bad.v0_m3 = -1.0;
      ASSERT_FALSE(is_feasible(p, bad)) << field;
    }
  }
  EXPECT_GT(checked, 1000);
}

TEST(LatticeSolver, SeesAllBeforeItSeesFiner) {
  SolverProblem p;
  const core::CostProfile costs = core::paper_profile();
  p.model = {from_cost(costs.of(core::StageId::kMap)), from_cost(costs.of(core::StageId::kExport)),
             from_cost(costs.of(core::StageId::kPlanner))};
  p.g_avg_m = p.d_obs_m = 1.2;
  p.p1_coarsest_level = 2;
  p.v_sensor_m3 = 30e3;
  p.v_map_m3 = 60e3;
  p.v2_max_m3 = 12e3;
  // At 1.2 m: 0.10 fixed + 30 * (0.0031 + 0.0013) s = 0.232 s; the rest goes to the planner.
  p.delta_d_s = 0.25;
  const SolverSolution tight = solve(p);
  EXPECT_EQ(tight.v0_m3, 30e3);
  EXPECT_EQ(tight.p0_level, 2);
  // At 0.6 m: 0.24 fixed + 30 * (0.0188 + 0.0026) s = 0.882 s.
  p.delta_d_s = 1.0;
  const SolverSolution roomy = solve(p);
  EXPECT_EQ(roomy.v0_m3, 30e3);
  EXPECT_EQ(roomy.p0_level, 1);
}

TEST(LatticeSolver, AnswersDegenerateProblems) {
  SolverProblem p;
  p.delta_d_s = 1.0;
  p.g_avg_m = p.d_obs_m = 0.1;  // finer than the finest cell
  SolverSolution s = solve(p);
  EXPECT_EQ(s.status, Status::kOk);
  EXPECT_EQ(s.p0_level, 0);
  EXPECT_NE(s.active & kEmptyPrecision, 0);
  p.g_avg_m = p.d_obs_m = 5.0;
  p.g_min_m = 9.0;  // empty interval: the finer side wins
  s = solve(p);
  EXPECT_NE(s.active & kEmptyPrecision, 0);
  EXPECT_LE(cell_size_m(s.p0_level), 5.0);
  for (double* field : {&p.delta_d_s, &p.g_min_m, &p.g_avg_m, &p.d_obs_m, &p.v_sensor_m3, &p.v_map_m3,
                        &p.v0_max_m3, &p.v1_max_m3, &p.v2_max_m3}) {
    for (const double value : {kNan, kInfinity, -kInfinity, -1.0, 0.0}) {
      SolverProblem odd = p;
      *reinterpret_cast<double*>(reinterpret_cast<char*>(&odd) +
                                 (reinterpret_cast<char*>(field) - reinterpret_cast<char*>(&p))) = value;
      const SolverSolution answer = solve(odd);
      EXPECT_GE(answer.p0_level, 0);
      EXPECT_LT(answer.p0_level, kPrecisionLevels);
      EXPECT_FALSE(std::isnan(answer.v0_m3) || std::isnan(answer.v1_m3) || std::isnan(answer.v2_m3));
    }
  }
}

TEST(LatticeSolver, SolveDoesNotAllocate) {
  core::CounterRng rng(5);
  const SolverProblem p = random_problem(rng);
  const test::NoAllocScope scope;
  (void)solve(p);
  EXPECT_EQ(scope.count(), 0U);
}

TEST(FitEq4, RecoversItsOwnModelAndReportsErrors) {
  const Eq4 truth{{3e-6, 2e-6, 1e-6, 1.0}, 0.05};
  const LatencyModel model = from_eq4(truth);
  std::vector<LatencyPoint> points;
  for (int level = 0; level < kPrecisionLevels; ++level) {
    for (double v = 1e3; v <= 5e4; v *= 2.0) points.push_back({level, v, model.latency_s(level, v)});
  }
  const Eq4Fit exact = fit_eq4(points);
  EXPECT_LT(exact.max_relative_error, 1e-6);
  for (std::size_t i = 0; i < points.size(); ++i) points[i].latency_s *= i % 2 == 0 ? 1.05 : 0.95;
  const Eq4Fit noisy = fit_eq4(points);
  EXPECT_LT(noisy.mean_relative_error, 0.08);
  for (const double q : noisy.eq4.q) EXPECT_GE(q, 0.0);
}

TEST(DriftScale, RisesAtOnceFallsSlowlyAndIsBounded) {
  DriftScale sut;
  sut.observe(1.0, 2.0);
  EXPECT_DOUBLE_EQ(sut.value(), 2.0);
  sut.observe(1.0, 1.0);
  EXPECT_DOUBLE_EQ(sut.value(), 1.96);
  sut.observe(1.0, 100.0);
  EXPECT_DOUBLE_EQ(sut.value(), 4.0);
  sut.observe(1.0, kNan);
  sut.observe(0.0, 1.0);
  EXPECT_DOUBLE_EQ(sut.value(), 4.0);
}

}  // namespace
}  // namespace roborun::governor
