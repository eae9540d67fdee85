#include <gtest/gtest.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/tools/benchmark/Benchmark.h>

#include <memory>

#include "core/precision.hpp"
#include "core/random/counter_rng.hpp"
#include "stages/planning/fenced_view.hpp"
#include "stages/planning/ompl_backend/ompl_backend.hpp"
#include "stages/planning/ompl_backend/ompl_space.hpp"
#include "stages/planning/ompl_backend/planner_for_ompl.hpp"
#include "stages/planning/rrt_star.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

PlanRequest request_to(const Vector3& goal_W) {
  PlanRequest r;
  r.start_W = Vector3(0, 0, 5);
  r.goal_W = goal_W;
  r.bounds_W = {Vector3(-25, -25, 1.5), Vector3(200, 25, 10)};
  r.radius_m = 0.9;
  r.volume_m3 = 1e9;
  r.horizon_m = 24.0;
  r.seed = 1;
  return r;
}

test::BoxView pillar_world() {
  test::BoxView view;
  view.free_W = {Vector3(-24, -24, 0), Vector3(24, 24, 12)};
  view.occupied = {{Vector3(8, -2, 0), Vector3(12, 2, 20)},
                   {Vector3(8, 8, 0), Vector3(12, 12, 20)},
                   {Vector3(8, -12, 0), Vector3(12, -8, 20)}};
  return view;
}

class PlannerContract : public ::testing::TestWithParam<const char*> {
 protected:
  PlannerContract() : block_(RrtStar::arena_bytes({})), arena_(block_) {
    if (std::string(GetParam()) == "own") {
      sut_ = std::make_unique<RrtStar>(RrtStar::Config{}, arena_);
    } else {
      sut_ = make_ompl_planner(GetParam(), {});
    }
  }
  void expect_free(const PlanRequest& r, const MapView& view) {
    std::uint64_t lookups = 0;
    for (std::size_t i = 0; i + 1 < result_.path_W.size(); ++i) {
      ASSERT_TRUE(is_segment_free(view, result_.path_W[i], result_.path_W[i + 1], r.radius_m, lookups));
    }
    ASSERT_TRUE(result_.path_W.empty() || result_.path_W[0] == r.start_W);
  }
  std::vector<std::byte> block_;
  core::Arena arena_;
  std::unique_ptr<Planner> sut_;
  core::UnlimitedBudget unlimited_;
  PlanResult result_;
};

TEST_P(PlannerContract, FindsAWayAroundAPillarInsideKnownSpace) {
  const test::BoxView view = pillar_world();
  int better = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlanRequest r = request_to(Vector3(150, 0, 5));
    r.seed = seed;
    const Status status = sut_->plan(r, view, unlimited_, result_);
    if (status != Status::kOk) continue;
    expect_free(r, view);
    better += result_.path_W.back().x() > 12.0 ? 1 : 0;
    EXPECT_FALSE(result_.reaches_goal);
  }
  EXPECT_GE(better, 14) << "past the pillar in most cases";
}

TEST_P(PlannerContract, ReachesAGoalNearby) {
  const test::BoxView view = pillar_world();
  const PlanRequest r = request_to(Vector3(18, 1, 5));
  ASSERT_EQ(sut_->plan(r, view, unlimited_, result_), Status::kOk);
  expect_free(r, view);
  EXPECT_LT((result_.path_W.back() - r.goal_W).norm(), 1.0);
}

TEST_P(PlannerContract, UnknownIsNotFree) {
  test::BoxView view = pillar_world();
  view.free_W = {Vector3(-4, -4, 0), Vector3(4, 4, 12)};
  const PlanRequest r = request_to(Vector3(150, 0, 5));
  (void)sut_->plan(r, view, unlimited_, result_);
  expect_free(r, view);
  for (const Vector3& p : result_.path_W) EXPECT_TRUE(view.free_W.contains(p));
}

