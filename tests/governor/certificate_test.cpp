#include "governor/solver/certificate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>

#include "core/random/counter_rng.hpp"
#include "governor/solver/lattice_solver.hpp"
#include "tests/governor/solver_problems.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/names.hpp"

namespace roborun::governor {
namespace {

using test::kInfinity;
using test::kNan;

constexpr double kRelative = 1e-9;

/// The rules of certificate.hpp a second time, in the words of linear programming: rows a v <= b.
struct Row {
  std::array<double, 3> a;
  double b;
  double tolerance;
};

/// The least distance to the deadline that a pair can reach; infinite without one that is in time.
double least_gap_s(const SolverProblem& p, double time_s) {
  const double most1 = bounded(std::min({p.v_sensor_m3, p.v_map_m3, p.v1_max_m3}));
  const std::array<double, 3> most{std::min(most1, p.v0_max_m3), most1, bounded(p.v2_max_m3)};
  if (*std::min_element(most.begin(), most.end()) < 0.0) return kInfinity;
  double least_s = kInfinity;
  for (int p0 = 0; p0 < kPrecisionLevels; ++p0) {
    for (int p1 = 0; p1 < kPrecisionLevels; ++p1) {
      const Pair pair = pair_of(p, p0, p1);
      const bool finite =
          std::isfinite(pair.slope[0]) && std::isfinite(pair.slope[1]) && std::isfinite(pair.slope[2]);
      if (!pair.allowed || !finite || !(pair.fixed_s <= time_s)) continue;
      least_s = std::min(least_s, std::max(0.0, time_s - pair.fixed_s - dot(pair.slope, most)));
    }
  }
  return least_s;
}

Verdict second_judge(const SolverProblem& p, const SolverSolution& s) {
  bool posed = p.p_min_m > 0.0 && p.levels > 0 && p.levels < kPrecisionLevels + 1;
  for (const double x : {p.delta_d_s, p.g_min_m, p.g_avg_m, p.d_obs_m, p.v_sensor_m3, p.v_map_m3, p.v0_max_m3,
                         p.v1_max_m3, p.v2_max_m3})
    posed = posed && !std::isnan(x);
  const bool called_invalid = s.status == Status::kInvalidArgument;
  if (!posed) return called_invalid ? Verdict::kAccepted : Verdict::kArithmetic;
  if (called_invalid) return Verdict::kNotInvalid;
  const double time_s = bounded(p.delta_d_s);
  const double least_s = least_gap_s(p, time_s);
  if (s.status == Status::kInfeasible)
    return std::isinf(least_s) ? Verdict::kAccepted : Verdict::kNotInfeasible;
  const Pair pair = pair_of(p, s.p0_level, s.p1_level);
  if (!pair.allowed) return Verdict::kPrecision;

  const std::array<double, 3> v{s.v0_m3, s.v1_m3, s.v2_m3};
  const double latency_s = pair.fixed_s + dot(pair.slope, v);
  const double gap_s = time_s - latency_s;
  const double m3 = kRelative * (1.0 + *std::max_element(v.begin(), v.end()));
  const std::array<Row, kConstraintCount> rows{{
      {pair.slope, time_s - pair.fixed_s, kRelative * (1.0 + std::fabs(time_s))},
      {{-1, 0, 0}, 0, m3},
      {{1, -1, 0}, 0, m3},
      {{0, 1, 0}, bounded(p.v_sensor_m3), m3},
      {{0, 1, 0}, bounded(p.v_map_m3), m3},
      {{0, 0, -1}, 0, m3},
      {{1, 0, 0}, bounded(p.v0_max_m3), m3},
      {{0, 1, 0}, bounded(p.v1_max_m3), m3},
      {{0, 0, 1}, bounded(p.v2_max_m3), m3},
  }};
  const auto slack = [&](const Row& row) { return row.b - dot(row.a, v); };
  for (std::size_t i = 1; i < kConstraintCount; ++i) {
    if (!(slack(rows[i]) >= -rows[i].tolerance)) return Verdict::kVolume;
  }
  if (!(slack(rows[0]) >= -rows[0].tolerance)) return Verdict::kLate;
  const auto wrong = [](double right, double said) {
    return !(std::fabs(right - said) <= kRelative * (1.0 + std::fabs(right)));
  };
  if (wrong(latency_s, s.latency_s) || wrong(gap_s * gap_s, s.objective_s2)) return Verdict::kArithmetic;

  std::array<double, 3> gradient{};
  for (std::size_t k = 0; k < 3; ++k) gradient[k] = -2.0 * std::max(gap_s, 0.0) * pair.slope[k];
  for (std::size_t i = 0; i < kConstraintCount; ++i) {
    const double m = s.multiplier[i];
    if (!(m >= 0.0 && m < kInfinity)) return Verdict::kSign;
    const bool named = m > 0.0 || (s.active & (1U << i)) != 0;
    if (named && slack(rows[i]) > rows[i].tolerance) return Verdict::kComplementary;
    for (std::size_t k = 0; k < 3; ++k) gradient[k] += m * rows[i].a[k];
  }
  const std::array<double, 3> size{pair.slope[0], pair.slope[0] + pair.slope[1], pair.slope[2]};
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(std::fabs(gradient[k]) <= kRelative * (1.0 + 2.0 * std::fabs(time_s)) * (size[k] + 1e-12)))
      return Verdict::kStationary;
  }
  const double allowance_s = kRelative * (gap_s + 1e-6 * (1.0 + std::fabs(time_s)));
  return gap_s - least_s > allowance_s ? Verdict::kBetterPair : Verdict::kAccepted;
}

