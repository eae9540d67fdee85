/// Every stage of the decision lane whose work can grow asks its budget at bounded intervals, and ends soon
/// after it is spent: at once, and after every number of polls. (The governor solves a lattice of fixed
/// size.)
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "stages/perception/brick_map.hpp"
#include "stages/perception/point_cloud.hpp"
#include "stages/perception/space_profiler.hpp"
#include "stages/planning/rrt_star.hpp"
#include "stages/planning/smoother.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;
constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t kInterval = 1024;  // of the contract of StageBudget
constexpr std::uint64_t kOneBox = 1024;    // lookups of one question to the map
constexpr std::uint64_t kSpare = 4096;     // of the planner: for a way at all, and to shorten it
constexpr int kPixels = 64;

/// Spent after so many polls; notes how far apart they were, and what was done when it said so.
class Polls final : public core::StageBudget {
 public:
  explicit Polls(std::uint64_t granted) : granted_(granted) {}
  [[nodiscard]] bool spent(const core::Work& done) noexcept override {
    longest_interval = std::max(longest_interval, done.units - last_units_);
    last_units_ = done.units;
    if (count++ < granted_) return false;
    units_when_spent = std::min(units_when_spent, done.units);
    return true;
  }
  std::uint64_t count{0}, longest_interval{0}, units_when_spent{kNever};

 private:
  std::uint64_t granted_;
  std::uint64_t last_units_{0};
};

/// Runs to the end once, and then with a budget that is spent after k polls, for 60 values of k. `run` does
/// one step and returns its status and work. `tail`: units that may be done after the budget is spent.
template <typename Run>
void expect_anytime(const Run& run, std::uint64_t interval, std::uint64_t tail) {
  Polls never(kNever);
  const auto [whole_status, whole] = run(never);
  ASSERT_NE(whole_status, Status::kBudgetSpent);
  ASSERT_GT(never.count, 3U) << "hardly a poll: nothing was tested";
  EXPECT_LE(never.longest_interval, interval);
  for (std::uint64_t k = 0; k < never.count; k += 1 + never.count / 60) {
    Polls budget(k);
    const auto [status, work] = run(budget);
    ASSERT_GT(budget.count, k) << "this run asked less often than the whole one";
    EXPECT_LE(budget.longest_interval, interval) << k;
    EXPECT_LE(work.units - budget.units_when_spent, tail) << k;
    EXPECT_LE(work.units, whole.units + tail) << k;
  }
  Polls at_once(0);
  EXPECT_LE(run(at_once).second.units, interval + tail);
}

using Outcome = std::pair<Status, core::Work>;

class Anytime : public ::testing::Test {
 protected:
  Anytime() : block_(96U << 20U), arena_(block_) {
    config_.bounds_W = {Vector3(-60, -60, -3), Vector3(60, 60, 27)};
    config_.max_bricks = 2000;
    config_.max_image_width = config_.max_image_height = kPixels;
    map_ = std::make_unique<BrickMap>(config_, arena_);
    cloud_ = std::make_unique<PointCloud>(PointCloud::Config{}, arena_);
    planner_ = std::make_unique<RrtStar>(RrtStar::Config{}, arena_);
    scene_.solid = {{Vector3(-60, -60, -1), Vector3(60, 60, 0)},
                    {Vector3(7, -3, 0), Vector3(9, 3, 12)},
                    {Vector3(-9, 4, 0), Vector3(-7, 6, 12)}};
    frames_ = scene_.look(at_, kPixels);
  }
  void see(const Vector3& p_WB) {
    frames_ = scene_.look(p_WB, kPixels);
    const std::array<Vector3, 1> here{p_WB};
    core::UnlimitedBudget unlimited;
    IntegrationResult result;
    core::Work work;
    ASSERT_EQ(map_->integrate({frames_, 0, kInfinity, here}, unlimited, result), Status::kOk);
    ASSERT_EQ(map_->export_view({0, kInfinity, at_}, unlimited, work), Status::kOk);
  }
  std::vector<std::byte> block_;
  core::Arena arena_;
  BrickMap::Config config_;
  std::unique_ptr<BrickMap> map_;
  std::unique_ptr<PointCloud> cloud_;
  std::unique_ptr<RrtStar> planner_;
  test::Scene scene_;
  std::vector<PosedDepthFrame> frames_;
  const Vector3 at_{0.1, 0.2, 5.0};
};

TEST_F(Anytime, PointCloud) {
  expect_anytime(
      [&](core::StageBudget& budget) -> Outcome {
        core::Work work;
        const Status status = cloud_->step(frames_, 0, budget, work);
        return {status, work};
      },
      kPixels, 0);
}

