#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/random/counter_rng.hpp"
#include "governor/budget/time_budget.hpp"
#include "tests/support/limits.hpp"

namespace roborun::governor {
namespace {

using test::kNan;
constexpr BudgetLimits kLimits{Nanos{1'000'000}, Nanos{15'000'000'000}};

TEST(StoppingModel, RecomputesThePublishedFit) {
  constexpr std::array<std::array<double, 2>, 6> kPoint{
      {{0.995, 0.266}, {1.975, 0.598}, {3.921, 2.162}, {5.834, 3.539}, {7.712, 5.985}, {9.563, 8.151}}};
  double error = 0.0;
  for (const auto& p : kPoint) {
    const double relative = kRoborunStopping.distance_m(p[0]) / p[1] - 1.0;
    error += relative * relative / kPoint.size();
  }
  EXPECT_NEAR(error, 0.0165, 0.0005) << "published: 1.65 %";
}

TEST(StoppingModel, IsNeverNegativeAndAnUnknownSpeedNeverStops) {
  EXPECT_EQ(kRoborunStopping.distance_m(0.3), 0.0) << "the printed polynomial is negative below 0.53 m/s";
  EXPECT_EQ(kRoborunStopping.distance_m(-5.0), 0.0);
  EXPECT_EQ(kRoborunStopping.distance_m(kNan), std::numeric_limits<double>::infinity());
}

TEST(TimeBudget, IsEquationOne) {
  // (25 - (0.05494 * 36 + 0.3549 * 6 - 0.2038)) / 6 = (25 - 3.90344) / 6 = 3.51609 s.
  EXPECT_NEAR(seconds(time_budget(25.0, 6.0, kRoborunStopping, kLimits)), 3.51609, 1e-4);
}

TEST(TimeBudget, TreatsNanAsNear) {
  EXPECT_EQ(time_budget(kNan, 3.0, kRoborunStopping, kLimits), kLimits.shortest);
  EXPECT_EQ(time_budget(10.0, kNan, kRoborunStopping, kLimits), kLimits.shortest);
}

TEST(TimeBudget, GivesAStandingVehicleTheLongest) {
  EXPECT_EQ(time_budget(10.0, 0.0, kRoborunStopping, kLimits), kLimits.longest);
  EXPECT_EQ(time_budget(0.0, 0.0, kRoborunStopping, kLimits), kLimits.shortest) << "nothing is visible";
}

TEST(TimeBudget, NeverGrowsWithSpeedNorShrinksWithVisibility) {
  for (double d = 0.0; d < 30.0; d += 0.7) {
    Nanos last = kLimits.longest;
    for (double v = 0.0; v < 12.0; v += 0.05) {
      const Nanos budget = time_budget(d, v, kRoborunStopping, kLimits);
      ASSERT_LE(budget, last);
      ASSERT_LE(budget, time_budget(d + 0.5, v, kRoborunStopping, kLimits));
      last = budget;
    }
  }
}

/// Algorithm 1 in steps of 0.2 ms: the remaining budget runs down with time and is never more than Eq. 1
/// allows.
double dense_reference_s(std::span<const TrajectoryOutlook> w) {
  constexpr double kStep_s = 2e-4;
  double remaining_s = 15.0;
  for (double t = 0.0; t < 15.0; t += kStep_s) {
    TrajectoryOutlook here = w.back();
    for (std::size_t i = 0; i + 1 < w.size(); ++i) {
      if (t < w[i].time_s || t >= w[i + 1].time_s) continue;
      const double share = (t - w[i].time_s) / (w[i + 1].time_s - w[i].time_s);
      here.speed_mps = w[i].speed_mps + share * (w[i + 1].speed_mps - w[i].speed_mps);
      here.visible_m = w[i].visible_m + share * (w[i + 1].visible_m - w[i].visible_m);
    }
    const double rest_m = here.visible_m - kRoborunStopping.distance_m(here.speed_mps);
    const double local_s =
        here.speed_mps <= 0.0 ? (rest_m > 0.0 ? 15.0 : 0.0) : std::clamp(rest_m / here.speed_mps, 0.0, 15.0);
    remaining_s = std::min(remaining_s, local_s);
    if (remaining_s <= 0.0) return t;
    remaining_s -= kStep_s;
  }
  return 15.0;
}

TEST(TrajectoryBudget, IsNeverMoreOptimisticThanADenseReferenceAndAtMostAMinorFrameMorePessimistic) {
  core::CounterRng rng(3);
  double worst_pessimism_s = 0.0;
  int inside = 0;
  for (int n = 0; n < 400; ++n) {
    std::array<TrajectoryOutlook, 12> w{};
    double t = 0.0;
    double v = rng.uniform(0.0, 6.0);
    double d = rng.uniform(2.0, 25.0);
    for (TrajectoryOutlook& o : w) {
      o = {t, v, d};
      t += 0.25;
      v = std::clamp(v + rng.uniform(-0.6, 0.6), 0.0, 8.0);
      d = std::clamp(d + rng.uniform(-2.0, 2.0), 0.0, 25.0);
    }
    const double exact_s = seconds(trajectory_budget(w, kRoborunStopping, kLimits));
    const double dense_s = std::max(dense_reference_s(w), seconds(kLimits.shortest));
    ASSERT_LE(exact_s, dense_s + 4e-4);  // the reference's own step, twice
    worst_pessimism_s = std::max(worst_pessimism_s, dense_s - exact_s);
    inside += exact_s > seconds(kLimits.shortest) && exact_s < seconds(kLimits.longest) ? 1 : 0;
  }
  EXPECT_GT(inside, 200) << "otherwise only the limits were compared";
  EXPECT_LT(worst_pessimism_s, 2.5e-3);
}

/// What the closed form is said to be, by looking: coarsely, and then ever closer around the least.
double least_by_looking_s(const TrajectoryOutlook& a, const TrajectoryOutlook& b, const StoppingModel& model,
                          double longest_s) {
  const auto at = [&](double share) {
    const double v = a.speed_mps + share * (b.speed_mps - a.speed_mps);
    const double rest_m = a.visible_m + share * (b.visible_m - a.visible_m) - model.distance_m(v);
    const double here_s = rest_m <= 0.0 ? 0.0 : v > 0.0 ? std::min(rest_m / v, longest_s) : longest_s;
    return a.time_s + share * (b.time_s - a.time_s) + here_s;
  };
  double from = 0.0, to = 1.0, best = 0.0;
  for (const int steps : {2000, 40, 40, 40, 40}) {
    const double step = (to - from) / steps;
    best = from;
    for (int i = 1; i <= steps; ++i)
      if (at(from + step * i) < at(best)) best = from + step * i;
    from = std::max(best - step, 0.0);
    to = std::min(best + step, 1.0);
  }
  return std::min(at(best), longest_s);
}

TEST(TrajectoryBudget, IsTheLeastOfASegmentWhereverItLies) {
  core::CounterRng rng(5);
  std::array<int, 3> where{};  // at its begin, at its end, between
  for (int n = 0; n < 5000; ++n) {
    StoppingModel model{rng.uniform(0.01, 0.4), rng.uniform(0.0, 1.0), rng.uniform(-1.0, 1.0)};
    if (n % 5 == 0) model.quadratic_s2pm = 0.0;
    if (n % 7 == 0) model.linear_s = 0.0;
    std::array<TrajectoryOutlook, 2> w{};
    w[0] = {rng.uniform(0.0, 2.0), rng.uniform(0.0, 12.0), rng.uniform(-2.0, 30.0)};
    w[1] = {w[0].time_s + rng.uniform(0.05, 8.0), rng.uniform(0.0, 12.0), rng.uniform(-2.0, 30.0)};
    if (n % 11 == 0) w[1].speed_mps = w[0].speed_mps;
    if (n % 13 == 0) w[1].visible_m = w[0].visible_m;
    if (n % 17 == 0) (n % 2 == 0 ? w[0] : w[1]).speed_mps = 0.0;
    const double least_s = least_by_looking_s(w[0], w[1], model, 15.0);
    const double exact_s = seconds(trajectory_budget(w, model, kLimits));
    ASSERT_NEAR(exact_s, std::clamp(least_s, 1e-3, 15.0), 2e-6)
        << n << ": " << w[0].time_s << ' ' << w[0].speed_mps << ' ' << w[0].visible_m << ", " << w[1].time_s
        << ' ' << w[1].speed_mps << ' ' << w[1].visible_m << "; " << model.quadratic_s2pm << ' '
        << model.linear_s << ' ' << model.constant_m;
    const double begin_s = least_by_looking_s(w[0], w[0], model, 15.0);
    const double end_s = least_by_looking_s(w[1], w[1], model, 15.0);
    ++where[exact_s > begin_s - 2e-6 ? 0 : exact_s > end_s - 2e-6 ? 1 : 2];
  }
  for (const int count : where) EXPECT_GT(count, 200);
}

TEST(TrajectoryBudget, CountsPartOfTheFirstSegment) {
  // One long segment at constant speed 4 m/s: Eq. 1 at its start gives (10 - 2.095) / 4 = 1.976 s, less than
  // the segment's 5 s. Whole segments only (as printed) would give 0.
  const std::array<TrajectoryOutlook, 2> w{{{0.0, 4.0, 10.0}, {5.0, 4.0, 10.0}}};
  EXPECT_NEAR(seconds(trajectory_budget(w, kRoborunStopping, kLimits)),
              (10.0 - kRoborunStopping.distance_m(4.0)) / 4.0, 1e-6);
}

TEST(TrajectoryBudget, RefusesToGuess) {
  EXPECT_EQ(trajectory_budget({}, kRoborunStopping, kLimits), kLimits.shortest);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::array<TrajectoryOutlook, 3> sound{{{0.0, 1.0, 10.0}, {2.0, 1.0, 10.0}, {4.0, 1.0, 10.0}}};
  ASSERT_GT(seconds(trajectory_budget(sound, kRoborunStopping, kLimits)), 5.0);
  for (std::size_t i = 0; i < sound.size(); ++i) {
    const auto with = [&](double TrajectoryOutlook::*field, double value) {
      auto w = sound;
      w[i].*field = value;
      return trajectory_budget(w, kRoborunStopping, kLimits);
    };
    EXPECT_EQ(with(&TrajectoryOutlook::time_s, kNan), kLimits.shortest) << i;
    EXPECT_EQ(with(&TrajectoryOutlook::time_s, kInfinity), kLimits.shortest) << i;
    EXPECT_EQ(with(&TrajectoryOutlook::speed_mps, kNan), kLimits.shortest) << i;
    EXPECT_EQ(with(&TrajectoryOutlook::visible_m, kNan), kLimits.shortest) << i;
  }
  const std::array<TrajectoryOutlook, 2> back{{{1.0, 1.0, 10.0}, {0.5, 1.0, 10.0}}};
  EXPECT_EQ(trajectory_budget(back, kRoborunStopping, kLimits), kLimits.shortest);
  const std::array<TrajectoryOutlook, 2> at_once{{{0.0, 1.0, 10.0}, {0.0, 1.0, 10.0}}};
  EXPECT_GT(seconds(trajectory_budget(at_once, kRoborunStopping, kLimits)), 5.0);
}

TEST(TrajectoryBudget, OfAVehicleThatStandsIsTheLongestWhereItSeesAnything) {
  const auto standing = [](double speed_mps, double visible_m) {
    const std::array<TrajectoryOutlook, 1> w{{{0.0, speed_mps, visible_m}}};
    return trajectory_budget(w, kRoborunStopping, kLimits);
  };
  EXPECT_EQ(standing(0.0, 0.0), kLimits.shortest);
  EXPECT_EQ(standing(0.0, 0.1), kLimits.longest);
  EXPECT_EQ(standing(-1.0, 0.1), kLimits.longest);
}

}  // namespace
}  // namespace roborun::governor