/// Latency and objective as they follow from the knobs, where the levels are any.
void repair(const SolverProblem& p, SolverSolution& s) {
  const Pair pair = pair_of(p, s.p0_level, s.p1_level);
  s.latency_s = pair.fixed_s + dot(pair.slope, {s.v0_m3, s.v1_m3, s.v2_m3});
  const double gap_s = bounded(p.delta_d_s) - s.latency_s;
  s.objective_s2 = gap_s * gap_s;
}

/// One thing is wrong, by little more or little less than what is tolerated, or by much.
void corrupt(core::CounterRng& rng, const SolverProblem& p, SolverSolution& s) {
  const double by = std::array<double, 8>{0.6, 1.6, 0.6, 1.6, 5e6, 5e8, kInfinity, kNan}[rng.below(8)] *
                    (rng.below(2) == 0 ? kRelative : -kRelative);
  double* const volumes[] = {&s.v0_m3, &s.v1_m3, &s.v2_m3};
  const double time_s = bounded(p.delta_d_s);
  const Pair pair = pair_of(p, s.p0_level, s.p1_level);
  bool repaired = rng.below(8) != 0;
  switch (rng.below(8)) {
    case 0:
    case 1:
      *volumes[rng.below(3)] += by * (1.0 + std::max({s.v0_m3, s.v1_m3, s.v2_m3}));
      break;
    case 2: {
      const double slope = pair.slope[rng.below(3)];
      s.multiplier[rng.below(kConstraintCount)] += by * (1.0 + 2.0 * std::fabs(time_s)) * (slope + 1e-12);
      break;
    }
    case 3:
      s.active = static_cast<std::uint16_t>(s.active ^ (1U << rng.below(16)));
      break;
    case 4: {
      int& level = rng.below(2) == 0 ? s.p0_level : s.p1_level;
      level = static_cast<int>(rng.below(9)) - 1;
      break;
    }
    case 5:  // Late or early, by a volume that nothing bounds there.
      if (const std::size_t k = rng.below(3); pair.slope[k] > 0.0)
        *volumes[k] += by * (1.0 + std::fabs(time_s)) / pair.slope[k];
      break;
    case 6:
      repaired = false;
      (rng.below(2) == 0 ? s.latency_s : s.objective_s2) +=
          by * (1.0 + std::fabs(rng.below(2) == 0 ? s.latency_s : s.objective_s2));
      break;
    default:
      s.status =
          std::array<Status, 3>{Status::kOk, Status::kInvalidArgument, Status::kInfeasible}[rng.below(3)];
  }
  if (repaired) repair(p, s);
}

