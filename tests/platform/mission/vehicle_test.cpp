/// Every shipped vehicle flies a mission, and keeps as near to its reference as its file says.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/mission/mission.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/vehicle/vehicle_file.hpp"
#include "tests/platform/sitl/vehicle/flight.hpp"

namespace roborun::mission {
namespace {

/// On a board on which a decision takes 0.1 s instead of 0.7 s.
MissionConfig config_of(const vehicle::Vehicle& vehicle) {
  MissionConfig config;
  set_vehicle(config, vehicle);
  const board::Profile board = board::slower(board::paper(), 0.15);
  config.flight.costs = board.costs;
  config.flight.model = board.model;
  config.judge.time_limit_s = 300.0;
  return config;
}

class ShippedVehicle : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedVehicle, ReachesItsGoalAndKeepsNearItsReference) {
  // micro sees 4 m: it stops before the pillar, and flies in a room.
  const std::string file = GetParam() == "micro" ? "room.toml" : "two_pillars.toml";
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/" + file, {});
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(GetParam());
  MissionConfig config = config_of(vehicle);
  // Images that a test can afford to cast.
  for (CameraSpec& camera : config.simulator.rig->cameras) {
    while (camera.width > 200) {
      camera.width /= 2;
      camera.height /= 2;
    }
  }
  double error_m = 0.0;
  config.each_frame = [&error_m](const FrameRecord& f) {
    if (f.airborne) error_m = std::max(error_m, (f.truth.p_WB - f.committed.at(f.now).p_W).norm());
  };
  const report::MissionResult r = fly_mission(world, config, {}).result;
  std::printf("%s: %s after %.0f s, %.1f m, mean %.2f m/s, at most %.2f m/s, tracking error at most %.2f m\n",
              GetParam().c_str(), r.reason.c_str(), r.mission_time_s, r.distance_m, r.mean_velocity_mps,
              r.max_velocity_mps, error_m);
  EXPECT_EQ(r.reason, "reached_goal");
  EXPECT_GT(error_m, 0.001) << "nothing was compared";
  EXPECT_LE(error_m, vehicle.model.tracking_error_m);
  EXPECT_LE(r.max_velocity_mps, 1.15 * vehicle.model.speed_mps);
}

TEST_P(ShippedVehicle, KeepsNearerToItsReferenceWhereItFliesSlowly) {
  const VehicleModel model = vehicle::load_vehicle(GetParam()).model;
  if (model.slow_error_m == 0.0) GTEST_SKIP() << "it never flies narrow places slowly";
  const double worst_m = test::worst_beside_walls_m(model, model.slow_speed_mps, 6, 400);
  RecordProperty("worst_m", std::to_string(worst_m));
  EXPECT_GT(worst_m, 0.001) << "nothing was compared";
  EXPECT_LE(worst_m, model.slow_error_m);
}

/// Wider than a block of the memory of ways has cells.
TEST(WideVehicle, Arrives) {
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {});
  for (const double radius_m : {0.9, 2.0}) {
    vehicle::Vehicle vehicle = vehicle::load_vehicle("paper");
    vehicle.model.radius_m = radius_m;
    const report::MissionResult r = fly_mission(world, config_of(vehicle), {}).result;
    EXPECT_EQ(r.reason, "reached_goal") << radius_m;
    EXPECT_FALSE(r.collided);
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedVehicle, ::testing::ValuesIn(vehicle::shipped_vehicles()),
                         [](const auto& p) { return p.param; });

}  // namespace
}  // namespace roborun::mission
