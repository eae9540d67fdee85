#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/mission.hpp"
#include "platform/sitl/world/octomap_file.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

MissionConfig paper_mission() {
  MissionConfig config;
  const board::Profile profile = board::paper();
  config.flight.costs = profile.costs;
  config.flight.model = profile.model;
  config.judge.time_limit_s = 200.0;
  return config;
}

/// An upper floor 4 m over the plane, and open ground beside it.
sitl::WorldDescription upper_floor() {
  sitl::WorldDescription d;
  d.bounds_W = {{-10, -20, 1.5}, {60, 20, 10}};
  d.start_W = {0, 0, 6.5};
  d.goal_W = {45, 0, 3};
  d.boxes.push_back({{-20, -20, 0}, {12, 20, 4}});
  return d;
}

TEST(Ground, AStartOnAnUpperFloorFliesDownToTheGoal) {
  const report::MissionReport report = fly_mission(sitl::World(upper_floor()), paper_mission(), {});
  EXPECT_EQ(report.result.reason, "reached_goal");
  EXPECT_FALSE(report.result.collided);
  EXPECT_NEAR(report.path.front().p_WB.z(), 4.0, 0.1) << "it stands on the floor, not on z = 0";
}

TEST(Ground, ALandingOnTheUpperFloorIsOne) {
  MissionConfig config = paper_mission();
  sitl::WorldDescription d = upper_floor();
  d.boxes[0].max_W.x() = 60.0;  // the floor is everywhere
  d.goal_W.z() = 6.5;
  config.faults.push_back(
      {{sitl::Component::kBattery, sitl::FaultKind::kWrong, -1}, governor::Phase::kMission, 4.0});
  const report::MissionReport report = fly_mission(sitl::World(d), config, {});
  EXPECT_EQ(report.result.reason, "landed");
  EXPECT_FALSE(report.result.collided);
  EXPECT_NEAR(report.safety.end_W.z(), 4.0, 0.05);
  EXPECT_GT(report.safety.touchdown_mps, 0.1) << "the touch-down was felt";
  EXPECT_LT(report.safety.touchdown_mps, 1.5);
}

TEST(Ground, AnOctomapWithItsFloorFlies) {
  // A hall of 40 x 16 m, floor and roof of cells of 0.4 m, the floor at z = -2.
  sitl::OctomapLeaves map;
  map.resolution_m = 0.4;
  constexpr int kOrigin = 1 << (sitl::kOctomapDepth - 1);
  for (int x = -50; x < 50; ++x)
    for (int y = -20; y < 20; ++y)
      for (const int z : {-6, 18})
        map.leaves.push_back({sitl::octomap_morton({kOrigin + x, kOrigin + y, kOrigin + z}), 1, true});
  std::sort(map.leaves.begin(), map.leaves.end(),
            [](const auto& a, const auto& b) { return a.morton < b.morton; });
  const std::string path = test::scratch_file("hall.bt", sitl::write_octomap(map, false));
  sitl::WorldOptions options;
  options.start_W = Vector3(-15, 0, 0.5);
  options.goal_W = Vector3(15, 0, 1.5);
  const sitl::World world = sitl::load_world(path, options);
  EXPECT_NEAR(world.ground_below_m(world.start_W()), -2.0, 1e-6);
  const report::MissionReport report = fly_mission(world, paper_mission(), {});
  EXPECT_EQ(report.result.reason, "reached_goal");
  EXPECT_FALSE(report.result.collided);
  EXPECT_NEAR(report.path.front().p_WB.z(), -2.0, 0.1);
}

TEST(Ground, AHillOfTrianglesFlies) {
  // A ridge along y, 5 m high at x = 0, down to 0 at x = +-20; the start is on its top.
  sitl::WorldDescription d;
  d.ground_m = -std::numeric_limits<double>::infinity();
  const auto quad = [](const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& e) {
    return std::vector<sitl::Triangle>{{a, b, c}, {a, c, e}};
  };
  std::vector<sitl::Triangle> triangles = quad({-20, -20, 0}, {0, -20, 5}, {0, 20, 5}, {-20, 20, 0});
  const auto right = quad({0, -20, 5}, {60, -20, 0}, {60, 20, 0}, {0, 20, 5});
  triangles.insert(triangles.end(), right.begin(), right.end());
  d.mesh = sitl::TriangleMesh(triangles);
  d.bounds_W = {{-15, -15, 1}, {50, 15, 12}};
  d.start_W = {0.1, 0, 7.5};
  d.goal_W = {40, 0, 5};
  const report::MissionReport report = fly_mission(sitl::World(d), paper_mission(), {});
  EXPECT_EQ(report.result.reason, "reached_goal");
  EXPECT_FALSE(report.result.collided);
  EXPECT_NEAR(report.path.front().p_WB.z(), 5.0, 0.1);
}

TEST(Ground, AStartWithoutAnyIsRefused) {
  sitl::WorldDescription d = upper_floor();
  d.ground_m = -std::numeric_limits<double>::infinity();
  d.boxes[0].min_W.x() = 5.0;  // not under the start
  try {
    (void)flight_config_of(sitl::World(d), paper_mission());
    FAIL() << "a vehicle that stands nowhere";
  } catch (const InputError& refusal) {
    EXPECT_EQ(std::string(refusal.what()).find("no ground below the start (0.00, 0.00, 6.50)"), 0U)
        << refusal.what();
  }
}

TEST(Ground, APlateBesideTheClimbIsFoundHoweverThin) {
  sitl::WorldDescription d = upper_floor();
  EXPECT_NO_THROW((void)flight_config_of(sitl::World(d), paper_mission()));
  d.boxes.push_back({{0.59, -1.0, 5.19}, {0.9, 1.0, 5.2}});  // the vehicle's radius is 0.6 m
  EXPECT_THROW((void)flight_config_of(sitl::World(d), paper_mission()), InputError);
}

TEST(Ground, AWallBesideTheStartIsACollisionWhileItClimbs) {
  sitl::WorldDescription d = upper_floor();
  d.boxes.push_back({{-0.9, -20, 4}, {-0.65, 20, 10}});  // 5 cm from its body: the wind does the rest
  d.boxes.push_back({{0.65, -20, 4}, {0.9, 20, 10}});
  MissionConfig config = paper_mission();
  config.simulator.wind.mean_W_mps = Vector3(9.0, 0.0, 0.0);
  const report::MissionReport report = fly_mission(sitl::World(d), config, {});
  EXPECT_EQ(report.result.reason, "collision");
}

}  // namespace
}  // namespace roborun::mission