TEST(Certificate, ASecondJudgeSaysTheSameOfWhatIsNearlyRight) {
  core::CounterRng rng(3);
  std::map<Verdict, int> count;
  for (int n = 0; n < 200'000; ++n) {
    const SolverProblem p = wide_problem(rng);
    SolverSolution s = solve(p);
    for (std::uint64_t k = rng.below(3); k > 0; --k) corrupt(rng, p, s);
    const Verdict verdict = verify(p, s);
    ++count[verdict];
    ASSERT_EQ(verdict, second_judge(p, s))
        << n << ": " << to_string(verdict) << ", not " << to_string(second_judge(p, s));
  }
  for (int verdict = 0; verdict <= static_cast<int>(Verdict::kNotInvalid); ++verdict)
    EXPECT_GT(count[static_cast<Verdict>(verdict)], 100) << to_string(static_cast<Verdict>(verdict));
}

/// Two pairs of precisions that differ by little: the worse one is refused when it is worse by more than the tolerance.
TEST(Certificate, ASecondJudgeSaysTheSameOfAPairThatIsHardlyBetter) {
  core::CounterRng rng(4);
  int better = 0;
  int same = 0;
  for (int n = 0; n < 20'000; ++n) {
    SolverProblem p;
    p.g_avg_m = p.d_obs_m = 1.0;
    p.p1_coarsest_level = 1;
    p.v_sensor_m3 = p.v_map_m3 = rng.uniform(0.0, 1000.0);
    p.v2_max_m3 = 1000.0;
    const double scale = std::array<double, 2>{1e-3, 1.0}[rng.below(2)];
    for (LatencyModel& m : p.model) m.slope_s_per_m3 = {1e-4 * scale, 1e-4 * scale, 0, 0, 0, 0};
    p.model[Knob::kPerceive].fixed_s = {0.3 * scale, 1e6, 0, 0, 0, 0};
    p.model[Knob::kExport].fixed_s = {1e6, 0.0, 0, 0, 0, 0};
    const double all_s = 0.3 * scale + 1e-4 * scale * (2.0 * p.v_sensor_m3 + p.v2_max_m3);
    p.delta_d_s = all_s + (scale < 1.0 ? 1e-7 : rng.uniform(0.1, 1.0));
    const SolverSolution s = solve(p);  // of the pair 0, 1
    ASSERT_EQ(verify(p, s), Verdict::kAccepted);
    const double gap_s = p.delta_d_s - s.latency_s;
    const double by = std::array<double, 4>{-1.0, 0.6, 1.6, 1e3}[rng.below(4)];
    p.model[Knob::kPerceive].fixed_s[1] = 0.3 * scale + by * kRelative * (gap_s + 1e-6 * (1.0 + p.delta_d_s));
    const Verdict verdict = verify(p, s);
    ASSERT_EQ(verdict, second_judge(p, s)) << n << ": by " << by;
    ASSERT_EQ(verdict, by > 1.0 ? Verdict::kBetterPair : Verdict::kAccepted) << n << ": by " << by;
    (verdict == Verdict::kAccepted ? same : better)++;
  }
  EXPECT_GT(std::min(same, better), 1000);
}

/// No time beyond what is fixed: all volumes are zero, and a multiplier on the deadline is one that those of the volumes balance.
TEST(Certificate, AcceptsAMultiplierOnTheDeadlineThatOthersBalance) {
  SolverProblem p;
  p.delta_d_s = 1.0;
  p.g_avg_m = p.d_obs_m = kPublishedCell_m;
  p.p1_coarsest_level = 0;
  p.v_sensor_m3 = p.v_map_m3 = 1000.0;
  p.model[Knob::kPerceive].fixed_s[0] = 1.0;
  p.model[Knob::kPerceive].slope_s_per_m3[0] = 1e-4;
  p.model[Knob::kExport].slope_s_per_m3[0] = 2e-4;
  p.model[Knob::kPlan].slope_s_per_m3[0] = 4e-4;
  SolverSolution s = solve(p);
  ASSERT_EQ(verify(p, s), Verdict::kAccepted);
  ASSERT_EQ(s.v0_m3 + s.v1_m3 + s.v2_m3, 0.0);
  s.multiplier[Constraint::kDeadline] = 1.0;
  s.multiplier[Constraint::kChain] = 2e-4;
  s.multiplier[Constraint::kPerceiveSome] = 3e-4;
  s.multiplier[Constraint::kPlanSome] = 4e-4;
  EXPECT_EQ(verify(p, s), Verdict::kAccepted);
  EXPECT_EQ(second_judge(p, s), Verdict::kAccepted);
  s.multiplier[Constraint::kDeadline] = 1.1;
  EXPECT_EQ(verify(p, s), Verdict::kStationary);
}

