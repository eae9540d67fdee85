#include "platform/flight/goal_queue.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/support/no_alloc_scope.hpp"

namespace roborun::flight {
namespace {

const Vector3 kFirst_W(10, 0, 3), kSecond_W(0, 10, 3), kThird_W(-10, 0, 3);

GoalQueue::Config config() {
  GoalQueue::Config config;
  config.bounds_W = {Vector3(-20, -20, 1), Vector3(20, 20, 8)};
  config.room_m = 0.9;
  return config;
}
MonotonicTime at(int s) { return MonotonicTime{Nanos{std::int64_t{s} * 1'000'000'000}}; }

TEST(GoalQueue, OneAfterTheOtherInTheirOrder) {
  GoalQueue sut(config(), kFirst_W);
  EXPECT_TRUE(sut.is_last());
  EXPECT_FALSE(sut.next(GoalAnswer::kReached, at(1), kFirst_W)) << "the last one is the mission's to judge";
  ASSERT_EQ(sut.give(std::vector<Vector3>{kFirst_W, kSecond_W, kThird_W}), Status::kOk);
  EXPECT_EQ(sut.now_W(), kFirst_W);
  EXPECT_TRUE(sut.take(at(1), Vector3::Zero()));
  EXPECT_FALSE(sut.take(at(1), Vector3::Zero()));
  ASSERT_EQ(sut.told().size(), 3U) << "the first one goes on being flown to";
  EXPECT_TRUE(sut.next(GoalAnswer::kReached, at(2), Vector3(9.5, 0, 3)));
  EXPECT_EQ(sut.now_W(), kSecond_W);
  EXPECT_TRUE(sut.next(GoalAnswer::kBlocked, at(3), Vector3(0, 6, 3)));
  EXPECT_EQ(sut.now_W(), kThird_W);
  EXPECT_TRUE(sut.is_last());
  EXPECT_EQ(sut.told()[0].answer, GoalAnswer::kReached);
  EXPECT_EQ(sut.told()[0].at, at(2));
  EXPECT_DOUBLE_EQ(sut.told()[0].distance_m, 0.5);
  EXPECT_EQ(sut.told()[1].answer, GoalAnswer::kBlocked);
  EXPECT_DOUBLE_EQ(sut.told()[1].distance_m, 4.0);
  EXPECT_EQ(sut.told()[2].answer, GoalAnswer::kFlown);
}

TEST(GoalQueue, NewOnesReplaceWhatIsNotAnswered) {
  GoalQueue sut(config(), kFirst_W);
  ASSERT_EQ(sut.give(std::vector<Vector3>{kFirst_W, kSecond_W}), Status::kOk);
  (void)sut.take(at(0), Vector3::Zero());
  (void)sut.next(GoalAnswer::kReached, at(1), kFirst_W);
  ASSERT_EQ(sut.give(std::vector<Vector3>{kThird_W}), Status::kOk);
  EXPECT_EQ(sut.now_W(), kSecond_W) << "not before the next decision";
  EXPECT_TRUE(sut.take(at(2), Vector3::Zero()));
  EXPECT_EQ(sut.now_W(), kThird_W);
  ASSERT_EQ(sut.told().size(), 3U);
  EXPECT_EQ(sut.told()[0].answer, GoalAnswer::kReached);
  EXPECT_EQ(sut.told()[1].answer, GoalAnswer::kReplaced);
}

TEST(GoalQueue, WhatCannotBeAGoalIsRefusedAndTheOldOneKept) {
  GoalQueue::Config fenced = config();
  ASSERT_EQ(fenced.fence.add_circle(core::FenceSide::kKeepIn, {0, 0}, 12.0), core::FenceFault::kNone);
  GoalQueue sut(fenced, kFirst_W);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(sut.give(std::vector<Vector3>{kSecond_W, Vector3(0, 0, 9)}), Status::kGoalBlocked)
      << "outside the bounds";
  EXPECT_EQ(sut.give(std::vector<Vector3>{Vector3(kNaN, 0, 3)}), Status::kGoalBlocked);
  EXPECT_EQ(sut.give(std::vector<Vector3>{Vector3(11.5, 0, 3)}), Status::kGoalBlocked)
      << "no room to the fence";
  EXPECT_EQ(sut.give({}), Status::kInvalidArgument);
  EXPECT_EQ(sut.give(std::vector<Vector3>(GoalQueue::kMost + 1, kSecond_W)), Status::kInvalidArgument);
  EXPECT_FALSE(sut.take(at(1), Vector3::Zero()));
  EXPECT_EQ(sut.now_W(), kFirst_W);
}

TEST(GoalQueue, GoesOnWhenMoreWereGivenThanCanBeTold) {
  GoalQueue sut(config(), kFirst_W);
  const std::vector<Vector3> two{kSecond_W, kThird_W};
  const test::NoAllocScope scope;
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(sut.give(two), Status::kOk);
    ASSERT_TRUE(sut.take(at(i), Vector3::Zero()));
    ASSERT_TRUE(sut.next(GoalAnswer::kReached, at(i), kSecond_W));
  }
  EXPECT_EQ(sut.now_W(), kThird_W);
  EXPECT_EQ(sut.told().size(), GoalQueue::kMostTold);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::flight
