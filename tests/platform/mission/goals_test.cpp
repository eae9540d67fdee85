/// Flights with several goals, with new ones in flight, and with such as cannot be reached.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/flight/goal_queue.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/platform/mission/refusal.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

class GoalFlight : public ::testing::Test {
 protected:
  GoalFlight() : world_(sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {})) {
    const board::Profile profile = board::paper();
    config_.flight.costs = core::slower(profile.costs, 0.15);
    config_.flight.model = profile.model;
    config_.judge.time_limit_s = 240.0;
    start_W_ = world_.start_W();
    goal_W_ = world_.goal_W();
  }
  report::MissionResult fly() {
    report::MissionResult r = fly_mission(world_, config_, {}).result;
    std::printf("%s after %.0f s, %.1f m:", r.reason.c_str(), r.mission_time_s, r.distance_m);
    for (const report::GoalRecord& g : r.goals)
      std::printf(" (%.1f %.1f %.1f) %s at %.1f s, %.2f m;", g.goal_W.x(), g.goal_W.y(), g.goal_W.z(),
                  g.answer.c_str(), g.time_s, g.distance_m);
    std::printf("\n");
    return r;
  }
  [[nodiscard]] std::string refusal() const { return refusal_of(world_, config_); }
  sitl::World world_;
  MissionConfig config_;
  Vector3 start_W_, goal_W_;
};

TEST_F(GoalFlight, SeveralInOrder) {
  const Vector3 half_W = start_W_ + 0.5 * (goal_W_ - start_W_) + Vector3(0, 4, 0);
  config_.goals = {{0.0, {goal_W_, half_W, start_W_}}};
  const report::MissionResult r = fly();
  EXPECT_TRUE(r.reached_goal) << r.reason;
  ASSERT_EQ(r.goals.size(), 3U);
  for (const report::GoalRecord& g : r.goals) {
    EXPECT_EQ(g.answer, "reached");
    EXPECT_LT(g.distance_m, 1.1);
  }
  EXPECT_LT(r.goals[0].time_s, r.goals[1].time_s);
  EXPECT_GT(r.distance_m, 1.8 * (goal_W_ - start_W_).norm()) << "there and back";
}

TEST_F(GoalFlight, ANewOneInFlightWithoutAJumpAndItReplays) {
  config_.goals = {{14.0, {start_W_ + Vector3(3, 6, 0)}}};
  config_.log = test::scratch("goals.mcap");
  double most_m = 0.0, last_s = 0.0;
  Vector3 last_W = Vector3::Zero();
  config_.each_frame = [&](const FrameRecord& f) {
    const TrajectoryPoint p = f.committed.at(f.now);
    const double now_s = seconds(f.now.time_since_epoch());
    if (last_s > 12.0) most_m = std::max(most_m, (p.p_W - last_W).norm() - 7.0 * (now_s - last_s));
    last_W = p.p_W;
    last_s = now_s;
  };
  const report::MissionResult r = fly();
  EXPECT_TRUE(r.reached_goal) << r.reason;
  ASSERT_EQ(r.goals.size(), 2U);
  EXPECT_EQ(r.goals[0].answer, "replaced");
  EXPECT_NEAR(r.goals[0].time_s, 14.0, 1.5) << "at the next decision";
  EXPECT_EQ(r.goals[1].answer, "reached");
  EXPECT_LT(most_m, 0.001) << "what is flown goes on where it was";
  EXPECT_TRUE(replay_flight(config_.log, {}).same());
}

TEST_F(GoalFlight, OneInsideAnObstacleEndsAtTheNearestPlaceAndTheNextIsFlownTo) {
  const Vector3 blocked_W(18.3, 1, 4);  // 0.3 m inside a pillar
  ASSERT_LE(world_.clearance_m(blocked_W, 0.5), 0.0);
  config_.goals = {{0.0, {blocked_W, goal_W_}}};
  const report::MissionResult r = fly();
  EXPECT_TRUE(r.reached_goal) << r.reason;
  ASSERT_EQ(r.goals.size(), 3U);
  EXPECT_EQ(r.goals[0].answer, "replaced") << "the world's";
  EXPECT_EQ(r.goals[1].answer, "goal_blocked");
  EXPECT_LT(r.goals[1].distance_m, 5.0);
  EXPECT_EQ(r.goals[2].answer, "reached");
  config_.goals = {{0.0, {blocked_W}}};
  const report::MissionResult alone = fly();
  EXPECT_EQ(alone.reason, "goal_blocked");
  EXPECT_FALSE(alone.collided);
  EXPECT_LT(alone.goals.back().distance_m, 5.0);
}

TEST_F(GoalFlight, OutsideIsRefusedBeforeAndInFlight) {
  const Vector3 outside_W = goal_W_ + Vector3(1000, 0, 0);
  config_.goals = {{0.0, {goal_W_, outside_W}}};
  EXPECT_NE(refusal().find("must be inside the bounds"), std::string::npos) << refusal();
  config_.goals = {{0.0, std::vector<Vector3>(flight::GoalQueue::kMost + 1, goal_W_)}};
  EXPECT_NE(refusal().find("must be 1 to 16"), std::string::npos) << refusal();
  config_.goals = {{12.0, {outside_W}}};
  const report::MissionResult r = fly();
  EXPECT_TRUE(r.reached_goal) << "the old one is kept";
  ASSERT_EQ(r.goals.size(), 2U);
  EXPECT_EQ(r.goals[0].answer, "reached");
  EXPECT_EQ(r.goals[1].answer, "refused");
}

TEST_F(GoalFlight, BeyondTheBatterysReachIsSaidBefore) {
  EXPECT_TRUE(beyond_reach(world_, config_).empty());
  config_.flight.vehicle.battery_J = 1.2e3;
  const std::vector<std::string> lines = beyond_reach(world_, config_);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find("beyond the battery's reach"), std::string::npos) << lines[0];
}

}  // namespace
}  // namespace roborun::mission