TEST(Certificate, RejectsEveryCorruption) {
  core::CounterRng rng(2);
  int checked = 0;
  for (int n = 0; n < 4000; ++n) {
    const SolverProblem p = random_problem(rng);
    const SolverSolution s = solve(p);
    if (s.status != Status::kOk) {
      SolverSolution bad = s;
      bad.status = Status::kOk;
      ASSERT_NE(verify(p, bad), Verdict::kAccepted);
      continue;
    }
    ++checked;
    for (int field = 0; field < 11; ++field) {
      SolverSolution bad = s;
      if (field == 0) bad.v0_m3 = bad.v1_m3 + 1.0;
      if (field == 1) bad.v1_m3 = std::min(p.v_sensor_m3, p.v_map_m3) + 1.0;
      if (field == 2) bad.v2_m3 = p.v2_max_m3 + 1.0;
      if (field == 3) bad.p0_level = bad.p1_level + 1;
      if (field == 4) bad.latency_s += 0.001;
      if (field == 5) bad.v0_m3 = -1.0;
      if (field == 6) bad.objective_s2 += 0.001;
      if (field == 7) bad.multiplier[static_cast<std::size_t>(Constraint::kV2Max)] = -1.0;
      if (field == 8) bad.multiplier[static_cast<std::size_t>(Constraint::kDeadline)] = 1.0 + p.delta_d_s;
      if (field == 9) bad.status = Status::kInfeasible;
      if (field == 10) bad.status = Status::kInvalidArgument;
      // A multiplier on the deadline changes nothing where nothing costs anything.
      const auto slope = [&p](std::size_t m, int level) {
        return p.model[m].slope_s_per_m3[static_cast<std::size_t>(level)];
      };
      if (field == 8 && (s.active & 1U) != 0 &&
          slope(0, s.p0_level) + slope(1, s.p1_level) + slope(2, s.p1_level) == 0.0)
        continue;
      ASSERT_NE(verify(p, bad), Verdict::kAccepted) << "instance " << n << ", corruption " << field;
    }
  }
  EXPECT_GT(checked, 1000);
}

TEST(Certificate, RejectsVolumesThatLeaveTimeAndAPairThatCannotUseIt) {
  SolverProblem p;
  p.delta_d_s = 1.0;
  p.g_avg_m = p.d_obs_m = 1.0;
  p.p1_coarsest_level = 1;
  p.v_sensor_m3 = p.v_map_m3 = 1000.0;
  p.v2_max_m3 = 1000.0;
  for (LatencyModel& m : p.model) m.slope_s_per_m3 = {1e-4, 1e-5, 0, 0, 0, 0};
  const SolverSolution s = solve(p);
  ASSERT_EQ(verify(p, s), Verdict::kAccepted);
  SolverSolution less = s;
  less.v2_m3 -= 10.0;
  less.latency_s -= 10.0 * p.model[2].slope_s_per_m3[static_cast<std::size_t>(s.p1_level)];
  less.objective_s2 = (p.delta_d_s - less.latency_s) * (p.delta_d_s - less.latency_s);
  less.active = 0;
  less.multiplier = {};
  EXPECT_EQ(verify(p, less), Verdict::kStationary);
  // The best of the coarser pair, with a certificate that is right for that pair.
  SolverProblem coarser = p;
  coarser.g_min_m = 0.5;
  EXPECT_EQ(verify(p, solve(coarser)), Verdict::kBetterPair);
}

TEST(Certificate, VerdictsSayWhatIsWrong) {
  test::expect_names<Verdict>({"accepted", "precision outside its interval", "volume outside its bounds",
                               "late", "latency or objective wrong", "multiplier negative",
                               "multiplier or active bit on a constraint that is not tight", "not stationary",
                               "another pair is better", "not infeasible", "not invalid"},
                              "unknown");
}

}  // namespace
}  // namespace roborun::governor
