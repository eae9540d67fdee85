#include "stages/planning/way_memory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "tests/support/box_view.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;

class WayMemoryTest : public ::testing::Test {
 protected:
  WayMemoryTest() {
    config_.bounds_W = {Vector3(-20, -40, 1.5), Vector3(100, 40, 10)};
    config_.radius_m = 0.9;
    config_.max_blocks = 4000;
    // Known around the start, unknown beyond.
    view_.free_W = {Vector3(-25, -25, 0), Vector3(25, 25, 12)};
  }
  void make() {
    block_ = std::vector<std::byte>(WayMemory::arena_bytes(config_));
    arena_.emplace(block_);
    sut_ = std::make_unique<WayMemory>(config_, *arena_);
    ASSERT_FALSE(arena_->exhausted());
  }
  Status look_and_solve(const Vector3& from_W) {
    EXPECT_EQ(sut_->look(view_, {now_, from_W, 26.0}, unlimited_, work_), Status::kOk);
    return sut_->solve(from_W, goal_W_, unlimited_, work_);
  }
  Vector3 last_known(const Vector3& from_W, double within_m = 100.0) {
    std::array<Vector3, 64> way_W;
    const std::size_t count = sut_->known_way(from_W, within_m, way_W);
    return count == 0 ? from_W : way_W[count - 1];
  }
  /// How far to the left the known way leads.
  [[nodiscard]] double farthest_side_m() {
    std::array<Vector3, 64> way_W;
    const std::size_t count = sut_->known_way(start_W_, 100.0, way_W);
    EXPECT_GT(count, 0U);
    double side_m = 0.0;
    for (std::size_t i = 0; i < count; ++i) side_m = std::fmax(side_m, way_W[i].y());
    return side_m;
  }
  void box(double x0, double y0, double x1, double y1) {
    view_.occupied.push_back({Vector3(x0, y0, 0), Vector3(x1, y1, 20)});
  }
  /// A closed room but for two cells of a wall: what surely fits inside the vehicle, which plans with six.
  void wall_in_but_for_a_crack() {
    config_.body_m = 0.6;
    box(-15, 20, 20.6, 20.6);
    box(-15, -20.6, 20.6, -20);
    box(-15.6, -21, -15, 21);
    box(20, -21, 20.6, -0.4);
    box(20, 0.4, 20.6, 21);
  }
  WayMemory::Config config_;
  MonotonicTime now_{};
  test::BoxView view_;
  std::vector<std::byte> block_;
  std::optional<core::Arena> arena_;
  std::unique_ptr<WayMemory> sut_;
  core::UnlimitedBudget unlimited_;
  core::Work work_;
  Vector3 start_W_{0, 0, 5}, goal_W_{80, 0, 5};
};

TEST_F(WayMemoryTest, IsForVehiclesOfUpToSeventeenCells) {
  config_.finest_m = 0.1;
  config_.radius_m = 0.86;
  EXPECT_FALSE(WayMemory::fits(config_));
  config_.radius_m = 0.85;
  config_.bounds_W = {Vector3(-5, -10, 1.5), Vector3(20, 10, 10)};
  goal_W_ = Vector3(18, 0, 5);
  ASSERT_TRUE(WayMemory::fits(config_));
  make();
  box(5, -10, 5.3, 3);
  for (int look = 0; look < 10; ++look) ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(farthest_side_m(), 3.0);
  config_.body_m = 0.9;
  EXPECT_FALSE(WayMemory::fits(config_)) << "a body without room";
}

TEST_F(WayMemoryTest, OpenSpaceIsStraightOnAndUnknownSpaceCountsTwice) {
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_NEAR(sut_->to_goal_m(start_W_), 24.0 + 2.0 * 56.0, 12.0);
  const Vector3 end_W = last_known(start_W_);
  EXPECT_GT(end_W.x(), 18.0);
  EXPECT_LT(std::fabs(end_W.y()), 6.0);
}

