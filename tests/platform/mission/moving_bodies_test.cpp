#include "tests/platform/mission/moving_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace roborun::mission {
namespace {

constexpr double kMinorFrame_s = 0.0025;

/// Forty metres straight on, nothing in the way.
sitl::WorldDescription open_way() {
  sitl::WorldDescription d;
  d.bounds_W = {Vector3(-6, -12, 1.5), Vector3(46, 12, 6)};
  d.start_W = Vector3(0, 0, 3);
  d.goal_W = Vector3(40, 0, 3);
  return d;
}

bool is_stop(const Trajectory& t) { return t.segment_count == 3 && t.brake_begin_s == 0.0; }

/// Stops flown before their decision was done, each at most two minor frames after the end of its map slot.
int early_stops(double cost_factor, double appears_s) {
  sitl::WorldDescription d = open_way();
  // There from one image to the next, somewhere ahead of the vehicle.
  sitl::Body wall;
  wall.radius_m = 2.0;
  wall.height_m = 8.0;
  wall.speed_mps = 50.0;
  wall.start_s = appears_s;
  wall.path_W = {Vector3(22, 20, 4), Vector3(22, 0, 4)};
  d.bodies.push_back(wall);
  MissionConfig config = crossing_mission(cost_factor, 1);
  std::vector<double> stopped_s;
  MonotonicTime committed{Nanos{-1}};
  config.each_frame = [&](const FrameRecord& frame) {
    if (frame.committed.start_time == committed) return;
    committed = frame.committed.start_time;
    if (is_stop(frame.committed)) stopped_s.push_back(seconds(frame.now.time_since_epoch()));
  };
  const report::MissionReport report = fly_mission(sitl::World(d), config, {});
  int early = 0;
  for (const double stop_s : stopped_s) {
    const report::DecisionRecord* decision = nullptr;
    for (const report::DecisionRecord& r : report.decisions) {
      if (r.time_s < stop_s) decision = &r;
    }
    if (decision == nullptr || stop_s >= decision->time_s + decision->latency_s) continue;
    ++early;
    double map_s = decision->time_s;
    for (const core::StageId id : {core::StageId::kPointCloud, core::StageId::kGovernor, core::StageId::kMap})
      map_s += decision->stage_s[static_cast<std::size_t>(id)];
    EXPECT_GE(stop_s, map_s);
    EXPECT_LE(stop_s, map_s + 2.0 * kMinorFrame_s + 1e-9);
  }
  return early;
}

TEST(AlwaysAStop, IsFlownTwoMinorFramesAfterTheMapThatShowsTheWayBlocked) {
  int early = 0;
  // So far ahead that the flight lane's own look does not see it first.
  for (const double appears_s : {4.5, 5.0, 5.5, 6.0}) early += early_stops(0.15, appears_s);
  EXPECT_GT(early, 0) << "otherwise nothing was in the way";
}

TEST(AlwaysAStop, IsTheTailOfTheTrajectoryWhenNoDecisionComes) {
  MissionConfig config = crossing_mission(0.15, 1);
  config.faults.push_back({{sitl::Component::kCpu, sitl::FaultKind::kStuck}, governor::Phase::kMission, 3.0});
  MonotonicTime due{};
  double due_mps = 0.0;
  double most_mps = 0.0, last_mps = 0.0;  // from then on
  std::uint64_t number = 0;
  config.each_frame = [&](const FrameRecord& frame) {
    const double at_s = seconds(frame.now - frame.committed.start_time);
    const double speed_mps = frame.committed.at(frame.now).v_W.norm();
    if (!frame.airborne || frame.committed.segment_count == 0) return;
    if (at_s < frame.committed.brake_begin_s) {
      due = frame.committed.start_time + from_seconds(frame.committed.brake_begin_s);
      due_mps = most_mps = speed_mps;
      ++number;
    } else if (frame.now >= due) {
      most_mps = std::max(most_mps, speed_mps);
      last_mps = speed_mps;
    }
  };
  const report::MissionReport report = fly_mission(sitl::World(open_way()), config, {});
  EXPECT_GT(number, 0U);
  EXPECT_GT(due_mps, 2.0) << "otherwise there was nothing to brake";
  EXPECT_LT(most_mps, due_mps + 0.05) << "a curve of bounded jerk";
  EXPECT_LT(last_mps, 0.01);
  EXPECT_FALSE(report.result.collided);
  EXPECT_EQ(report.result.reason, "holding");
}

TEST(MovingBody, ThatRunsIntoAHoveringVehicleIsNotItsCollision) {
  sitl::WorldDescription d = open_way();
  sitl::Body body;
  body.radius_m = 0.5;
  body.height_m = 8.0;
  body.speed_mps = 50.0;  // nobody could leave
  body.start_s = 5.0;
  body.path_W = {Vector3(0, -100, 4), Vector3(0, 0, 4)};
  d.bodies.push_back(body);
  MissionConfig config = crossing_mission(0.15, 1);
  config.faults.push_back({{sitl::Component::kPlanner, sitl::FaultKind::kOff}});  // it stays at the top
  const report::MissionReport report = fly_mission(sitl::World(d), config, {});
  EXPECT_EQ(report.result.reason, "struck");
  EXPECT_FALSE(report.result.collided);
}

}  // namespace
}  // namespace roborun::mission
