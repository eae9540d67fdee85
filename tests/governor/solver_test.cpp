#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "governor/solver/certificate.hpp"
#include "governor/solver/lattice_solver.hpp"
#include "tests/governor/solver_problems.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/names.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::governor {
namespace {

using test::kInfinity;
using test::kNan;

/// Exhaustive: every lattice pair, volumes on a dense grid. Least objective that it finds.
double exhaustive(const SolverProblem& p) {
  double best = kInfinity;
  const double v1_max = std::min({p.v_sensor_m3, p.v_map_m3, p.v1_max_m3});
  const double v0_max = std::min(p.v0_max_m3, v1_max);
  for (int p0 = 0; p0 < kPrecisionLevels; ++p0) {
    if (PrecisionLattice{}.cell_size_m(p0) > std::min(p.g_avg_m, p.d_obs_m) ||
        PrecisionLattice{}.cell_size_m(p0) < p.g_min_m)
      continue;
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
    ASSERT_EQ(verify(p, s), Verdict::kAccepted) << n << ": " << to_string(verify(p, s));
    if (s.status != Status::kOk) {
      ASSERT_EQ(reference, kInfinity) << "found what the solver called infeasible";
      ASSERT_NE(s.active & (kEmptyPrecision | kEmptyVolume | kTooSlow), 0) << "says why";
      continue;
    }
    ++feasible;
    ASSERT_LE(s.latency_s, p.delta_d_s * (1.0 + 1e-12) + 1e-12);
    ASSERT_LE(s.objective_s2, reference * (1.0 + 1e-9) + 1e-18);
  }
  EXPECT_GT(feasible, 1000);
}

TEST(LatticeSolver, AmongEqualsItPrefersVolumeThenFinerCells) {
  // The order of the docstring, against all pairs solved one by one.
  core::CounterRng rng(6);
  int ties = 0;
  for (int n = 0; n < 3000; ++n) {
    const SolverProblem p = random_problem(rng);
    const SolverSolution best = solve(p);
    if (best.status != Status::kOk) continue;
    for (int p0 = 0; p0 < kPrecisionLevels; ++p0) {
      for (int p1 = p0; p1 <= p.p1_coarsest_level; ++p1) {
        if (PrecisionLattice{}.cell_size_m(p0) > std::min(p.g_avg_m, p.d_obs_m) ||
            PrecisionLattice{}.cell_size_m(p0) < p.g_min_m)
          continue;
        SolverProblem one = p;
        // Other pairs made too slow.
        for (std::size_t k = 0; k < kPrecisionLevels; ++k) {
          if (static_cast<int>(k) != p0) one.model[0].fixed_s[k] = 1e6;
          if (static_cast<int>(k) != p1) one.model[1].fixed_s[k] = 1e6;
        }
        const SolverSolution other = solve(one);
        if (other.status != Status::kOk) continue;
        const double gap_s = std::sqrt(best.objective_s2);
        const double other_gap_s = std::sqrt(other.objective_s2);
        ASSERT_LE(gap_s, other_gap_s * (1.0 + 1e-9) + 1e-12);
        if (std::fabs(gap_s - other_gap_s) > 1e-14 || (p0 == best.p0_level && p1 == best.p1_level)) continue;
        ++ties;
        ASSERT_GE(best.v0_m3, other.v0_m3 - 1e-5);
        if (best.v0_m3 > other.v0_m3 + 1e-5) continue;
        ASSERT_GE(best.v2_m3, other.v2_m3 - 1e-5);
        if (best.v2_m3 > other.v2_m3 + 1e-5) continue;
        ASSERT_LE(best.p0_level, p0);
      }
    }
  }
  EXPECT_GT(ties, 1000);
}

/// What the docstrings of Constraint and Reason say, from the knobs alone.
std::uint16_t expected_active(const SolverProblem& p, const SolverSolution& s) {
  std::array<bool, 12> on{};
  const double time_s = bounded(p.delta_d_s);
  on[0] = time_s - s.latency_s <= 1e-12 * (1.0 + time_s);
  on[1] = s.v0_m3 == 0.0;
  on[2] = s.v1_m3 == s.v0_m3;
  on[3] = s.v1_m3 >= p.v_sensor_m3;
  on[4] = s.v1_m3 >= p.v_map_m3;
  on[5] = s.v2_m3 == 0.0;
  on[6] = s.v0_m3 >= p.v0_max_m3;
  on[7] = s.v1_m3 >= p.v1_max_m3;
  on[8] = s.v2_m3 >= bounded(p.v2_max_m3);
  int finest = kPrecisionLevels, coarsest = -1;
  for (int level = 0; level < kPrecisionLevels; ++level) {
    if (!pair_of(p, level, level).allowed) continue;
    finest = std::min(finest, level);
    coarsest = level;
  }
  const double next_m = std::ldexp(p.p_min_m, s.p0_level + 1);
  on[9] = s.p0_level == coarsest && next_m > p.g_avg_m;
  on[10] = s.p0_level == coarsest && next_m > p.d_obs_m;
  on[11] = s.p0_level == finest && s.p0_level != 0;
  std::uint16_t active = 0;
  for (std::size_t i = 0; i < on.size(); ++i)
    active = static_cast<std::uint16_t>(active | (on[i] ? 1U << i : 0U));
  return active;
}

TEST(LatticeSolver, SaysWhatBoundsItAndHowQuickTheQuickestDecisionIs) {
  core::CounterRng rng(8);
  int bounded_by_all = 0;
  int too_slow = 0;
  for (int n = 0; n < 20'000; ++n) {
    const SolverProblem p = wide_problem(rng);
    const SolverSolution s = solve(p);
    if (p.levels < 1 || p.levels > kPrecisionLevels) {
      ASSERT_EQ(s.status, Status::kInvalidArgument);
      ASSERT_EQ(s.p0_level + s.p1_level + s.active, 0);
      ASSERT_EQ(s.latency_s, 0.0);
      continue;
    }
    if (s.status == Status::kOk) {
      ASSERT_EQ(s.active, expected_active(p, s)) << n;
      ASSERT_EQ(verify(p, s), Verdict::kAccepted) << n;
      ++bounded_by_all;
      continue;
    }
    const auto fine = static_cast<std::size_t>(s.p0_level);
    const auto coarse = static_cast<std::size_t>(s.p1_level);
    const double fixed_s = p.model[0].fixed_s[fine] + p.model[1].fixed_s[coarse] + p.model[2].fixed_s[coarse];
    ASSERT_EQ(s.latency_s, fixed_s) << n;
    ASSERT_EQ(s.objective_s2, (bounded(p.delta_d_s) - fixed_s) * (bounded(p.delta_d_s) - fixed_s)) << n;
    too_slow += s.active == kTooSlow ? 1 : 0;
  }
  EXPECT_GT(bounded_by_all, 5000);
  EXPECT_GT(too_slow, 100);
}

TEST(LatticeSolver, BoundsBeyondItsLevelsAreThoseOfItsLevels) {
  SolverProblem p;
  p.delta_d_s = 1.0;
  p.v_sensor_m3 = p.v_map_m3 = 1.0;
  p.g_avg_m = p.d_obs_m = 100.0;
  p.g_min_m = 100.0;
  EXPECT_EQ(solve(p).active, kEmptyPrecision);
  p.g_min_m = 0.0;
  p.levels = 3;
  p.p1_coarsest_level = 5;
  p.delta_d_s = -1.0;
  EXPECT_EQ(solve(p).p0_level, 2) << "the quickest decision there is";
  EXPECT_EQ(solve(p).p1_level, 2);
}

/// Pairs 0, 1 and 1, 1, of which the coarser one would be taken but for the others' tolerance.
struct Close {
  SolverProblem p;
  Close(double time_s, double volume_m3) {
    p.g_avg_m = p.d_obs_m = 1.0;
    p.p1_coarsest_level = 1;
    p.v_sensor_m3 = p.v_map_m3 = p.v2_max_m3 = volume_m3;
    p.delta_d_s = time_s;
    p.model[1].fixed_s[0] = 1e6;
  }
};

TEST(LatticeSolver, AGapThatIsHardlySmallerIsTheSame) {
  for (const double gap_s : {1e-7, 0.5}) {
    for (const double by : {-1.6, 0.6, 1.6}) {
      Close close(gap_s + 1e-3, 0.0);
      const double same_s = 1e-10 * gap_s + 1e-14;
      close.p.model[0].fixed_s = {1e-3, 1e-3 + by * same_s};
      EXPECT_EQ(solve(close.p).p0_level, by > 1.0 ? 1 : 0) << gap_s << ", " << by;
      // The other way round: the finer one has the smaller gap.
      close.p.model[0].fixed_s = {1e-3 + by * same_s, 1e-3};
      EXPECT_EQ(solve(close.p).p0_level, by < -1.0 ? 1 : 0) << gap_s << ", " << by;
    }
  }
}

TEST(LatticeSolver, AVolumeThatIsHardlyMoreIsTheSame) {
  for (const double by : {-1.6, 0.6, 1.6}) {
    const double more_s = by * 1e-6 * 1e-2;
    Close perceived(1.0, 1e6);  // 50 m3 of it in time
    perceived.p.model[0].slope_s_per_m3 = {1e-2, 1e-2};
    perceived.p.model[0].fixed_s = {0.5, 0.5 - more_s};
    EXPECT_EQ(solve(perceived.p).p0_level, by > 1.0 ? 1 : 0) << by;
    Close planned(1.0, 10.0);
    planned.p.model[0].slope_s_per_m3 = {1e-2, 1e-2};
    planned.p.model[2].slope_s_per_m3 = {1e-2, 1e-2};
    planned.p.v2_max_m3 = 1e6;
    planned.p.model[0].fixed_s = {0.5, 0.5 - more_s};
    EXPECT_EQ(solve(planned.p).p0_level, by > 1.0 ? 1 : 0) << by;
    EXPECT_EQ(solve(planned.p).v0_m3, 10.0);
  }
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

TEST(LatticeSolver, NamesWhyThereIsNoAnswer) {
  SolverProblem p;
  p.delta_d_s = 1.0;
  p.v_sensor_m3 = p.v_map_m3 = 1000.0;
  p.g_avg_m = p.d_obs_m = 0.1;  // finer than the finest cell
  SolverSolution s = solve(p);
  EXPECT_EQ(s.status, Status::kInfeasible);
  EXPECT_EQ(s.active, kEmptyPrecision);
  EXPECT_EQ(s.p0_level, 0);
  p.g_avg_m = p.d_obs_m = 5.0;
  p.g_min_m = 9.0;
  EXPECT_EQ(solve(p).active, kEmptyPrecision);
  p.g_min_m = 0.35;  // between two lattice points
  p.g_avg_m = 0.55;
  EXPECT_EQ(solve(p).active, kEmptyPrecision);
  p.g_min_m = 0.0;
  p.g_avg_m = 5.0;
  p.v_map_m3 = -1.0;
  EXPECT_EQ(solve(p).active, kEmptyVolume);
  p.v_map_m3 = 1.0;
  p.delta_d_s = -1e-9;
  s = solve(p);
  EXPECT_EQ(s.active, kTooSlow);
  EXPECT_EQ(s.v0_m3 + s.v1_m3 + s.v2_m3, 0.0) << "the quickest decision there is";
  EXPECT_EQ(s.p0_level, 4) << "4.8 m, the coarsest within 5 m";
}

TEST(LatticeSolver, AnswersEveryOddNumber) {
  core::CounterRng rng(11);
  const double odd[] = {kNan, kInfinity, -kInfinity, -1.0, 0.0, 1e300, -1e300, 1e-300};
  int answers = 0;
  for (int n = 0; n < 20000; ++n) {
    SolverProblem p = random_problem(rng);
    double* const field[] = {&p.delta_d_s,
                             &p.g_min_m,
                             &p.g_avg_m,
                             &p.d_obs_m,
                             &p.v_sensor_m3,
                             &p.v_map_m3,
                             &p.v0_max_m3,
                             &p.v1_max_m3,
                             &p.v2_max_m3,
                             &p.p_min_m,
                             &p.model[0].slope_s_per_m3[1],
                             &p.model[1].fixed_s[2],
                             &p.model[2].slope_s_per_m3[0]};
    for (std::uint64_t k = 0; k <= rng.below(3); ++k) *field[rng.below(10)] = odd[rng.below(8)];
    if (rng.below(4) == 0) *field[10 + rng.below(3)] = odd[rng.below(2) == 0 ? 0 : 1];
    const SolverSolution s = solve(p);
    ASSERT_EQ(verify(p, s), Verdict::kAccepted) << n << ": " << to_string(verify(p, s));
    ASSERT_GE(s.p0_level, 0);
    ASSERT_LT(s.p1_level, kPrecisionLevels);
    ASSERT_FALSE(std::isnan(s.v0_m3) || std::isnan(s.v1_m3) || std::isnan(s.v2_m3));
    answers += s.status == Status::kOk ? 1 : 0;
  }
  EXPECT_GT(answers, 2000);
}

TEST(LatticeSolver, SolveDoesNotAllocate) {
  core::CounterRng rng(5);
  const SolverProblem p = random_problem(rng);
  const test::NoAllocScope scope;
  (void)solve(p);
  EXPECT_EQ(scope.count(), 0U);
}

TEST(FitLatency, RecoversEq4WithAStepInItsConstantsAndReportsErrors) {
  LatencyModel truth = from_eq4({{3e-6, 2e-6, 1e-6, 1.0}});
  truth.fixed_s = {0.05, 0.04, 0.04, 0.03, 0.01, 0.01};
  std::vector<LatencyPoint> points;
  for (int level = 0; level < kPrecisionLevels; ++level) {
    for (double v = 1e3; v <= 5e4; v *= 2.0) points.push_back({level, v, truth.latency_s(level, v)});
  }
  EXPECT_LT(error_of(fit_latency(points), points).max_relative, 1e-6);
  for (std::size_t i = 0; i < points.size(); ++i) points[i].latency_s *= i % 2 == 0 ? 1.05 : 0.95;
  const LatencyModel noisy = fit_latency(points);
  const ModelError error = error_of(noisy, points);
  EXPECT_LT(error.mean_relative, 0.08);
  EXPECT_GT(error.max_relative, 0.01);
  EXPECT_EQ(error_of(truth, {}).mean_relative, 0.0);
}

TEST(FitLatency, IsNotNegativeAndNeverDearerForCoarserCellsWhateverIsMeasured) {
  core::CounterRng rng(11);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<LatencyPoint> points;
    points.reserve(40);
    for (int i = 0; i < 40; ++i)
      points.push_back({i % kPrecisionLevels, rng.uniform(0.0, 5e4), rng.uniform(-0.1, 1.0)});
    const LatencyModel model = fit_latency(points);
    EXPECT_GE(model.fixed_s.back(), 0.0);
    EXPECT_GE(model.slope_s_per_m3.back(), 0.0);
    for (std::size_t i = 1; i < kPrecisionLevels; ++i) {
      EXPECT_LE(model.fixed_s[i], model.fixed_s[i - 1]);
      EXPECT_LE(model.slope_s_per_m3[i], model.slope_s_per_m3[i - 1]);
    }
  }
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

TEST(LatticeSolver, ConstraintsAndReasonsHaveTheNamesOfReports) {
  test::expect_names<Constraint>(
      {"deadline", "v0_zero", "v0_v1", "v_sensor", "v_map", "v2_zero", "v0_max", "v1_max", "v2_max"},
      "unknown");
  const std::array<const char*, kReasons.size()> names{"g_avg",           "d_obs",        "g_min",
                                                       "empty_precision", "empty_volume", "too_slow"};
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_STREQ(to_string(kReasons[i]), names[i]);
  EXPECT_STREQ(to_string(static_cast<Reason>(kGapAverage | kObstacle)), "unknown");
}

}  // namespace
}  // namespace roborun::governor