TEST_F(WayMemoryTest, LeadsAroundAWallThatIsKnown) {
  box(10, -20, 10.6, 12);  // open at y > 12, within what is known
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(farthest_side_m(), 12.0);
  EXPECT_GT(last_known(start_W_).x(), 10.0) << "past it";
}

TEST_F(WayMemoryTest, LeavesADeadEnd) {
  // A corridor with one opening, behind the vehicle.
  box(20, -6, 20.6, 6);
  box(-15, 6, 20.6, 6.6);
  box(-15, -6.6, 20.6, -6);
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  std::array<Vector3, 64> way_W;
  const std::size_t count = sut_->known_way(start_W_, 100.0, way_W);
  double back_m = 0.0;
  for (std::size_t i = 0; i < count; ++i) back_m = std::fmin(back_m, way_W[i].x());
  EXPECT_LT(back_m, -10.0) << "out of it";
  EXPECT_GT(last_known(start_W_).x(), 20.0) << "and past it";
  EXPECT_LT(last_known(start_W_, 10.0).x(), -2.0) << "no farther than asked for";
}

TEST_F(WayMemoryTest, ProvesThatThereIsNoWay) {
  // Closed on all sides, floor and ceiling are the bounds.
  box(20, -21, 20.6, 21);
  box(-15, 20, 20.6, 20.6);
  box(-15, -20.6, 20.6, -20);
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk) << "open behind";
  box(-15.6, -21, -15, 21);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath);
  EXPECT_EQ(sut_->to_goal_m(start_W_), kInfinity);
}

TEST_F(WayMemoryTest, AShellAroundTheGoalIsAProofThoughTheWorldGoesOn) {
  goal_W_ = Vector3(15, 0, 5);
  box(12, -3, 12.6, 3);
  box(12, -3, 18, -2.4);
  box(12, 2.4, 18, 3);
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk) << "open behind";
  box(17.4, -3, 18, 3);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath);
  // The same shell around the vehicle.
  std::swap(start_W_, goal_W_);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath);
}

TEST_F(WayMemoryTest, AGapThatMayBeWideEnoughProvesNothing) {
  // Two cells of it are free: what surely fits inside a vehicle of 0.45 m, however a gap lies.
  config_.radius_m = 0.55;
  config_.body_m = 0.45;
  box(20, -21, 20.6, -0.4);
  box(20, 0.2, 20.6, 21);
  box(-15, 20, 20.6, 20.6);
  box(-15, -20.6, 20.6, -20);
  box(-15.6, -21, -15, 21);
  make();
  EXPECT_EQ(look_and_solve(start_W_), Status::kInfeasible);
  EXPECT_EQ(sut_->to_goal_m(start_W_), kInfinity) << "no way to fly, either";
  goal_W_ = Vector3(23, 0, 5);
  EXPECT_EQ(look_and_solve(start_W_), Status::kInfeasible) << "inside what was seen, too";
  box(20, -1, 20.6, 1);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath) << "closed";
  goal_W_ = Vector3(80, 0, 5);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath);
}

TEST_F(WayMemoryTest, AGapOnASlantIsAsWideAsTheVehiclesBallNeeds) {
  // 1.92 m between two corners: a cube of the vehicle's width does not fit, however it lies.
  config_.radius_m = 0.8;
  box(20.1, -21, 20.7, 0);
  box(22.2, 1.2, 22.8, 21);
  box(-15, 20, 22.8, 20.6);
  box(-15, -20.6, 22.8, -20);
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_LT(farthest_side_m(), 5.0);
  box(20.1, -21, 20.7, 0.3);
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(std::fabs(last_known(start_W_, 30.0).y()), 10.0) << "a cell less: around it";
}