TEST_P(PlannerContract, NamesWhatIsWrong) {
  const test::BoxView view = pillar_world();
  PlanRequest r = request_to(Vector3(150, 0, 5));
  r.start_W = Vector3(10, 0, 5);
  EXPECT_EQ(sut_->plan(r, view, unlimited_, result_), Status::kStartBlocked);
  r = request_to(Vector3(10, 0, 5));
  EXPECT_EQ(sut_->plan(r, view, unlimited_, result_), Status::kGoalBlocked);
  r = request_to(Vector3(150, 500, 5));
  EXPECT_EQ(sut_->plan(r, view, unlimited_, result_), Status::kGoalBlocked) << "out of bounds";
  r = request_to(Vector3(std::nan(""), 0, 5));
  EXPECT_EQ(sut_->plan(r, view, unlimited_, result_), Status::kInvalidArgument);
  r = request_to(Vector3(150, 0, 5));
  r.bounds_W.max_W = r.bounds_W.min_W;
  EXPECT_EQ(sut_->plan(r, view, unlimited_, result_), Status::kInvalidArgument);
  test::BoxView cell = pillar_world();
  cell.free_W = {Vector3(-1, -1, 4), Vector3(1, 1, 6)};
  r = request_to(Vector3(150, 0, 5));
  EXPECT_EQ(sut_->plan(r, cell, unlimited_, result_), Status::kNoPath) << "walled in";
}

TEST_P(PlannerContract, NothingOfAKeptPathIsTakenUnchecked) {
  const test::BoxView view = pillar_world();
  PlanRequest r = request_to(Vector3(150, 0, 5));
  for (const Vector3& p : {Vector3(0, 0, 5), Vector3(22, 0, 5), Vector3(40, 0, 5), Vector3(22, 90, 5),
                           Vector3(std::nan(""), 0, 5), Vector3(20, 0, 5)})
    (void)r.kept_W.push_back(p);
  for (r.seed = 1; r.seed <= 3; ++r.seed) {
    (void)sut_->plan(r, view, unlimited_, result_);
    expect_free(r, view);
    for (const Vector3& p : result_.path_W) EXPECT_TRUE(view.free_W.contains(p));
  }
}

