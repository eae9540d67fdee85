#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "stages/planning/rrt_star.hpp"
#include "stages/planning/way_memory.hpp"
#include "tests/support/box_view.hpp"

namespace roborun::stages {
namespace {

/// So many lookups.
class Lookups final : public core::StageBudget {
 public:
  explicit Lookups(std::uint64_t most) : most_(most) {}
  [[nodiscard]] bool spent(const core::Work& done) noexcept override { return done.units > most_; }

 private:
  std::uint64_t most_;
};

/// A memory that tells a fifth of each length, as that of a room which winds.
class ToldShort final : public Ways {
 public:
  explicit ToldShort(Ways& ways) : ways_(ways) {}
  [[nodiscard]] Status look(const MapView& map, const WayLook& look, core::StageBudget& budget,
                            core::Work& work) noexcept override {
    return ways_.look(map, look, budget, work);
  }
  [[nodiscard]] Status solve(const Vector3& from_W, const Vector3& goal_W, core::StageBudget& budget,
                             core::Work& work) noexcept override {
    return ways_.solve(from_W, goal_W, budget, work);
  }
  void forget() noexcept override { ways_.forget(); }
  [[nodiscard]] double to_goal_m(const Vector3& p_W) const noexcept override {
    return 0.2 * ways_.to_goal_m(p_W);
  }
  [[nodiscard]] std::size_t known_way(const Vector3& from_W, double within_m,
                                      std::span<Vector3> way_W) const noexcept override {
    return ways_.known_way(from_W, within_m, way_W);
  }

 private:
  Ways& ways_;
};

/// Walls across the way, each with a slot of 2.1 m for a vehicle of 1.8, now left, now right.
class KnownWays : public ::testing::Test {
 protected:
  KnownWays() : block_(RrtStar::arena_bytes({})), arena_(block_) {
    view_.free_W = {Vector3(-25, -25, 0), Vector3(25, 25, 12)};
    for (int i = 0; i < 3; ++i) {
      const double x = 4.5 + 4.5 * i, y = i % 2 == 0 ? 9.0 : -9.0;
      view_.occupied.push_back({Vector3(x, -26, 0), Vector3(x + 0.6, y, 20)});
      view_.occupied.push_back({Vector3(x, y + 2.1, 0), Vector3(x + 0.6, 26, 20)});
    }
    request_.goal_W = Vector3(80, 0, 5);
    request_.start_W = Vector3(0, 0, 5);
    request_.bounds_W = {Vector3(-20, -20, 1.5), Vector3(100, 20, 10)};
    request_.radius_m = 0.9;
    request_.volume_m3 = 1e9;
    request_.horizon_m = 24.0;
    WayMemory::Config config;
    config.bounds_W = request_.bounds_W;
    config.radius_m = 0.9;
    config.max_blocks = 2000;
    ways_block_ = std::vector<std::byte>(WayMemory::arena_bytes(config));
    core::Arena ways_arena(ways_block_);
    ways_ = std::make_unique<WayMemory>(config, ways_arena);
    core::UnlimitedBudget unlimited;
    core::Work work;
    EXPECT_EQ(ways_->look(view_, {{}, request_.start_W, 26.0}, unlimited, work), Status::kOk);
    EXPECT_EQ(ways_->solve(request_.start_W, request_.goal_W, unlimited, work), Status::kOk);
    request_.ways = ways_.get();
  }
  PlanResult plan(std::uint64_t seed, std::uint64_t lookups) {
    RrtStar sut({}, arena_);
    Lookups budget(lookups);
    PlanResult result;
    request_.seed = seed;
    (void)sut.plan(request_, view_, budget, result);
    arena_ = core::Arena(block_);
    return result;
  }
  std::vector<std::byte> block_, ways_block_;
  core::Arena arena_;
  test::BoxView view_;
  std::unique_ptr<WayMemory> ways_;
  PlanRequest request_;
};

TEST_F(KnownWays, AreChainedThroughSlotsInFewLookups) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const PlanResult result = plan(seed, 40000);  // a search of the whole window took 158,000
    ASSERT_GT(result.path_W.size(), 6U) << "seed " << seed;
    EXPECT_EQ(result.path_W[0], request_.start_W);
    EXPECT_GT(result.path_W.back().x(), 14.1) << "past the last wall";
    std::uint64_t lookups = 0;
    for (std::size_t i = 0; i + 1 < result.path_W.size(); ++i)
      EXPECT_TRUE(is_segment_free(view_, result.path_W[i], result.path_W[i + 1], 0.9, lookups)) << i;
    EXPECT_LT(result.cost_m, 80.0) << "18 m from slot to slot";
  }
}

TEST_F(KnownWays, ThatEndAtASlotThatIsTooNarrowAreFollowedToIt) {
  // The memory plans with less room than this plan.
  request_.radius_m = 1.1;
  const PlanResult result = plan(1, 1000000);
  for (const Vector3& p_W : result.path_W) EXPECT_LT(p_W.x(), 4.5) << "not through it";
  EXPECT_LT(result.work.units, 300000U) << "searches are bounded";
}

TEST_F(KnownWays, ThatWindMoreThanTheirLengthTellsAreFollowedWhereNothingElseLeadsOn) {
  const auto told_short = std::make_unique<ToldShort>(*ways_);
  request_.ways = told_short.get();
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const PlanResult result = plan(seed, 400000);
    ASSERT_GE(result.path_W.size(), 2U) << "seed " << seed;
    EXPECT_LT(told_short->to_goal_m(result.path_W.back()), told_short->to_goal_m(request_.start_W));
  }
}

TEST_F(KnownWays, LeadAroundAWallBehindWhichTheGoalIsSeen) {
  // The goal is known to be free, 4.6 m away, and 40 m to fly: a search for a path straight to it takes all the time there is.
  view_.occupied = {{Vector3(2, -26, 0), Vector3(2.6, 17, 20)}};
  request_.goal_W = Vector3(4.6, 0, 5);
  request_.horizon_m = 6.0;
  core::UnlimitedBudget unlimited;
  core::Work work;
  ways_->forget();
  ASSERT_EQ(ways_->look(view_, {{}, request_.start_W, 26.0}, unlimited, work), Status::kOk);
  ASSERT_EQ(ways_->solve(request_.start_W, request_.goal_W, unlimited, work), Status::kOk);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const PlanResult result = plan(seed, 1000000);
    ASSERT_GE(result.path_W.size(), 2U) << "seed " << seed;
    EXPECT_GT(result.path_W.back().y(), 5.0) << "towards the end of the wall";
    EXPECT_LT(result.work.units, 10000U) << "17,000 with a search for it";
  }
}

TEST_F(KnownWays, SameRequestSamePath) {
  const PlanResult a = plan(3, 40000), b = plan(3, 40000);
  ASSERT_EQ(a.path_W.size(), b.path_W.size());
  for (std::size_t i = 0; i < a.path_W.size(); ++i) EXPECT_EQ(a.path_W[i], b.path_W[i]);
  EXPECT_EQ(a.work.units, b.work.units);
}

}  // namespace
}  // namespace roborun::stages