TEST_F(WayMemoryTest, AGapThatIsOneCellTooNarrowIsAWayWhereThereIsNoOther) {
  // Three cells of it are free: as wide as a vehicle of 0.45 m, which plans with 0.55, and so with four cells.
  config_.radius_m = 0.55;
  config_.body_m = 0.45;
  box(20, -21, 20.6, -0.4);
  box(20, 0.5, 20.6, 21);
  box(-15, 20, 20.6, 20.6);
  box(-15, -20.6, 20.6, -20);
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(std::fabs(last_known(start_W_).y()), 10.0) << "it is open behind: around the outside";
  box(-15.6, -21, -15, 21);
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  const Vector3 end_W = last_known(start_W_);
  EXPECT_GT(end_W.x(), 17.0) << "goes there to look closely";
  EXPECT_LT(end_W.x(), 20.0) << "and no farther";
  EXPECT_LT(std::fabs(end_W.y()), 3.0);
  view_.occupied[1].min_W.y() = 1.5;
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(last_known(start_W_).x(), 23.0) << "it turned out to be wide enough";
  box(20, -1, 20.6, 2);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath) << "closed";
}

TEST_F(WayMemoryTest, ASurfaceThatWasMetOnceIsLookedAtAgainBeforeItProvesAnything) {
  config_.body_m = 0.45;
  box(20, -21, 20.6, 21);
  box(-15, 20, 20.6, 20.6);
  box(-15, -20.6, 20.6, -20);
  view_.unsure.push_back({Vector3(19, -1.2, 0), Vector3(21, 1.2, 20)});
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(std::fabs(last_known(start_W_).y()), 10.0) << "it is open behind: around the outside";
  box(-15.6, -21, -15, 21);
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(last_known(start_W_).x(), 17.0) << "goes there to look closely";
  EXPECT_LT(last_known(start_W_).x(), 20.0);
  EXPECT_LT(std::fabs(last_known(start_W_).y()), 3.0);
  view_.unsure.back().max_W.x() = 19.5;
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath) << "met again";
}

TEST_F(WayMemoryTest, WhereASurfaceIsAboutItGoesOnlyIfThereIsNoOtherWay) {
  // A wall that is seen from far away: nobody knows yet which of its cells are occupied.
  box(-15, 20, 20.6, 20.6);
  box(-15, -20.6, 20.6, -20);
  view_.vague.push_back({Vector3(20, -21, 0), Vector3(20.6, 21, 20)});
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(std::fabs(last_known(start_W_).y()), 10.0) << "it is open behind: around the outside";
  box(-15.6, -21, -15, 21);
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk) << "nothing is proved by it";
  EXPECT_GT(last_known(start_W_).x(), 17.0) << "goes there to look closely";
  EXPECT_LT(last_known(start_W_).x(), 20.0) << "and no farther";
}

TEST_F(WayMemoryTest, ACrackInWhichASurfaceIsAboutIsLookedAt) {
  // Too narrow to be planned with, and no proof while nobody knows what is there.
  wall_in_but_for_a_crack();
  view_.vague.push_back({Vector3(20, -0.4, 0), Vector3(20.6, 0.4, 20)});
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(last_known(start_W_).x(), 17.0) << "goes there to look closely";
  EXPECT_LT(last_known(start_W_).x(), 20.0) << "and no farther";
  box(20, -0.4, 20.6, 0.4);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath) << "it turned out to be closed";
}

TEST_F(WayMemoryTest, AHoleInAWallThatNobodySawIsAWayUntilItIsSeenToBeTooNarrow) {
  wall_in_but_for_a_crack();
  view_.free_W.max_W.x() = 20.0;
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  const Vector3 end_W = last_known(start_W_);
  EXPECT_GT(end_W.x(), 17.0) << "goes there to look";
  EXPECT_LT(std::fabs(end_W.y()), 2.0);
  view_.free_W.max_W.x() = 25.0;
  EXPECT_EQ(look_and_solve(start_W_), Status::kInfeasible) << "seen to be open";
  box(20, -1, 20.6, 1);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath) << "seen to be closed";
}

