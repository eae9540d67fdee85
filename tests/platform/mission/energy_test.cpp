/// What a metre costs, and that `aim` energy makes it cheaper where the vehicle may fly faster than is cheapest.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "core/energy_model.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

/// 120 m with nothing in the way, by a vehicle that hovers cheaply and is held by drag: 7 m/s, the cheapest is 5.4.
MissionConfig draggy(governor::Aim aim) {
  MissionConfig config;
  VehicleModel& v = config.flight.vehicle;
  v.drag_quadratic_Ns2pm2 = 0.5;
  v.rotor_radius_m = 0.4;
  v.efficiency_ratio = 0.8;
  v.speed_mps = 7.0;
  v.tilt_rad = 0.75;
  v.measured_stopping.reset();
  const board::Profile board = board::slower(board::paper(), 0.1);
  config.flight.costs = board.costs;
  config.flight.model = board.model;
  config.simulator.camera.pixels = 32;
  config.simulator.wind = {Vector3::Zero(), 0.0, 3.0};
  config.flight.aim = aim;
  config.judge.time_limit_s = 120.0;
  return config;
}

report::MissionReport flown(const MissionConfig& config) {
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/open.toml", {});
  report::MissionReport report = fly_mission(world, config, {});
  EXPECT_EQ(report.result.reason, "reached_goal");
  return report;
}

TEST(Energy, AimedAtItIsTheLimitOfSpeedAndIsLess) {
  const MissionConfig config = draggy(governor::Aim::kEnergy);
  const double cheapest_mps = cheapest_speed_mps(config.flight.vehicle);
  ASSERT_LT(cheapest_mps, 0.8 * config.flight.vehicle.speed_mps) << "or nothing is tested";
  const report::MissionReport cheap = flown(config);
  const report::MissionReport fast = flown(draggy(governor::Aim::kTime));
  EXPECT_EQ(cheap.result.speed_limit_mps, cheapest_mps);
  int limited = 0;
  for (const report::DecisionRecord& d : cheap.decisions) {
    EXPECT_LE(d.speed_limit_mps, cheapest_mps);
    limited += d.speed_source == "energy" ? 1 : 0;
  }
  EXPECT_GT(limited, 10);
  EXPECT_TRUE(std::none_of(fast.decisions.begin(), fast.decisions.end(),
                           [](const auto& d) { return d.speed_source == "energy"; }));
  EXPECT_LT(cheap.result.energy_kJ, fast.result.energy_kJ);
  EXPECT_LT(cheap.result.flight_Jpm + cheap.result.computing_Jpm,
            fast.result.flight_Jpm + fast.result.computing_Jpm);
  EXPECT_GT(cheap.result.mission_time_s, fast.result.mission_time_s);
}

TEST(Energy, OfAMissionIsWhatItsMetresCost) {
  const report::MissionResult r = flown(draggy(governor::Aim::kTime)).result;
  EXPECT_NEAR((r.flight_Jpm + r.computing_Jpm) * r.distance_m, 1e3 * r.energy_kJ, 1e-6);
  EXPECT_NEAR(r.computing_Jpm * r.mean_velocity_mps, VehicleModel{}.avionics_W, 1e-9);
}

TEST(Energy, AFlightThatAimsAtItReplays) {
  MissionConfig config = draggy(governor::Aim::kEnergy);
  config.log = test::scratch("energy.mcap");
  EXPECT_EQ(flown(config).log_error, "");
  EXPECT_EQ(Recording(config.log).flight().flight.aim, governor::Aim::kEnergy);
  const ReplayResult replayed = replay_flight(config.log, {});
  EXPECT_GT(replayed.replayed.decisions, 10U);
  EXPECT_TRUE(replayed.same());
}

}  // namespace
}  // namespace roborun::mission