INSTANTIATE_TEST_SUITE_P(Planners, PlannerContract, ::testing::Values("own", "RRTstar"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST(OmplPlanner, RefusesUnknownNames) { EXPECT_EQ(make_ompl_planner("Foo", {}), nullptr); }

TEST(OmplPlanner, EveryNameFliesOrNamesWhyNot) {
  const test::BoxView view = pillar_world();
  core::UnlimitedBudget unlimited;
  int reached = 0;
  for (const std::string_view name : ompl_planner_names()) {
    const std::unique_ptr<Planner> sut = make_ompl_planner(name, {200});
    ASSERT_NE(sut, nullptr) << name;
    const PlanRequest r = request_to(Vector3(18, 1, 5));
    PlanResult result;
    const Status status = sut->plan(r, view, unlimited, result);
    EXPECT_TRUE(status == Status::kOk || status == Status::kNoPath) << name << " " << to_string(status);
    std::uint64_t lookups = 0;
    for (std::size_t i = 0; i + 1 < result.path_W.size(); ++i) {
      ASSERT_TRUE(is_segment_free(view, result.path_W[i], result.path_W[i + 1], r.radius_m, lookups)) << name;
    }
    reached += result.reaches_goal ? 1 : 0;
  }
  EXPECT_GE(reached, 15) << "with so few iterations";
}

/// OMPL measures both planners; ours keeps what OMPL promises: an exact solution that passes OMPL's own
/// checks.
TEST(OmplPlanner, MeasuresOursBesideItsOwn) {
  const test::BoxView view = pillar_world();
  std::uint64_t lookups = 0;
  const PlanRequest r = request_to(Vector3(18, 1, 5));
  const auto info = make_ompl_space(view, r.bounds_W, r.radius_m, lookups);
  ompl::geometric::SimpleSetup setup(info);
  const auto problem = make_ompl_problem(info, r.start_W, r.goal_W, 0.3);
  setup.setStartState(ompl::base::ScopedState<>(info->getStateSpace(), problem->getStartState(0)));
  setup.setGoal(problem->getGoal());
  setup.setOptimizationObjective(problem->getOptimizationObjective());
  ompl::tools::Benchmark sut(setup, "pillar");
  sut.addPlanner(make_planner_for_ompl(info, view, r.radius_m, {}));
  sut.addPlanner(allocate_ompl_planner("RRTConnect", info));
  ompl::tools::Benchmark::Request request(0.2, 500.0, 3, 0.05, false, false, false);
  sut.benchmark(request);
  const auto& data = sut.getRecordedExperimentData();
  ASSERT_EQ(data.planners.size(), 2U);
  EXPECT_EQ(data.planners[0].name, "geometric_roborun_RRTstar") << "OMPL adds the prefix";
  for (const auto& planner : data.planners) {
    ASSERT_EQ(planner.runs.size(), 3U);
    for (const auto& run : planner.runs) {
      EXPECT_EQ(run.at("solved BOOLEAN"), "1") << planner.name;
      EXPECT_EQ(run.at("correct solution BOOLEAN"), "1") << planner.name;
    }
  }
}

class RrtStarTest : public ::testing::Test {
 protected:
  std::vector<std::byte> block_ = std::vector<std::byte>(RrtStar::arena_bytes({}));
  core::Arena arena_{block_};
  RrtStar sut_{{}, arena_};
  core::UnlimitedBudget unlimited_;
  PlanResult result_;
};

TEST_F(RrtStarTest, RepeatsForTheSameSeed) {
  const test::BoxView view = pillar_world();
  PlanResult a, b;
  (void)sut_.plan(request_to(Vector3(150, 0, 5)), view, unlimited_, a);
  PlanRequest other = request_to(Vector3(150, 3, 5));
  other.seed = 9;
  (void)sut_.plan(other, view, unlimited_, b);
  (void)sut_.plan(request_to(Vector3(150, 0, 5)), view, unlimited_, b);
  ASSERT_EQ(a.path_W.size(), b.path_W.size());
  for (std::size_t i = 0; i < a.path_W.size(); ++i) EXPECT_EQ(a.path_W[i], b.path_W[i]);
}

/// 60 m of known space with a row of pillars across the straight line, and the goal at its end.
test::BoxView aisle() {
  test::BoxView view;
  view.free_W = {Vector3(-9, -24, 0), Vector3(69, 24, 12)};
  for (const double x : {12.0, 27.0, 42.0})
    view.occupied.push_back({Vector3(x, -3, 0), Vector3(x + 3, 3, 20)});
  return view;
}
PlanRequest through_the_aisle() {
  PlanRequest r = request_to(Vector3(60, 0, 5));
  r.horizon_m = 120.0;
  return r;
}

TEST_F(RrtStarTest, PullsAPathToAKnownGoalTight) {
  const test::BoxView view = aisle();
  // Around the corners of the first pillar, (11.1, 3.9), and of the last, (45.9, 3.9): 61.0 m; the boxes of a
  // check reach a little farther than the vehicle.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlanRequest r = through_the_aisle();
    r.seed = seed;
    ASSERT_EQ(sut_.plan(r, view, unlimited_, result_), Status::kOk);
    EXPECT_TRUE(result_.reaches_goal);
    EXPECT_GT(result_.cost_m, 60.9);
    EXPECT_LT(result_.cost_m, 62.2) << "seed " << seed;
    std::uint64_t lookups = 0;
    for (std::size_t i = 0; i + 1 < result_.path_W.size(); ++i)
      ASSERT_TRUE(is_segment_free(view, result_.path_W[i], result_.path_W[i + 1], r.radius_m, lookups));
  }
}

TEST_F(RrtStarTest, EndsWithTheFirstPathThatSatisfies) {
  const test::BoxView view = aisle();
  PlanResult first, best;
  PlanRequest r = through_the_aisle();
  ASSERT_EQ(sut_.plan(r, view, unlimited_, best), Status::kOk);
  r.satisfied_m = 1e300;
  ASSERT_EQ(sut_.plan(r, view, unlimited_, first), Status::kOk);
  EXPECT_TRUE(first.reaches_goal);
  EXPECT_LT(first.work.units, best.work.units / 10);
  EXPECT_GE(first.cost_m, best.cost_m);
}

TEST_F(RrtStarTest, GoesAsNearAsItCanToAGoalThatIsWalledIn) {
  test::BoxView view = aisle();
  view.occupied.push_back({Vector3(50, -24, 0), Vector3(51, 24, 20)});
  ASSERT_EQ(sut_.plan(through_the_aisle(), view, unlimited_, result_), Status::kOk);
  EXPECT_FALSE(result_.reaches_goal);
  EXPECT_GT(result_.path_W.back().x(), 30.0);
  EXPECT_LT(result_.path_W.back().x(), 50.0);
}

TEST_F(RrtStarTest, FindsWhatItFoundBeforeWithLessVolume) {
  const test::BoxView view = pillar_world();
  int past = 0, without = 0, with = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    PlanRequest r = request_to(Vector3(150, 0, 5));
    r.seed = seed;
    PlanResult before;
    ASSERT_EQ(sut_.plan(r, view, unlimited_, before), Status::kOk);
    if (before.path_W.back().x() < 12.0) continue;
    ++past;
    r.start_W = Vector3(2, 0, 5);
    r.seed += 1000;
    r.volume_m3 = 1500.0;
    (void)sut_.plan(r, view, unlimited_, result_);
    without += !result_.path_W.empty() && result_.path_W.back().x() > 12.0 ? 1 : 0;
    r.kept_W = before.path_W;
    (void)sut_.plan(r, view, unlimited_, result_);
    with += !result_.path_W.empty() && result_.path_W.back().x() > 12.0 ? 1 : 0;
  }
  EXPECT_GE(past, 40);
  EXPECT_GE(with, past - 1);
  EXPECT_LT(without, past - 8) << "or the volume is no limit, and this test shows nothing";
}

