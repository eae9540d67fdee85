/// Missions that an autopilot flies: the fakes of PX4 and ArduCopter in lockstep.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/vehicle/vehicle_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

sitl::World two_pillars() {
  return sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {});
}

MissionConfig config_of(AutopilotChoice choice, const char* name = "paper") {
  MissionConfig config;
  set_vehicle(config, vehicle::load_vehicle(name));
  const board::Profile paper = board::paper();
  config.flight.costs = paper.costs;
  config.flight.model = paper.model;
  config.judge.time_limit_s = 300.0;
  config.autopilot = choice;
  return config;
}

class AutopilotMission : public ::testing::TestWithParam<AutopilotKind> {};

/// Small ones, whose own loops keep within 0.1 m, and a larger one.
TEST_P(AutopilotMission, ReachesItsGoalWithinTheRoomOfItsPlans) {
  const sitl::World world = two_pillars();
  for (const char* name : {"paper", "micro-six", "mighty-six"}) {
    for (const bool tuned : {false, true}) {
      MissionConfig config = config_of({GetParam(), tuned}, name);
      double error_m = 0.0;
      config.each_frame = [&error_m](const FrameRecord& f) {
        if (f.airborne) error_m = std::max(error_m, (f.truth.p_WB - f.committed.at(f.now).p_W).norm());
      };
      const report::MissionResult r = fly_mission(world, config, {}).result;
      const VehicleModel& own = config.flight.vehicle;
      const double room_m =
          as_flown_by(own, companion_config(*config.autopilot, own).planned).tracking_error_m;
      std::printf(
          "%s, %s%s: %s after %.1f s, at most %.2f m/s and %.2f m from its reference, room of %.2f m\n", name,
          to_string(GetParam()), tuned ? " tuned" : "", r.reason.c_str(), r.mission_time_s,
          r.max_velocity_mps, error_m, room_m);
      EXPECT_EQ(r.reason, "reached_goal");
      EXPECT_FALSE(r.collided);
      EXPECT_LT(error_m, room_m);
      EXPECT_GT(error_m, 0.001) << "nothing was compared";
    }
  }
}

TEST_P(AutopilotMission, IsTheSameEveryTime) {
  const sitl::World world = two_pillars();
  const MissionConfig config = config_of({GetParam(), false});
  EXPECT_EQ(fly_mission(world, config, {}).result.state_hash,
            fly_mission(world, config, {}).result.state_hash);
}

TEST_P(AutopilotMission, HasALogWithoutInputs) {
  MissionConfig config = config_of({GetParam(), false});
  config.judge.time_limit_s = 5.0;
  config.log = test::scratch("autopilot.mcap");
  EXPECT_EQ(fly_mission(two_pillars(), config, {}).log_error, "");
  log::McapReader reader(config.log);
  std::uint64_t states = 0;
  for (log::Message message; reader.next(message);) {
    states += message.channel->topic == "/state" ? 1U : 0U;
    EXPECT_NE(message.channel->topic, log::FlightLog::kInputsTopic);
  }
  EXPECT_EQ(reader.damage(), "");
  EXPECT_GT(states, 150U);
  EXPECT_THROW((void)replay_flight(config.log, {}), InputError);
}

INSTANTIATE_TEST_SUITE_P(Both, AutopilotMission,
                         ::testing::Values(AutopilotKind::kPx4, AutopilotKind::kArduCopter),
                         [](const auto& p) { return std::string(to_string(p.param)); });

/// d(v) of the plans is nowhere shorter than the stop of a trajectory within the limits, nor than the autopilot's own.
TEST(AsFlownBy, StopsAreNeverShorterThanEither) {
  for (const AutopilotKind kind : {AutopilotKind::kPx4, AutopilotKind::kArduCopter})
    for (const bool tuned : {false, true})
      for (const char* name : {"paper", "x500", "micro", "racer"}) {
        const VehicleModel vehicle = vehicle::load_vehicle(name).model;
        const auto limits = companion_config({kind, tuned}, vehicle).planned;
        const VehicleModel sut = as_flown_by(vehicle, limits);
        EXPECT_GE(planned_radius_m(sut), planned_radius_m(vehicle));
        EXPECT_GE(slow_radius_m(sut), slow_radius_m(vehicle));
        VehicleModel planned = sut;
        planned.measured_stopping.reset();
        ASSERT_EQ(out_of_bounds(sut), nullptr);
        EXPECT_LE(sut.acceleration_mps2, vehicle.acceleration_mps2);
        for (double v_mps = 0.1; v_mps <= sut.speed_mps; v_mps += 0.1) {
          const double d_m = stopping_model(sut).distance_m(v_mps);
          EXPECT_GE(d_m, stopping_model(planned).distance_m(v_mps) - 1e-9) << name << v_mps;
          const double silent_m =
              v_mps * (limits.silence_s + limits.delay_s + 0.5 * limits.stop_mps2 / limits.stop_jerk_mps3) +
              0.5 * v_mps * v_mps / limits.stop_mps2;
          EXPECT_GE(d_m, silent_m) << name << v_mps;
        }
      }
}

TEST(AutopilotOf, NamesTheOption) {
  EXPECT_EQ(autopilot_of("--autopilot", "none"), std::nullopt);
  EXPECT_EQ(autopilot_of("--autopilot", "px4"), AutopilotKind::kPx4);
  EXPECT_THROW((void)autopilot_of("--autopilot", "betaflight"), InputError);
}

}  // namespace
}  // namespace roborun::mission
