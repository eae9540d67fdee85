#include <gtest/gtest.h>

#include <memory>

#include "core/random/counter_rng.hpp"
#include "stages/planning/ompl_backend/ompl_backend.hpp"
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
  PlannerContract() : block_(4U << 20U), arena_(block_) {
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

INSTANTIATE_TEST_SUITE_P(Planners, PlannerContract, ::testing::Values("own", "RRTstar"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST(OmplPlanner, RefusesUnknownNames) { EXPECT_EQ(make_ompl_planner("Foo", {}), nullptr); }

TEST(RrtStar, RepeatsForTheSameSeed) {
  std::vector<std::byte> block(4U << 20U);
  core::Arena arena(block);
  RrtStar sut({}, arena);
  const test::BoxView view = pillar_world();
  core::UnlimitedBudget unlimited;
  PlanResult a, b;
  (void)sut.plan(request_to(Vector3(150, 0, 5)), view, unlimited, a);
  PlanRequest other = request_to(Vector3(150, 3, 5));
  other.seed = 9;
  (void)sut.plan(other, view, unlimited, b);
  (void)sut.plan(request_to(Vector3(150, 0, 5)), view, unlimited, b);
  ASSERT_EQ(a.path_W.size(), b.path_W.size());
  for (std::size_t i = 0; i < a.path_W.size(); ++i) EXPECT_EQ(a.path_W[i], b.path_W[i]);
}

TEST(RrtStar, StopsAtVolumeAndBudget) {
  std::vector<std::byte> block(4U << 20U);
  core::Arena arena(block);
  RrtStar sut({}, arena);
  const test::BoxView view = pillar_world();
  core::UnlimitedBudget unlimited;
  PlanResult result;
  PlanRequest r = request_to(Vector3(150, 0, 5));
  r.volume_m3 = 600.0;
  EXPECT_EQ(sut.plan(r, view, unlimited, result), Status::kBudgetSpent);
  EXPECT_LT(result.work.volume_m3, 900.0);
  class None final : public core::StageBudget {
   public:
    [[nodiscard]] bool spent(const core::Work&) noexcept override { return true; }
  } none;
  r.volume_m3 = 1e9;
  const Status status = sut.plan(r, view, none, result);
  EXPECT_TRUE(status == Status::kBudgetSpent || status == Status::kNoPath);
}

TEST(RrtStar, PlanDoesNotAllocate) {
  std::vector<std::byte> block(4U << 20U);
  core::Arena arena(block);
  RrtStar sut({}, arena);
  const test::BoxView view = pillar_world();
  core::UnlimitedBudget unlimited;
  PlanResult result;
  const test::NoAllocScope scope;
  (void)sut.plan(request_to(Vector3(150, 0, 5)), view, unlimited, result);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::stages