TEST_F(WayMemoryTest, AFenceThatClosesEverythingIsAProof) {
  const std::array<core::FencePoint, 4> wall{{{10, -41}, {12, -41}, {12, 41}, {10, 41}}};
  config_.body_m = 0.6;
  ASSERT_EQ(config_.fence.add_polygon(core::FenceSide::kKeepOut, wall), core::FenceFault::kNone);
  box(-15.6, -41, -15, 41);
  view_.free_W = {Vector3(-25, -45, 0), Vector3(25, 45, 12)};
  make();
  EXPECT_EQ(sut_->look(view_, {now_, Vector3(0, 25, 5), 26.0}, unlimited_, work_), Status::kOk);
  EXPECT_EQ(sut_->look(view_, {now_, Vector3(0, -25, 5), 26.0}, unlimited_, work_), Status::kOk);
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath);
}

TEST_F(WayMemoryTest, ARoomBesideAVehicleThatStandsInNoneProvesNothing) {
  // Around a small closed cell, and the vehicle in its wall: too near to it on both sides.
  box(-2, -2, 2, -1.5), box(-2, 1.5, 2, 2), box(-2, -2, -1.5, 2), box(1.5, -2, 2, 2);
  make();
  EXPECT_EQ(look_and_solve(start_W_), Status::kNoPath) << "inside it";
  EXPECT_EQ(look_and_solve(Vector3(0.9, 0, 5)), Status::kStartBlocked)
      << "0.6 m from the wall, 0.9 are its radius";
}

TEST_F(WayMemoryTest, AFenceIsAWall) {
  const std::array<core::FencePoint, 4> wall{{{10, -39}, {12, -39}, {12, 12}, {10, 12}}};
  ASSERT_EQ(config_.fence.add_polygon(core::FenceSide::kKeepOut, wall), core::FenceFault::kNone);
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_GT(farthest_side_m(), 12.0);
}

TEST_F(WayMemoryTest, RemembersWhatTheMapGaveUp) {
  box(20, -6, 20.6, 6);
  box(-15, 6, 20.6, 6.6);
  box(-15, -6.6, 20.6, -6);
  make();
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  // Far away, where nothing of it is looked at again.
  view_ = {};
  view_.free_W = {Vector3(-25, -25, 0), Vector3(-15, 25, 12)};
  const Vector3 away_W(-18, -12, 5);
  ASSERT_EQ(sut_->look(view_, {now_, away_W, 4.0}, unlimited_, work_), Status::kOk);
  const Vector3 deep_W(15, 0, 5);
  ASSERT_EQ(sut_->solve(deep_W, goal_W_, unlimited_, work_), Status::kOk);
  EXPECT_GT(sut_->to_goal_m(deep_W), sut_->to_goal_m(start_W_) + 10.0) << "the dead end is still one";
}

TEST_F(WayMemoryTest, AGoalInsideAnObstacleIsAnswered) {
  goal_W_ = Vector3(15, 0, 5);
  box(10, -5, 20, 5);
  make();
  EXPECT_EQ(look_and_solve(start_W_), Status::kGoalBlocked);
}

TEST_F(WayMemoryTest, NotFiniteIsRefused) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  make();
  EXPECT_EQ(sut_->look(view_, {now_, Vector3(kNaN, 0, 0), 10.0}, unlimited_, work_),
            Status::kInvalidArgument);
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  EXPECT_EQ(sut_->solve(Vector3(kNaN, 0, 0), goal_W_, unlimited_, work_), Status::kStartBlocked);
  EXPECT_EQ(sut_->to_goal_m(Vector3(kNaN, 0, 0)), kInfinity);
}

TEST_F(WayMemoryTest, EndsWithItsBudget) {
  class Little final : public core::StageBudget {
   public:
    [[nodiscard]] bool spent(const core::Work& done) noexcept override { return done.units > 100; }
  } little;
  make();
  EXPECT_EQ(sut_->look(view_, {now_, start_W_, 26.0}, little, work_), Status::kBudgetSpent);
}

TEST_F(WayMemoryTest, ALookReadsNothingBeyondItsReach) {
  make();
  ASSERT_EQ(sut_->look(view_, {now_, start_W_, 4.0}, unlimited_, work_), Status::kOk);
  ASSERT_EQ(sut_->solve(start_W_, goal_W_, unlimited_, work_), Status::kOk);
  const double near_m = sut_->to_goal_m(start_W_);
  ASSERT_EQ(look_and_solve(start_W_), Status::kOk);
  // Some 15 m more of the way are known to be free, and count once instead of twice.
  EXPECT_GT(near_m, sut_->to_goal_m(start_W_) + 10.0);
}

