/// Flights with other sensors than six cameras.
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

class RigFlight : public ::testing::Test {
 protected:
  RigFlight() : world_(sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {})) {
    config_.flight.costs = board::paper().costs;
    config_.flight.model = board::paper().model;
    config_.judge.time_limit_s = 240.0;
    // A board on which a decision takes 0.1 s instead of 0.7 s.
    for (core::StageCost& cost : config_.flight.costs.stage) cost = core::slower(cost, 0.15);
    for (governor::LatencyModel& model : config_.flight.model) {
      for (double& fixed_s : model.fixed_s) fixed_s *= 0.15;
      for (double& slope_s_per_m3 : model.slope_s_per_m3) slope_s_per_m3 *= 0.15;
    }
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
  EXPECT_LT(most_turn_radps, 1.6) << "not faster than it is told";
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

}  // namespace
}  // namespace roborun::mission
