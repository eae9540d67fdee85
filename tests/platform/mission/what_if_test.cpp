#include "platform/mission/what_if.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/logged_end.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/mission/setting_change.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

constexpr double kChange_s = 8.0;

/// A flight past two pillars, logged, and flown again with what a test changes.
class WhatIf : public ::testing::Test {
 protected:
  WhatIf() : world_(sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {})) {
    config_.flight.costs = board::paper().costs;
    config_.flight.model = board::paper().model;
    config_.simulator.camera.pixels = 32;
    config_.judge.time_limit_s = 20.0;
  }
  std::string fly(const MissionConfig& config, const char* name) {
    MissionConfig logged = config;
    logged.log = test::scratch(name);
    report_ = fly_mission(world_, logged, {});
    EXPECT_EQ(report_.log_error, "");
    return logged.log;
  }
  [[nodiscard]] flight::FlightConfig flown() const { return flight_config_of(world_, config_); }
  std::string refusal(const std::string& setting) {
    MissionConfig config = config_;
    try {
      change_in_flight(config, flown(), kChange_s, {setting});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  sitl::World world_;
  MissionConfig config_;
  report::MissionReport report_;
};

TEST_F(WhatIf, IsTheSameFlightUntilThenAndAnotherOneAfterIt) {
  const std::string logged = fly(config_, "logged.mcap");
  MissionConfig slow = config_;
  change_in_flight(slow, flown(), kChange_s, {"flight.v_max_mps=0.5"});
  const std::string changed = fly(slow, "changed.mcap");
  EXPECT_EQ(first_difference(logged, changed, kChange_s), std::nullopt);
  const auto difference = first_difference(logged, changed, 1e6);
  ASSERT_TRUE(difference);
  EXPECT_NE(difference->find("first in minor frame "), std::string::npos) << *difference;
  ASSERT_FALSE(report_.decisions.empty());
  bool slower = false;
  for (const report::DecisionRecord& d : report_.decisions) {
    if (d.time_s < kChange_s) continue;
    slower = true;
    EXPECT_LE(d.speed_limit_mps, 0.5);
  }
  EXPECT_TRUE(slower) << "no decision after the change";
}

TEST_F(WhatIf, IsReplayedWithItsChange) {
  MissionConfig slow = config_;
  change_in_flight(slow, flown(), kChange_s, {"flight.v_max_mps=0.5", "cpu.slow_down_factor=3"});
  const ReplayResult r = replay_flight(fly(slow, "changed.mcap"), {});
  EXPECT_TRUE(r.same()) << (r.difference ? r.difference->what : r.damage);
  EXPECT_NE(r.replayed.digest, 0U);
}

TEST_F(WhatIf, FindsAnotherFlight) {
  const std::string logged = fly(config_, "logged.mcap");
  MissionConfig other = config_;
  other.seed = 2;
  const auto difference = first_difference(logged, fly(other, "other.mcap"), kChange_s);
  ASSERT_TRUE(difference);
  EXPECT_NE(difference->find(" sample: another one"), std::string::npos) << *difference;
}

TEST_F(WhatIf, TakesSettingsTogetherInAnyOrder) {
  for (const std::vector<std::string>& settings :
       {std::vector<std::string>{"governor.longest_s=0.08", "governor.shortest_s=0.05"},
        std::vector<std::string>{"governor.shortest_s=0.05", "governor.longest_s=0.08"}}) {
    MissionConfig config = config_;
    EXPECT_NO_THROW(change_in_flight(config, flown(), kChange_s, settings));
    EXPECT_EQ(config.change.to.size(), 2U);
  }
  // Alone it goes below what is left of the other one.
  EXPECT_NE(refusal("governor.longest_s=0.08"), "");
}

TEST_F(WhatIf, GivesAGoalThen) {
  MissionConfig config = config_;
  config.goals.push_back({2.0, {world_.goal_W()}});
  config.goals.push_back({12.0, {world_.goal_W()}});
  const Vector3 p_W = world_.start_W();
  change_in_flight(config, flown(), kChange_s, {fmt::format("goal={},{},{}", p_W.x(), p_W.y(), p_W.z())});
  ASSERT_EQ(config.goals.size(), 3U);
  EXPECT_EQ(config.goals[1].at_s, kChange_s);
  EXPECT_EQ(config.goals[1].goals_W.front(), p_W);
}

TEST_F(WhatIf, RefusesWhatDoesNotChangeInFlight) {
  EXPECT_NE(refusal("camera.pixels=64").find("'camera.pixels' does not change in flight: must be "),
            std::string::npos);
  for (const GovernorKey& key : kGovernorKeys)
    EXPECT_NE(refusal("camera.pixels=64").find(key.key), std::string::npos) << key.key;
  EXPECT_NE(refusal("flight.v_max_mps").find("must be KEY=VALUE"), std::string::npos);
  EXPECT_NE(refusal("flight.v_max_mps=fast").find("flight.v_max_mps"), std::string::npos);
  EXPECT_NE(refusal("flight.v_max_mps=29").find("must be 0.5 to "), std::string::npos)
      << "faster than the vehicle's plans";
  EXPECT_NE(refusal("governor.longest_s=0.05").find("shortest_s <= longest_s"), std::string::npos);
  EXPECT_NE(refusal("goal=1,2").find("must be X,Y,Z"), std::string::npos);
  EXPECT_NE(refusal("goal=1e4,0,0").find("inside the flight's bounds"), std::string::npos);
  EXPECT_NE(refusal("flight.time_limit_s=1").find("flight.time_limit_s"), std::string::npos)
      << "before the change";
  config_.slow_down = {1.0, 2.0};
  EXPECT_NE(refusal("cpu.slow_down_factor=2").find("slowed down itself"), std::string::npos);
  config_.flight.design = governor::Design::kStatic;
  EXPECT_NE(refusal("governor.longest_s=1").find("design aware"), std::string::npos);
}

TEST_F(WhatIf, EveryKeyOfTheGovernorKeepsItsOwnValue) {
  const governor::GovernorConfig config = flight::governor_config(flown());
  for (const GovernorKey& key : kGovernorKeys) {
    const double value = key.get(config);
    EXPECT_GE(value, key.low) << key.key;
    EXPECT_LE(value, key.high) << key.key;
    EXPECT_NEAR(key.get(changed(config, {0.0, {{key.key, value}}})), value, 1e-9) << key.key;
    governor::GovernorConfig other = config;
    key.set(other, key.low);
    EXPECT_NEAR(key.get(other), key.low, 1e-9) << key.key;
  }
}

TEST_F(WhatIf, ReadsTheEndOfAFlight) {
  const std::string path = fly(config_, "logged.mcap");
  const LoggedEnd end = end_of(path);
  EXPECT_TRUE(end.has_result);
  EXPECT_EQ(end.reason, report_.result.reason);
  EXPECT_EQ(end.reached, report_.result.reached_goal);
  EXPECT_EQ(end.decisions, report_.decisions.size());
  EXPECT_NEAR(end.time_s, report_.result.mission_time_s, 1e-6);
  double closest_m = std::numeric_limits<double>::infinity();
  for (const report::DecisionRecord& d : report_.decisions)
    closest_m = std::fmin(closest_m, d.closest_obstacle_m);
  EXPECT_NEAR(end.closest_m, closest_m, 0.01);
  EXPECT_EQ(end.damage, "");
  EXPECT_EQ(beyond(end, "--from", end.time_s - 0.1), "");
  EXPECT_NE(beyond(end, "--from", end.time_s + 1.0).find("must be within the log"), std::string::npos);
  std::ifstream file(path, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(file), {}};
  const LoggedEnd cut = end_of(test::scratch_file("cut.mcap", whole.substr(0, whole.size() / 2)));
  EXPECT_FALSE(cut.has_result);
  EXPECT_FALSE(cut.good());
  EXPECT_LT(cut.recorded_s, end.time_s);
  EXPECT_NE(cut.damage, "");
  EXPECT_NE(beyond(cut, "--from", end.time_s).find("where it is cut"), std::string::npos);
  EXPECT_THROW((void)end_of(test::scratch_file("none.mcap", "no log")), InputError);
}

}  // namespace
}  // namespace roborun::mission
