#include "governor/policy/governor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/names.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::governor {
namespace {

using test::kInfinity;
using test::kNan;

KnobArray<LatencyModel> models_of(const core::CostProfile& costs) {
  return {from_cost(costs.of(core::StageId::kMap)), from_cost(costs.of(core::StageId::kExport)),
          from_cost(costs.of(core::StageId::kPlanner))};
}

GovernorConfig paper_config(Design design) {
  static const core::CostProfile costs = core::paper_profile();
  GovernorConfig c;
  c.design = design;
  c.model = models_of(costs);
  c.point_cloud_s = 0.37;
  c.governor_s = design == Design::kAware ? 0.10 : 0.0;
  c.smoother_s = 0.01;
  c.sensor_volume_max_m3 = 36e3;
  return c;
}

SpaceProfile open_space(double visible_m, double speed_mps) {
  SpaceProfile p;
  p.gap_average_m = kInfinity;
  p.closest_obstacle_m = kInfinity;
  p.closest_unknown_m = visible_m;
  p.sensor_volume_m3 = 30e3;
  p.map_volume_m3 = 60e3;
  p.speed_mps = speed_mps;
  return p;
}

TEST(Governor, StageBudgetsNeverExceedTheDeadline) {
  Governor sut(paper_config(Design::kAware));
  core::CounterRng rng(1);
  int feasible = 0;
  for (int i = 0; i < 5000; ++i) {
    SpaceProfile p = open_space(rng.uniform(0.0, 25.0), rng.uniform(0.0, 6.0));
    p.gap_average_m = rng.uniform(1.0, 20.0);
    p.closest_obstacle_m = rng.uniform(0.3, 20.0);
    p.sensor_volume_m3 = rng.uniform(0.0, 40e3);
    p.map_volume_m3 = rng.uniform(0.0, 1e6);
    const Decision d = sut.decide(p, {static_cast<int>(rng.below(6)), rng.uniform(0.0, 100.0)});
    double total_s = 0.0;
    for (const double s : d.predicted_s) total_s += s;
    ASSERT_LE(total_s, seconds(d.point.deadline) + 1e-9);
    ASSERT_GE(d.point.p1_level, d.point.p0_level);
    ASSERT_GE(d.point.speed_limit_mps, 2.5);
    ASSERT_LE(d.point.speed_limit_mps, 6.0);
    ASSERT_EQ(d.point.deadline.count() % 2'500'000, 0) << "whole minor frames";
    feasible += d.solution.status == Status::kOk ? 1 : 0;
  }
  EXPECT_GT(feasible, 1000) << "otherwise nothing was tested";
}

TEST(Governor, SafeSpeedGrowsWithVisibilityAndFallsWithLatency) {
  const Governor sut(paper_config(Design::kAware));
  double last = -1.0;
  for (double d = 0.0; d <= 25.0; d += 0.5) {
    const double v = sut.safe_speed_mps(d, 1.0);
    EXPECT_GE(v, last);
    last = v;
    if (v > 0.0) {
      // By definition (d - d_stop(v)) / (1.5 v) = latency there.
      EXPECT_NEAR((d - kSitlQuadrotorStopping.distance_m(v)) / (1.5 * v), 1.0, 1e-6);
    }
    EXPECT_LE(sut.safe_speed_mps(d, 2.0), v);
  }
  EXPECT_EQ(sut.safe_speed_mps(kNan, 1.0), 0.0);
}

TEST(Governor, StaticFairFliesAsFastAsItsOwnWorstCaseAllows) {
  const Governor fair(paper_config(Design::kStaticFair));
  // L = 0.38 + (0.25 + 3.6 * 1.26) + (0.25 + 1.11) + 3.6 * 0.37 = 7.86 s; (10 - d_stop(v)) / (1.5 v) = 7.86
  // gives 0.80 m/s.
  EXPECT_NEAR(fair.v_max_mps(), 0.80, 0.02);
  EXPECT_EQ(Governor(paper_config(Design::kStatic)).v_max_mps(), 0.5);
}

TEST(Governor, StaticKnobsAreThePublishedOnes) {
  Governor sut(paper_config(Design::kStatic));
  const Decision d = sut.decide(open_space(25.0, 0.5), {});
  EXPECT_EQ(d.point.p0_level, 0);
  EXPECT_EQ(d.point.p1_level, 0);
  EXPECT_EQ(d.point.v0_m3, 46e3);
  EXPECT_EQ(d.point.v1_m3, 150e3);
  EXPECT_EQ(d.point.v2_m3, 150e3);
  EXPECT_EQ(d.predicted_s[static_cast<std::size_t>(core::StageId::kGovernor)], 0.0) << "it has none";
}

TEST(Governor, LooksFinerWhereObstaclesAreNear) {
  Governor sut(paper_config(Design::kAware));
  SpaceProfile p = open_space(25.0, 0.0);
  for (int i = 0; i < 4; ++i) (void)sut.decide(p, {0, 100.0});
  const int coarse = sut.decide(p, {0, 100.0}).point.p1_level;
  p.closest_obstacle_m = 0.7;
  EXPECT_LT(sut.decide(p, {0, 100.0}).point.p0_level, coarse);
}

TEST(Governor, LosesPrecisionOneLevelADecision) {
  Governor sut(paper_config(Design::kAware));
  SpaceProfile p = open_space(25.0, 0.0);
  p.closest_obstacle_m = 0.5;
  int last = sut.decide(p, {0, 100.0}).point.p0_level;
  p.closest_obstacle_m = kInfinity;
  for (int i = 0; i < 6; ++i) {
    const int level = sut.decide(p, {0, 100.0}).point.p0_level;
    EXPECT_LE(level, last + 1);
    last = level;
  }
  EXPECT_GE(last, 2);
}

/// From one decision's images to the next one's no farther than the thinnest thing allows, but not slower than a crawl.
TEST(Governor, AmongThinThingsSpeedFollowsTheTimeBetweenTwoLooks) {
  GovernorConfig config = paper_config(Design::kAware);
  config.thin_step_m = 1.5;
  Governor sut(config);
  Situation situation{0, 100.0};
  const SpaceProfile p = open_space(20.0, 2.0);
  const double free_mps = sut.decide(p, situation).point.speed_limit_mps;
  situation.thin = true;
  const Decision thin = sut.decide(p, situation);
  EXPECT_LT(thin.point.speed_limit_mps, 0.5 * free_mps);
  EXPECT_NEAR(thin.point.speed_limit_mps * seconds(thin.point.deadline), 1.5, 0.02);
  config.thin_step_m = 1e-3;
  EXPECT_EQ(Governor(config).decide(p, situation).point.speed_limit_mps, config.policy.thin_speed_mps);
  config.design = Design::kStatic;
  EXPECT_EQ(Governor(config).decide(p, situation).point.speed_limit_mps, 0.5) << "the published design";
}

TEST(Governor, DecidesLessOftenWhileSomethingMoves) {
  GovernorConfig config = paper_config(Design::kAware);
  for (LatencyModel& m : config.model) m = LatencyModel{};  // computing costs nothing
  config.point_cloud_s = config.governor_s = config.smoother_s = 0.0;
  const SpaceProfile near = open_space(0.5, 2.0), far = open_space(20.0, 2.0);
  for (const SpaceProfile& p : {near, far}) {
    Situation situation{0, 100.0};
    EXPECT_EQ(Governor(config).decide(p, situation).point.deadline, config.policy.shortest);
    situation.motion = true;
    EXPECT_EQ(Governor(config).decide(p, situation).point.deadline, config.policy.shortest_in_motion);
  }
}

TEST(Governor, FliesNoFasterThanWhatSpendsLeastAndSaysWhatSetsItsSpeed) {
  GovernorConfig config = paper_config(Design::kAware);
  const SpaceProfile p = open_space(20.0, 2.0);
  Situation situation{0, 100.0};
  const auto decided = [&] { return Governor(config).decide(p, situation); };
  const auto expect = [&](double speed_mps, SpeedSource source) {
    const Decision d = decided();
    EXPECT_EQ(d.point.speed_limit_mps, speed_mps);
    EXPECT_STREQ(to_string(d.speed_source), to_string(source));
  };
  expect(config.v_max_mps, SpeedSource::kFile);
  config.cheapest_mps = config.v_max_mps + 0.5;
  expect(config.v_max_mps, SpeedSource::kFile);
  config.cheapest_mps = 3.5;
  expect(3.5, SpeedSource::kEnergy);
  EXPECT_EQ(Governor(config).v_max_mps(), 3.5);
  situation.distance_to_goal_m = 1.0;
  expect(config.policy.near_goal_speed_mps, SpeedSource::kGoal);
  situation.motion = true;
  expect(config.policy.motion_speed_mps, SpeedSource::kMotion);
  situation.thin = true;
  config.thin_step_m = 1e-3;
  expect(config.policy.thin_speed_mps, SpeedSource::kThin);
  Decision d = decided();
  d.cap_speed(5.0);
  EXPECT_EQ(d.speed_source, SpeedSource::kThin) << "no cap of what is slower";
  d.cap_speed(0.25);
  EXPECT_EQ(d.point.speed_limit_mps, 0.25);
  EXPECT_EQ(d.speed_source, SpeedSource::kPolicy);
  config.design = Design::kStatic;
  expect(0.5, SpeedSource::kFixed);
}

TEST(Governor, TimeWinsOverPrecisionAtSpeed) {
  Governor sut(paper_config(Design::kAware));
  SpaceProfile p = open_space(8.0, 6.0);
  p.closest_obstacle_m = 0.7;  // asks for 0.3 m, which takes 4 s
  const Decision d = sut.decide(p, {0, 100.0});
  EXPECT_LT(seconds(d.point.deadline), 1.0);
}

/// Where the precision that is asked for takes a little more than the shortest decision, it gets that time: in the next coarser cells
/// nobody plans among trunks, so a vehicle that hurried stopped.
TEST(Governor, ALittleMoreTimeWinsOverUselessPrecision) {
  SpaceProfile p = open_space(3.0, 6.0);  // less than the stop: there is no time
  p.closest_obstacle_m = 1.7;             // asks for 0.6 m
  for (const double share : {0.05, 0.08, 0.1, 0.15, 0.5}) {
    GovernorConfig config = paper_config(Design::kAware);
    config.model = models_of(core::slower(core::paper_profile(), share));
    config.point_cloud_s *= share;
    config.governor_s *= share;
    SpaceProfile asked = p;
    asked.speed_mps = 0.0;
    const Decision standing = Governor(config).decide(asked, {0, 100.0});
    const Decision hurried = Governor(config).decide(p, {0, 100.0});
    const bool little = standing.point.deadline <= config.policy.fine_within;
    EXPECT_EQ(little, share < 0.12) << share;
    EXPECT_EQ(hurried.point.p0_level == standing.point.p0_level, little) << share;
    EXPECT_TRUE(!little || hurried.point.deadline <= config.policy.fine_within) << share;
  }
}

/// On a narrow way, on a board with a tenth of the paper's times: all 18,000 m3 in view in cells of 0.1 m take several seconds.
TEST(Governor, FineCellsAreForWhatIsNearAndEndInTime) {
  GovernorConfig config = paper_config(Design::kAware);
  config.lattice = {0.1};
  const core::CostProfile costs = core::on_lattice(core::paper_profile(), config.lattice);
  config.model = models_of(core::slower(costs, 0.1));
  config.point_cloud_s = 0.037;
  config.governor_s = 0.01;
  Situation situation{0, 100.0};
  situation.narrow = true;
  SpaceProfile p = open_space(25.0, 0.0);
  p.sensor_volume_m3 = 18e3;
  p.closest_obstacle_m = 1.2;
  const Decision near = Governor(config).decide(p, situation);
  EXPECT_EQ(near.point.p0_level, 0);
  EXPECT_LE(seconds(near.point.deadline), 0.8);
  EXPECT_GE(near.point.v0_m3, config.policy.fine_volume_m3);
  config.policy.fine_volume_m3 = p.sensor_volume_m3;
  const Decision all = Governor(config).decide(p, situation);
  EXPECT_EQ(all.point.p0_level, 0);
  EXPECT_GT(seconds(all.point.deadline), 5.0);
}

/// One camera that sees 10 m far sees 680 m3, which as a ball around the vehicle end after 5.5 m.
TEST(Governor, PlansReachAsFarAsOneCameraSees) {
  Governor sut(paper_config(Design::kAware));
  SpaceProfile p = open_space(10.0, 1.0);
  p.sensor_volume_m3 = 680.0;
  for (int i = 0; i < kPrecisionLevels; ++i) (void)sut.decide(p, {0, 100.0});  // as coarse as it gets
  const Decision d = sut.decide(p, {0, 100.0});
  EXPECT_GT(d.point.v1_m3, 4.0 / 3.0 * std::numbers::pi * std::pow(7.5, 3));
  SpaceProfile hurried = p;
  hurried.closest_unknown_m = 5.0;
  hurried.speed_mps = 4.0;
  const Decision late = Governor(paper_config(Design::kAware)).decide(hurried, {0, 100.0});
  EXPECT_EQ(late.solution.status, Status::kInfeasible)
      << "there is not time for all stages, or something else is tested";
  EXPECT_GT(late.point.v1_m3, 5000.0);
  p.map_volume_m3 = p.sensor_volume_m3;  // nothing else is known
  const Decision seen = sut.decide(p, {0, 100.0});
  EXPECT_NEAR(seen.point.v1_m3, p.map_volume_m3, 1.0);
  EXPECT_LT(seconds(d.point.deadline), 1.05 * seconds(seen.point.deadline)) << "it costs next to nothing";
}

/// Ways are narrow beside holes of a camera too: nothing stands near, and precise looks are not what lacks.
TEST(Governor, HolesDoNotAskForTheFinestCells) {
  GovernorConfig config = paper_config(Design::kAware);
  config.lattice = {0.1};
  config.model = models_of(core::on_lattice(core::paper_profile(), config.lattice));
  const SpaceProfile open = open_space(25.0, 0.0);
  const auto level = [&](double closest_obstacle_m, int failures) {
    Governor sut(config);
    for (int i = 0; i < kPrecisionLevels; ++i) (void)sut.decide(open, {0, 100.0});  // as coarse as it gets
    Situation situation{failures, 100.0};
    situation.narrow = true;
    SpaceProfile p = open;
    p.closest_obstacle_m = closest_obstacle_m;
    return sut.decide(p, situation).point.p0_level;
  };
  EXPECT_GT(level(6.0, 0), 1);
  EXPECT_EQ(level(1.5, 0), 0);
  EXPECT_EQ(level(1.5, config.policy.narrow_tries - 1), 0);
  EXPECT_GT(level(1.5, config.policy.narrow_tries), 0);
}

/// Finer with each failure, twice at the finest (once with each radius of the planner), then quickly again.
TEST(Governor, FailuresGoThroughTheLevelsAgainAndAgain) {
  GovernorConfig config = paper_config(Design::kAware);
  config.model = models_of(core::paper_profile());
  const SpaceProfile p = open_space(25.0, 0.0);
  std::vector<int> levels;
  for (int failures = 0; failures < 12; ++failures) {
    Governor fresh(config);
    for (int i = 0; i < kPrecisionLevels; ++i) (void)fresh.decide(p, {0, 100.0});  // as coarse as it gets
    levels.push_back(fresh.decide(p, {failures, 100.0}).point.p0_level);
  }
  EXPECT_EQ(levels, (std::vector<int>{3, 3, 2, 1, 0, 0, 3, 2, 1, 0, 0, 3}));
}

/// Between trees, gaps of 3.4 m on the average (asked for: 0.45 m): on a board that has time for them, cells of 0.15 m.
TEST(Governor, TakesFinerCellsWhereTheyCostNothingAndWhereItIsTightAndTheyCostLittle) {
  GovernorConfig config = paper_config(Design::kAware);
  config.lattice = {0.15};
  const core::CostProfile costs = core::on_lattice(core::paper_profile(), config.lattice);
  const auto on_board = [&](double slower, double gap_m) {
    config.model = models_of(core::slower(costs, slower));
    config.point_cloud_s = 0.37 * slower;
    config.governor_s = 0.1 * slower;
    config.smoother_s = 0.01 * slower;
    SpaceProfile p = open_space(10.0, 1.0);
    p.sensor_volume_m3 = 900.0;
    p.gap_average_m = gap_m;
    return Governor(config).decide(p, {0, 100.0}).solution.p0_level;
  };
  const double tight_m = config.vehicle_width_m + 4 * 0.45, wide_m = config.vehicle_width_m + 4 * 0.65;
  EXPECT_EQ(on_board(0.005, tight_m), 0);
  EXPECT_EQ(on_board(0.005, wide_m), 0);
  EXPECT_EQ(on_board(0.06, tight_m), 0) << "longer than the longest decision, shorter than `fine_within`";
  EXPECT_GE(on_board(0.06, wide_m), 1);
  EXPECT_GE(on_board(0.5, tight_m), 1);
}

TEST(Governor, EveryInputHasAnAnswer) {
  Governor sut(paper_config(Design::kAware));
  SpaceProfile p = open_space(kNan, kNan);
  p.gap_average_m = kNan;
  p.closest_obstacle_m = kNan;
  p.sensor_volume_m3 = kNan;
  p.map_volume_m3 = kNan;
  p.outlook[0] = {kNan, kNan, kNan};
  p.outlook_count = 1;
  const Decision d = sut.decide(p, {0, kNan});
  EXPECT_GT(d.point.deadline.count(), 0);
  EXPECT_TRUE(std::isfinite(d.point.speed_limit_mps));
}

TEST(Governor, DecideDoesNotAllocate) {
  Governor sut(paper_config(Design::kAware));
  const SpaceProfile p = open_space(20.0, 3.0);
  const test::NoAllocScope scope;
  (void)sut.decide(p, {1, 50.0});
  EXPECT_EQ(scope.count(), 0U);
}

TEST(Governor, DesignsAndWhatSetTheBudgetHaveTheNamesOfReports) {
  test::expect_names<Design>({"aware", "static", "static-fair"}, "unknown");
  test::expect_names<BudgetSource>({"trajectory", "visibility", "shortest", "longest", "failures", "fixed"},
                                   "unknown");
}

}  // namespace
}  // namespace roborun::governor