/// What is unknown where it stands becomes dear: by how long it stands, not by how often it looks.
TEST_F(WayMemoryTest, WhereItStandsTheUnknownBecomesDearWithTime) {
  view_.free_W = {Vector3(-25, -25, 0), Vector3(5, 25, 12)};  // unknown from 5 m ahead on
  const auto stand = [&](int looks, Nanos between) {
    make();
    for (int i = 0; i <= looks; ++i, now_ += between) EXPECT_EQ(look_and_solve(start_W_), Status::kOk);
    return sut_->to_goal_m(start_W_);
  };
  using std::chrono::milliseconds;
  const double at_once_m = stand(0, milliseconds(0));
  const double often_m = stand(100, milliseconds(40)), seldom_m = stand(1, milliseconds(4000));
  EXPECT_GT(seldom_m, at_once_m + 5.0);
  EXPECT_NEAR(seldom_m, often_m, 0.01);
  EXPECT_EQ(stand(100, milliseconds(0)), at_once_m);
  EXPECT_EQ(stand(1, milliseconds(20'000)), stand(30, milliseconds(1000))) << "after 12.8 s no more";
}

TEST_F(WayMemoryTest, ALookForgetsWhatHasChangedAndKeepsTheRest) {
  make();
  const auto to_goal_m = [&] {
    EXPECT_EQ(look_and_solve(start_W_), Status::kOk);
    return sut_->to_goal_m(start_W_);
  };
  const double open_m = to_goal_m();
  box(10, -20, 10.6, 20);
  const double walled_m = to_goal_m();
  EXPECT_GT(walled_m, open_m + 5.0);
  EXPECT_EQ(to_goal_m(), walled_m) << "nothing changed";
  view_.occupied.clear();
  EXPECT_EQ(to_goal_m(), open_m);
}

/// Where more changes all the time than one look takes, the rest gets its turn.
TEST_F(WayMemoryTest, WhatChangesAllTheTimeHidesNothingElse) {
  class Polls final : public core::StageBudget {
   public:
    [[nodiscard]] bool spent(const core::Work& /*done*/) noexcept override { return ++count_ > most; }
    int most{1 << 30}, count_{0};
  } polls;
  constexpr double kReach_m = 14.0;
  const auto look = [&](int most) {
    polls.most = most;
    polls.count_ = 0;
    return sut_->look(view_, {now_, start_W_, kReach_m}, polls, work_);
  };
  const auto to_goal_m = [&] {
    EXPECT_EQ(sut_->solve(start_W_, goal_W_, unlimited_, work_), Status::kOk);
    return sut_->to_goal_m(start_W_);
  };
  make();
  ASSERT_EQ(look(1 << 30), Status::kOk);
  ASSERT_EQ(look(1 << 30), Status::kOk);
  const int reading = polls.count_;  // nothing was renewed
  const double open_m = to_goal_m();
  constexpr int kBlocks = 4;  // of one look
  int cut = 0;
  for (int i = 0; i < 60; ++i) {
    view_.occupied.clear();
    box(5, -6, 5.6, 20);
    if (i % 2 == 0) box(-14, -14, 14, -13);  // what comes first in the order of reading
    cut += look(reading + kBlocks) == Status::kBudgetSpent ? 1 : 0;
  }
  const double walled_m = to_goal_m();
  EXPECT_GT(cut, 40) << "more changed than fits";
  EXPECT_GT(walled_m, open_m + 1.0);
  ASSERT_EQ(look(1 << 30), Status::kOk);
  EXPECT_EQ(to_goal_m(), walled_m) << "all of the wall was seen";
}

TEST_F(WayMemoryTest, DoesNotAllocate) {
  box(10, -20, 10.6, 12);
  make();
  const test::NoAllocScope scope;
  (void)look_and_solve(start_W_);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::stages
