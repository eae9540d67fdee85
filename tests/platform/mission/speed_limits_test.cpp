/// What `vehicle check` says of speed is what is flown.
#include "platform/mission/speed_limits.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/mission/mission.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::mission {
namespace {

MissionConfig config_of(const vehicle::Vehicle& vehicle) {
  MissionConfig config;
  set_vehicle(config, vehicle);
  config.flight.bounds_W = {{-10.0, -30.0, 1.5}, {130.0, 30.0, 12.0}};
  flight::describe_sensors(sitl::rig_of(config.simulator), config.flight);
  return config;
}

vehicle::Vehicle x500() { return vehicle::load_vehicle("x500"); }

SpeedLimits limits_of(const vehicle::Vehicle& vehicle) { return speed_limits(config_of(vehicle).flight); }

double where_mps(const SpeedLimits& limits, const std::string& name) {
  for (const SpeedLimit& limit : limits.where)
    if (name == limit.name) return limit.speed_mps;
  ADD_FAILURE() << "no " << name;
  return 0.0;
}

struct Flown {
  double mean_mps{};
  double least_mps{};
};

/// From 40 to 90 of 120 m with nothing in the way, where a decision takes a tenth of the published time.
Flown flown(const vehicle::Vehicle& vehicle, std::uint64_t seed = 5) {
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/open.toml", {});
  MissionConfig config = config_of(vehicle);
  const board::Profile board = board::slower(board::paper(), 0.1);
  config.seed = seed;
  config.flight.costs = board.costs;
  config.flight.model = board.model;
  for (CameraSpec& camera : config.simulator.rig->cameras) {
    while (camera.width > 200) {
      camera.width /= 2;
      camera.height /= 2;
    }
  }
  config.judge.time_limit_s = 200.0;
  double sum_mps = 0.0;
  double least_mps = 1e3;
  int frames = 0;
  config.each_frame = [&](const FrameRecord& f) {
    const double x_m = f.truth.p_WB.x();
    if (!f.airborne || x_m < 40.0 || x_m > 90.0) return;
    sum_mps += f.truth.v_WB.norm();
    least_mps = std::min(least_mps, f.truth.v_WB.norm());
    ++frames;
  };
  EXPECT_EQ(fly_mission(world, config, {}).result.reason, "reached_goal");
  EXPECT_GT(frames, 100);
  return {sum_mps / std::max(frames, 1), least_mps};
}

void expect_flown(const vehicle::Vehicle& vehicle, const std::string& by) {
  const SpeedLimit limit = limits_of(vehicle).lowest();
  EXPECT_EQ(limit.name, by);
  const double mps = flown(vehicle).mean_mps;
  std::printf("%s: %.2f m/s by %s, flown at %.2f (%.0f %%)\n", vehicle.name.c_str(), limit.speed_mps,
              limit.name, mps, 100.0 * mps / limit.speed_mps);
  EXPECT_GE(mps, 0.75 * limit.speed_mps);
  EXPECT_LE(mps, 1.01 * limit.speed_mps) << "more than the noise of its control";
}

TEST(SpeedLimits, TheFilesIsFlownInTheOpen) { expect_flown(x500(), "file"); }

TEST(SpeedLimits, ThatOfItsSightIsFlownInTheOpen) {
  vehicle::Vehicle faster = x500();
  faster.model.speed_mps = 12.0;
  expect_flown(faster, "sight");
}

TEST(SpeedLimits, ThatOfAVehicleWithALidarIsFlownInTheOpen) {
  expect_flown(vehicle::load_vehicle("racer"), "file");
}

TEST(SpeedLimits, ThatOfALidarsSightIsFlownInTheOpen) {
  vehicle::Vehicle racer = vehicle::load_vehicle("racer");
  racer.model.speed_mps = 25.0;
  racer.rig.lidars[0].range_m = 20.0;
  expect_flown(racer, "sight");
}

/// The goal comes into sight 70 m ahead, long before the memory of ways has a place there.
TEST(SpeedLimits, ThatOfTheFileIsKeptUntilTheGoalIsAsNearAsAStop) {
  vehicle::Vehicle racer = vehicle::load_vehicle("racer");
  racer.model.speed_mps = 25.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Flown f = flown(racer, seed);
    std::printf("seed %d: %.2f m/s, at least %.2f\n", static_cast<int>(seed), f.mean_mps, f.least_mps);
    EXPECT_GT(f.least_mps, 0.5 * 25.0) << seed;
  }
}

TEST(SpeedLimits, EachNumberMovesItsOwn) {
  const SpeedLimits shipped = limits_of(x500());
  ASSERT_EQ(shipped.always.size(), 3U);
  EXPECT_EQ(shipped.lowest().speed_mps, x500().model.speed_mps);
  const auto changed = [&](auto change) {
    vehicle::Vehicle vehicle = x500();
    change(vehicle);
    return limits_of(vehicle);
  };
  const auto sight_mps = [](const SpeedLimits& limits) { return limits.always[1].speed_mps; };
  const SpeedLimits near = changed([](auto& v) { v.rig.cameras[0].range_m = 5.0; });
  EXPECT_STREQ(near.lowest().name, "sight");
  EXPECT_LT(sight_mps(near), sight_mps(shipped));
  EXPECT_GT(sight_mps(changed([](auto& v) { v.model.acceleration_mps2 = 5.0; })), sight_mps(shipped));
  EXPECT_LT(sight_mps(changed([](auto& v) { v.model.jerk_mps3 = 4.0; })), sight_mps(shipped));
  const SpeedLimits draggy = changed([](auto& v) { v.model.drag_quadratic_Ns2pm2 = 1.0; });
  // 0.2 v + v^2 = 2.0 (9.80 - 0.25), so v = 4.27 m/s; 22 as shipped.
  EXPECT_NEAR(draggy.always[2].speed_mps, 4.27, 0.01);
  EXPECT_NEAR(shipped.always[2].speed_mps, 22.1, 0.1);
  const SpeedLimits thick = changed([](auto& v) { v.model.thinnest_m = 0.04; });
  // A quarter of 0.02 m times 337 pixels per unit of tangent in 0.2 s, and twice that.
  EXPECT_NEAR(where_mps(thick, "thin"), std::min(2.0 * where_mps(shipped, "thin"), 5.0), 1e-9);
}

TEST(SpeedLimits, NothingThatLowersItRaisesIt) {
  for (const std::string& name : vehicle::shipped_vehicles()) {
    const SpeedLimits limits = limits_of(vehicle::load_vehicle(name));
    EXPECT_GT(limits.lowest().speed_mps, 0.0) << name;
    EXPECT_GE(limits.where.size(), 3U) << name;
    for (const SpeedLimit& limit : limits.where)
      EXPECT_LE(limit.speed_mps, limits.lowest().speed_mps) << name << ' ' << limit.name;
  }
}

}  // namespace
}  // namespace roborun::mission