/// In front of a rack whose first layer of cells is all that is known of it, the aisle beside it unknown.
TEST_F(RrtStarTest, GoesAsideOfAWallOfOneCellAhead) {
  test::BoxView view;
  view.free_W = {Vector3(-24, -24, 0), Vector3(2, 24, 12)};
  for (const double wall_m : {1.7, 1.8, 1.9}) {
    view.occupied = {{Vector3(wall_m, -0.6, 0), Vector3(wall_m + kPublishedCell_m, 0.6, 12)}};
    const Status status = sut_.plan(request_to(Vector3(42, 0, 5)), view, unlimited_, result_);
    ASSERT_EQ(status, Status::kOk) << wall_m;
    EXPECT_GT(std::abs(result_.path_W.back().y()), 1.4) << wall_m;
  }
}

TEST_F(RrtStarTest, StopsAtVolumeAndBudget) {
  const test::BoxView view = pillar_world();
  PlanRequest r = request_to(Vector3(150, 0, 5));
  r.volume_m3 = 600.0;
  EXPECT_EQ(sut_.plan(r, view, unlimited_, result_), Status::kBudgetSpent);
  EXPECT_LT(result_.work.volume_m3, 900.0);
  class None final : public core::StageBudget {
   public:
    [[nodiscard]] bool spent(const core::Work&) noexcept override { return true; }
  } none;
  r.volume_m3 = 1e9;
  const Status status = sut_.plan(r, view, none, result_);
  EXPECT_TRUE(status == Status::kBudgetSpent || status == Status::kNoPath);
}

TEST_F(RrtStarTest, PlanDoesNotAllocate) {
  const test::BoxView view = pillar_world();
  const test::NoAllocScope scope;
  (void)sut_.plan(request_to(Vector3(150, 0, 5)), view, unlimited_, result_);
  (void)sut_.plan(request_to(Vector3(18, 1, 5)), view, unlimited_, result_);
  EXPECT_EQ(scope.count(), 0U);
}

TEST(FencedView, IsTheMapInsideTheFenceAndOccupiedOutside) {
  const test::BoxView map = pillar_world();
  core::Fence fence;
  ASSERT_EQ(fence.add_circle(core::FenceSide::kKeepIn, {0, 0}, 7.0), core::FenceFault::kNone);
  const FencedView sut(map, fence);
  std::uint64_t lookups = 0;
  for (const double x_m : {-20.0, -6.0, 0.0, 6.0, 10.0, 20.0}) {
    const Aabb box = Aabb::around(Vector3(x_m, 0, 5), 0.5);
    const bool inside = std::fabs(x_m) < 7.0;
    EXPECT_EQ(sut.is_free(box, lookups), inside) << x_m;
    EXPECT_EQ(sut.is_free_at_finest(box, lookups), inside) << x_m;
    EXPECT_EQ(sut.at(Vector3(x_m, 0, 5), lookups), inside ? CellState::kFree : CellState::kOccupied) << x_m;
  }
  EXPECT_EQ(sut.at(Vector3(0, 0, 13), lookups), CellState::kUnknown) << "the map's answer, inside the fence";
  EXPECT_EQ(sut.cell_m(), map.cell_m());
}

}  // namespace
}  // namespace roborun::stages
