/// Flights with other sensors than six cameras.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/sitl/world/world_maker.hpp"
#include "platform/vehicle/vehicle_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

class RigFlight : public ::testing::Test {
 protected:
  RigFlight() : world_(sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {})) {
    // A board on which a decision takes 0.1 s instead of 0.7 s.
    const board::Profile board = board::slower(board::paper(), 0.15);
    config_.flight.costs = board.costs;
    config_.flight.model = board.model;
    config_.judge.time_limit_s = 240.0;
  }
  /// A D455's field of view, with few pixels: the simulator casts each of them.
  static CameraSpec front() {
    CameraSpec camera;
    camera.width = 160;
    camera.height = 120;
    camera.tan_half_width = rig_detail::tan_of_half_deg(87.0);
    camera.tan_half_height = rig_detail::tan_of_half_deg(58.0);
    camera.range_min_m = 0.3;
    camera.range_m = 10.0;
    camera.rate_Hz = 30.0;
    camera.mount.x_m = 0.1;
    camera.mount.z_m = 0.2;  // nearer to the ground it would see little else before the take-off
    return camera;
  }
  report::MissionResult fly(const char* what) {
    const report::MissionReport report = fly_mission(world_, config_, {});
    const report::MissionResult& r = report.result;
    std::printf("%s: %s after %.0f s, %.1f m, mean %.2f m/s, %zu decisions\n", what, r.reason.c_str(),
                r.mission_time_s, r.distance_m, r.mean_velocity_mps, static_cast<std::size_t>(r.decisions));
    return r;
  }
  sitl::World world_;
  MissionConfig config_;
};

TEST_F(RigFlight, OneFrontCameraReachesTheGoal) {
  config_.simulator.rig.emplace();
  ASSERT_TRUE(config_.simulator.rig->cameras.push_back(front()));
  double most_turn_radps = 0.0;
  config_.each_frame = [&](const FrameRecord& f) {
    most_turn_radps = std::max(most_turn_radps, std::fabs(f.truth.w_WB_B.z()));
  };
  const report::MissionResult r = fly("one front camera");
  EXPECT_FALSE(r.collided);
  EXPECT_TRUE(r.reached_goal) << r.reason;
  EXPECT_GT(most_turn_radps, 0.5) << "it looks round";
  EXPECT_LT(most_turn_radps, 1.5 * config_.flight.vehicle.yaw_rate_radps) << "not faster than it is told";
}

TEST_F(RigFlight, ACameraBelowThatSeesNothingOnTheGroundDoesNotHoldTheTakeOff) {
  SensorRig& rig = config_.simulator.rig.emplace();
  for (const double yaw_deg : {0.0, 90.0, 180.0, 270.0}) {
    CameraSpec camera;
    camera.mount = {.yaw_deg = yaw_deg};
    ASSERT_TRUE(rig.cameras.push_back(camera));
  }
  for (const double pitch_deg : {-90.0, 90.0}) {
    CameraSpec camera;
    camera.range_min_m = 0.3;
    camera.mount = {.pitch_deg = pitch_deg};
    ASSERT_TRUE(rig.cameras.push_back(camera));
  }
  const report::MissionResult r = fly("six cameras that see nothing nearer than 0.3 m");
  EXPECT_FALSE(r.collided);
  EXPECT_TRUE(r.reached_goal) << r.reason;
}

TEST_F(RigFlight, SixCamerasThatMeasureNothingNearbyLeaveTheTopOfTheirClimb) {
  SensorRig& rig = config_.simulator.rig.emplace(six_cameras(96, 25.0));
  for (CameraSpec& camera : rig.cameras) camera.range_min_m = 0.6;
  const report::MissionResult r = fly("six cameras that measure from 0.6 m on");
  EXPECT_FALSE(r.collided);
  EXPECT_TRUE(r.reached_goal) << r.reason;
}