TEST_F(Anytime, Profile) {
  see(at_);
  core::UnlimitedBudget unlimited;
  core::Work seen;
  ASSERT_EQ(cloud_->step(frames_, 0, unlimited, seen), Status::kOk);
  ASSERT_GT(cloud_->points().size(), 2 * kInterval);
  Trajectory flown = Trajectory::hold(at_, {});
  ASSERT_TRUE(append_rest_to_rest(at_, at_ + Vector3(0, -12, 0), {2.0, 2.0}, flown));
  SpaceProfile profile;
  const auto run = [&](core::StageBudget& budget) -> Outcome {
    core::Work work;
    const Status status = profile_space({}, cloud_->points(), map_->view(), flown, {}, at_, Vector3(0, -2, 0),
                                        Vector3(0, -40, 5), config_.bounds_W, 0.9, profile, budget, work);
    return {status, work};
  };
  expect_anytime(run, kInterval + kOneBox, kOneBox);
  // What was not looked at is near, never far.
  Polls at_once(0);
  EXPECT_EQ(run(at_once).first, Status::kBudgetSpent);
  EXPECT_EQ(profile.closest_obstacle_m, 0.0);
  EXPECT_EQ(profile.closest_unknown_m, 0.0);
  EXPECT_EQ(profile.gap_average_m, SpaceProfilerConfig{}.vehicle_width_m);
  ASSERT_GT(profile.outlook_count, 10U);
  for (std::size_t i = 0; i < profile.outlook_count; ++i) {
    if (profile.outlook[i].speed_mps > 0.05) {
      EXPECT_EQ(profile.outlook[i].visible_m, 0.0) << i;
    }
  }
}

TEST_F(Anytime, MapIntegration) {
  const std::array<Vector3, 1> here{at_};
  expect_anytime(
      [&](core::StageBudget& budget) -> Outcome {
        // A map of its own, so that each run starts from nothing.
        core::Arena arena(std::span<std::byte>(block_).subspan(48U << 20U));
        BrickMap map(config_, arena);
        IntegrationResult result;
        const Status status = map.integrate({frames_, 0, kInfinity, here}, budget, result);
        return {status, result.work};
      },
      2 * kInterval, 2 * kInterval + 6 * kPixels * kPixels);  // surfaces are never left out
}

/// Of each row the positions between the first and the last that was ever known are walked, here of nearly all rows all: everything fits.
TEST_F(Anytime, MapExport) {
  for (const double x_m : {-40.0, 0.0, 40.0})
    for (const double y_m : {-40.0, 0.0, 40.0}) see(at_ + Vector3(x_m, y_m, 0.0));
  const auto run = [&](core::StageBudget& budget, double volume_m3 = 1e9) -> Outcome {
    core::Work work;
    const Status status = map_->export_view({1, volume_m3, at_}, budget, work);
    return {status, work};
  };
  Polls never(kNever);
  EXPECT_EQ(run(never).first, Status::kOk);
  Polls first(kNever);
  EXPECT_EQ(run(first, 2000.0).first, Status::kBudgetSpent) << "more is known";
  const std::uint64_t positions = 26 * 26 * 8;
  EXPECT_GE(never.count, positions / kInterval - 1);
  std::uint64_t lookups = 0;
  const Vector3 near_W = at_ - Vector3(1, 0, 0);
  for (std::uint64_t k = 0; k < never.count; ++k) {
    Polls budget(k);
    EXPECT_EQ(run(budget).first, Status::kBudgetSpent);
    EXPECT_EQ(budget.count, k + 1) << "it went on";
    EXPECT_EQ(map_->view().at(near_W, lookups), CellState::kFree) << "the view of before, around here";
    EXPECT_EQ(map_->view().at(Vector3(8, 0, 5), lookups) == CellState::kFree, false);
  }
}

TEST_F(Anytime, Planner) {
  see(at_ + Vector3(15, 0, 0));
  see(at_);
  PlanRequest request;
  request.start_W = at_;
  request.bounds_W = {Vector3(-55, -55, 1.5), Vector3(55, 55, 10)};
  request.radius_m = 0.9;
  request.volume_m3 = 1e9;
  request.horizon_m = 24.0;
  request.seed = 3;
  // Far away, and behind the pillar in known space.
  for (const Vector3& goal_W : {Vector3(50, 0, 5), Vector3(15, 0, 5)}) {
    request.goal_W = goal_W;
    expect_anytime(
        [&](core::StageBudget& budget) -> Outcome {
          PlanResult result;
          const Status status = planner_->plan(request, map_->view(), budget, result);
          std::uint64_t lookups = 0;
          for (std::size_t i = 0; i + 1 < result.path_W.size(); ++i) {
            EXPECT_TRUE(is_segment_free(map_->view(), result.path_W[i], result.path_W[i + 1],
                                        request.radius_m, lookups));
          }
          return {status, result.work};
        },
        kSpare + kInterval + kOneBox, 2 * (kSpare + kInterval + kOneBox));
  }
}

TEST_F(Anytime, Smoother) {
  // A bend that no curve fits: every way to make one is tried.
  test::BoxView view;
  view.free_W = {Vector3(-200, -200, -50), Vector3(200, 200, 50)};
  view.occupied = {{Vector3(-5, 0.92, -5), Vector3(20, 8, 5)},
                   {Vector3(6.92, -20, -5), Vector3(20, 0.92, 5)},
                   {Vector3(-5, -20, -5), Vector3(5.08, -0.92, 5)}};
  const std::vector<Vector3> path{Vector3::Zero(), Vector3(6, 0, 0), Vector3(6, -8, 0)};
  SmoothRequest request;
  request.path_W = path;
  request.start.p_W = path.front();
  request.radius_m = 0.9;
  Smoother sut;
  expect_anytime(
      [&](core::StageBudget& budget) -> Outcome {
        SmoothResult result;
        result.trajectory = Trajectory::hold(Vector3(7, 7, 7), {});
        const Status status = sut.smooth(request, view, budget, result);
        if (status != Status::kOk) {
          EXPECT_EQ(result.trajectory.hold_W, Vector3(7, 7, 7)) << "untouched";
        }
        return {status, result.work};
      },
      kInterval + 1, 0);
}

}  // namespace
}  // namespace roborun::stages
