#include "platform/mission/mission.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <string_view>

#include "platform/board/board_profile.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::mission {
namespace {

MissionConfig paper_mission(governor::Design design, std::uint64_t seed) {
  const board::Profile profile = board::paper();
  MissionConfig config;
  config.flight.design = design;
  config.flight.costs = profile.costs;
  config.flight.model = profile.model;
  config.seed = seed;
  return config;
}

/// Messages by topic.
class Topics final : public log::LogViewer {
 public:
  std::map<std::string, int> count;
  void add(const log::Channel& channel, const log::Schema&) override { topic_[channel.id] = channel.topic; }
  void show(std::uint16_t channel, std::int64_t, std::string_view) noexcept override {
    ++count[topic_[channel]];
  }

 private:
  std::map<std::uint16_t, std::string> topic_;
};

TEST(Mission, TellsItsViewerWhatALogWouldHoldAndFliesTheSame) {
  const sitl::World world = sitl::generate(sitl::environment("1").knobs, sitl::Mission::kPackageDelivery, 1);
  MissionConfig config = paper_mission(governor::Design::kAware, 1);
  const report::MissionResult alone = fly_mission(world, config, {}).result;
  Topics viewer;
  config.viewer = &viewer;
  const report::MissionResult watched = fly_mission(world, config, {}).result;
  EXPECT_EQ(watched.state_hash, alone.state_hash);
  for (const char* once : {"/configuration", "/world", "/result"}) EXPECT_EQ(viewer.count[once], 1) << once;
  EXPECT_EQ(viewer.count["/decision"], static_cast<int>(watched.decisions));
  EXPECT_NEAR(viewer.count["/state"], 40.0 * watched.mission_time_s, 2.0);
  EXPECT_GT(viewer.count["/map"], 10);
}

TEST(Mission, FliesTheMiddleEnvironmentWithoutACollisionAndRepeats) {
  const sitl::World world = sitl::generate(sitl::environment("14").knobs, sitl::Mission::kPackageDelivery, 1);
  const MissionConfig config = paper_mission(governor::Design::kAware, 1);
  const report::MissionReport first = fly_mission(world, config, {});
  EXPECT_TRUE(first.result.reached_goal) << first.result.reason;
  EXPECT_FALSE(first.result.collided);
  EXPECT_GT(first.result.mean_velocity_mps, 2.0);
  EXPECT_LE(first.result.max_velocity_mps, 6.0 * 1.15);
  EXPECT_GT(first.result.decisions, 100U);
  EXPECT_EQ(fly_mission(world, config, {}).result.state_hash, first.result.state_hash);
}

TEST(Mission, FliesToADisasterZone) {
  const sitl::World world = sitl::generate(sitl::environment("1").knobs, sitl::Mission::kSearchAndRescue, 2);
  const report::MissionReport report = fly_mission(world, paper_mission(governor::Design::kAware, 2), {});
  EXPECT_TRUE(report.result.reached_goal) << report.result.reason;
  EXPECT_FALSE(report.result.collided);
}

TEST(Mission, NoDecisionIsLateFromTheTenthAfterTheProcessorSlowsDown) {
  const sitl::World world = sitl::generate(sitl::environment("14").knobs, sitl::Mission::kPackageDelivery, 3);
  MissionConfig config = paper_mission(governor::Design::kAware, 3);
  config.slow_down.at_s = 80.0;
  config.slow_down.factor = 2.0;
  const report::MissionReport report = fly_mission(world, config, {});
  EXPECT_TRUE(report.result.reached_goal) << report.result.reason;
  EXPECT_FALSE(report.result.collided);
  int after = 0;
  int late_at_once = 0;
  for (const report::DecisionRecord& d : report.decisions) {
    if (d.time_s < config.slow_down.at_s) continue;
    if (++after <= 10) {
      late_at_once += d.missed ? 1 : 0;
    } else {
      EXPECT_FALSE(d.missed) << "decision " << after << " after the slow-down, at " << d.time_s << " s";
    }
  }
  EXPECT_GT(after, 50);
  EXPECT_GT(late_at_once, 0) << "otherwise the slow-down was not felt";
}

TEST(Mission, EveryDesignFliesPastTwoPillars) {
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {});
  for (const auto design :
       {governor::Design::kAware, governor::Design::kStatic, governor::Design::kStaticFair}) {
    const report::MissionReport report = fly_mission(world, paper_mission(design, 1), {});
    EXPECT_TRUE(report.result.reached_goal) << report.result.design << ": " << report.result.reason;
    EXPECT_FALSE(report.result.collided);
    EXPECT_NE(report.result.state_hash, std::string(16, '0'));
  }
}

TEST(Mission, FliesAtEveryRateOfTheFlightLane) {
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {});
  int flown = 0;
  for (int rate_Hz = 1; rate_Hz <= 1000; ++rate_Hz) {
    if (!core::is_flight_rate(rate_Hz)) continue;
    MissionConfig config = paper_mission(governor::Design::kAware, 1);
    config.flight.minor_frame = core::minor_frame_of(rate_Hz);
    const report::MissionReport report = fly_mission(world, config, {});
    EXPECT_TRUE(report.result.reached_goal) << rate_Hz << " Hz: " << report.result.reason;
    EXPECT_FALSE(report.result.collided) << rate_Hz << " Hz";
    ++flown;
  }
  EXPECT_EQ(flown, 7);
}

TEST(Mission, EveryBackendFlies) {
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {});
  for (const auto& [map, planner] : {std::pair{"octomap", "own"}, std::pair{"own", "ompl:RRTstar"}}) {
    MissionConfig config = paper_mission(governor::Design::kAware, 1);
    config.backends.map = map;
    config.backends.planner = planner;
    const report::MissionReport report = fly_mission(world, config, {});
    EXPECT_TRUE(report.result.reached_goal) << map << " " << planner << ": " << report.result.reason;
    EXPECT_FALSE(report.result.collided);
  }
}

TEST(Mission, EndsSafelyWithANamedReasonWhereTheGoalIsWalledIn) {
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/walled_goal.toml", {});
  const report::MissionReport report = fly_mission(world, paper_mission(governor::Design::kAware, 1), {});
  EXPECT_FALSE(report.result.reached_goal);
  EXPECT_FALSE(report.result.collided);
  EXPECT_EQ(report.result.reason, "no_way");
  EXPECT_LT(report.path.back().speed_mps, 0.5) << "hovering";
}

}  // namespace
}  // namespace roborun::mission