TEST_F(RigFlight, ARigThatCannotBeIsRefusedByName) {
  const auto refusal = [&](auto&& change) -> std::string {
    config_.simulator.rig.emplace();
    (void)config_.simulator.rig->cameras.push_back(front());
    change(*config_.simulator.rig);
    try {
      (void)fly_mission(world_, config_, {});
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal([](SensorRig& r) {
              r.cameras[0].range_m = kNaN;
            }).find("camera 1: range_m: must be from 1 to 200"),
            std::string::npos);
  EXPECT_NE(refusal([](SensorRig& r) { r.cameras[0].tan_half_width = 0.0; }).find("horizontal_fov_deg"),
            std::string::npos);
  EXPECT_NE(refusal([](SensorRig& r) { r.cameras[0].range_min_m = 11.0; }).find("range_min_m"),
            std::string::npos);
  EXPECT_NE(refusal([](SensorRig& r) { (void)r.lidars.push_back({.rings = 0}); }).find("lidar 1: rings"),
            std::string::npos);
  EXPECT_NE(refusal([](SensorRig& r) { r.cameras.clear(); }).find("one sensor at least"), std::string::npos);
}

TEST_F(RigFlight, MemoryFollowsTheLargestImage) {
  const auto pyramid_bytes = [&] {
    std::size_t bytes = 0;
    for (const report::PoolUse& pool : fly_mission(world_, config_, {}).pools)
      if (std::string(pool.name) == "map depth pyramid") bytes += pool.element_bytes * pool.count;
    return bytes;
  };
  config_.judge.time_limit_s = 1.0;
  config_.simulator.rig.emplace();
  (void)config_.simulator.rig->cameras.push_back(front());
  const std::size_t small = pyramid_bytes();
  EXPECT_NEAR(static_cast<double>(small), 160 * 120 * 7.0 / 3.0 * 4.0, 2e3);
  config_.simulator.rig->cameras[0].width = 320;
  EXPECT_NEAR(static_cast<double>(pyramid_bytes()), 2.0 * static_cast<double>(small), 4e3);
}

TEST_F(RigFlight, OneLidarReachesTheGoal) {
  config_.simulator.rig.emplace();
  LidarSpec lidar;
  lidar.rings = 32;
  lidar.columns = 360;
  lidar.lowest_deg = -45.0;
  lidar.highest_deg = 45.0;
  lidar.range_m = 25.0;
  ASSERT_TRUE(config_.simulator.rig->lidars.push_back(lidar));
  const report::MissionResult r = fly("one LiDAR");
  EXPECT_FALSE(r.collided);
  EXPECT_TRUE(r.reached_goal) << r.reason;
}

/// A LiDAR's pixels are wide: where a trunk's edge is seen changes with the place by half a pixel, and is no body that came.
TEST(LidarFlight, SeesNothingMoveInAForest) {
  MissionConfig config;
  config.flight.costs = board::slower(board::paper(), 0.01).costs;
  config.flight.model = board::slower(board::paper(), 0.01).model;
  set_vehicle(config, vehicle::load_vehicle("racer"));
  for (const std::uint64_t seed : {1U, 2U}) {
    config.seed = seed;
    sitl::WorldMakerOptions options;
    options.spacing_m = 8.0;
    const sitl::World world(sitl::make_world(sitl::WorldKind::kForest, seed, options));
    const report::MissionReport report = fly_mission(world, config, {});
    EXPECT_TRUE(report.result.reached_goal) << report.result.reason;
    EXPECT_GT(report.decisions.size(), 50U);
    for (const report::DecisionRecord& d : report.decisions)
      EXPECT_NE(d.speed_source, "motion") << seed << " at " << d.time_s << " s";
  }
}

/// Six cameras of which three in ten pixels are lost, the sky without values.
MissionConfig with_holes() {
  MissionConfig config;
  config.flight.costs = board::paper().costs;
  config.flight.model = board::paper().model;
  SensorRig& rig = config.simulator.rig.emplace(six_cameras(96, 25.0));
  for (CameraSpec& camera : rig.cameras) {
    camera.model = CameraModel::kD455;
    camera.invalid_ratio = 0.3;
  }
  return config;
}

sitl::World environment_14(std::uint64_t seed) {
  return sitl::generate(sitl::environment("14").knobs, sitl::Mission::kPackageDelivery, seed);
}

TEST(SixCamerasWithHoles, SeeAheadInCellsThatAreSeenWhole) {
  // Environment 14 with three in ten pixels lost and a sky without values: coarse cells are rarely seen whole. When the profile
  // looked in them, nothing was visible, and the vehicle had come 26 m far after 50 s.
  const sitl::World world = environment_14(1);
  MissionConfig config = with_holes();
  config.judge.time_limit_s = 70.0;
  const report::MissionReport flown = fly_mission(world, config, {});
  std::vector<double> visible_m;
  for (const report::DecisionRecord& d : flown.decisions)
    if (d.speed_mps > 1.0 && d.planner_status != "not ready") visible_m.push_back(d.visible_m);
  ASSERT_GT(visible_m.size(), 10U);
  std::sort(visible_m.begin(), visible_m.end());
  const double median_m = visible_m[visible_m.size() / 2];
  std::printf("%s after %.0f s, %.0f m; visible %.1f m\n", flown.result.reason.c_str(),
              flown.result.mission_time_s, flown.result.distance_m, median_m);
  EXPECT_GT(median_m, 0.6) << "0 in coarse cells";
  EXPECT_GT(flown.result.distance_m, 35.0);
}

TEST(SixCamerasWithHoles, LookCloselyWhereLeavingDidNotHelp) {
  // Before a pillar cells of 0.1 m led 1.3 m on, cells of 1.6 m 1.3 m back, for 120 s: given up 109 m and 28 m before the goal.
  for (const std::uint64_t seed : {47U, 67U}) {
    MissionConfig config = with_holes();
    config.seed = seed;
    const report::MissionResult r = fly_mission(environment_14(seed), config, {}).result;
    std::printf("seed %u: %s after %.0f s\n", static_cast<unsigned>(seed), r.reason.c_str(),
                r.mission_time_s);
    EXPECT_TRUE(r.reached_goal) << r.reason;
    EXPECT_FALSE(r.collided);
  }
}

MissionConfig among_wires(std::uint64_t seed) {
  MissionConfig config;
  config.flight.costs = board::paper().costs;
  config.flight.model = board::paper().model;
  set_vehicle(config, vehicle::load_vehicle("paper-d455"));
  config.seed = seed;
  return config;
}

TEST(ThinThings, BetweenTwoDecisionsAreBrakedFor) {
  // A level wire of 2 cm that no decision saw before it was too late: of 700 to 715 the look brakes in 710 and 715. Of five such flights all
  // ended in the wire without it (2026-11-28, an earlier program). Decisions take up to 4.6 s here.
  constexpr int kBraked = 2;
  int braked = 0;
  for (std::uint64_t seed = 700; seed < 720 && braked < kBraked; ++seed) {
    const sitl::World world(sitl::make_world(sitl::WorldKind::kWires, seed, {}));
    MissionConfig config = among_wires(seed);
    config.log = test::scratch("wires.mcap");
    const report::MissionResult r = fly_mission(world, config, {}).result;
    std::printf("seed %u: %s after %.0f s, braked %u times\n", static_cast<unsigned>(seed), r.reason.c_str(),
                r.mission_time_s, static_cast<unsigned>(r.near_brakes));
    EXPECT_TRUE(r.reached_goal) << r.reason;
    EXPECT_FALSE(r.collided);
    if (r.near_brakes == 0) continue;
    ++braked;
    const ReplayResult replayed = replay_flight(config.log, {});
    EXPECT_TRUE(replayed.same()) << "after " << replayed.seconds << " s";
  }
  EXPECT_EQ(braked, kBraked);
}

/// Seed 361: five seconds after the last look at a wire it stood 1.5 m from there, and took 6 m/s for the next one. Seed 371: the wire
/// was 43 degrees above the way, between what looks ahead and what looks up.
TEST(ThinThings, AreExpectedNearOthersAndLookedForAboveTheWay) {
  for (const std::uint64_t seed : {361U, 371U}) {
    const sitl::World world(sitl::make_world(sitl::WorldKind::kWires, seed, {}));
    const report::MissionResult r = fly_mission(world, among_wires(seed), {}).result;
    EXPECT_TRUE(r.reached_goal) << seed << " " << r.reason;
    EXPECT_FALSE(r.collided) << seed;
  }
}

}  // namespace
}  // namespace roborun::mission
