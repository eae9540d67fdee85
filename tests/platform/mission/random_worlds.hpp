/// Small random worlds flown through the whole pipeline, judged against the truth at every minor frame.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include "core/random/counter_rng.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/evaluation/suite.hpp"
#include "platform/mission/mission.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::mission {

/// Of all flights.
struct RandomWorldsResult {
  int reached{}, collided{};
  int possible{};                 ///< The judge finds a way (evaluation/suite.hpp).
  int possible_reached{};         ///< Of these.
  int frames{};                   ///< Judged.
  int without_a_stop{};           ///< Commitments that do not end at rest, or whose way touches an obstacle.
  double fastest_mps{};           ///< Of the vehicle.
  double most_tilted_rad{};       ///< Of the vehicle.
  double fastest_plan_mps{};      ///< Of the committed trajectories.
  double hardest_plan_mps2{};     ///< Of the committed trajectories.
  double most_tilted_plan_rad{};  ///< Which the committed trajectories ask for, without drag and wind.
  std::map<std::string, int> reasons;
};

constexpr double kBodyRadius_m = 0.6;

/// 30 m long and 20 m wide, 4 to 10 pillars of 0.4 to 1.5 m radius: somewhere between open and a thicket.
inline sitl::World random_world(std::uint64_t number) {
  core::CounterRng rng(number, 300);
  sitl::WorldDescription d;
  d.bounds_W = {Vector3(-6, -10, 1.5), Vector3(36, 10, 6)};
  d.start_W = Vector3(0, 0, 3);
  d.goal_W = Vector3(30, 0, 3);
  const std::size_t count = 4 + static_cast<std::size_t>(rng.below(7));
  while (d.pillars.size() < count) {
    const sitl::Pillar p{rng.uniform(3.0, 27.0), rng.uniform(-8.0, 8.0), rng.uniform(0.4, 1.5)};
    const double start_m = std::hypot(p.x_m, p.y_m) - p.radius_m;
    const double goal_m = std::hypot(p.x_m - 30.0, p.y_m) - p.radius_m;
    if (start_m > 2.5 && goal_m > 2.5) d.pillars.push_back(p);
  }
  return sitl::World(d);
}

/// From `time_s` after its start on, the trajectory ends at rest and keeps the body off every obstacle.
inline bool ends_in_a_stop(const sitl::World& world, const Trajectory& t, double time_s) {
  const double end_s = t.duration_s();
  if (t.segment_count > 0 && t.at_s(end_s * (1.0 - 1e-9)).v_W.norm() > 1e-2) return false;
  for (double at_s = std::max(time_s, 0.0); at_s < end_s + 0.05; at_s += 0.05) {
    const Vector3 p_W = t.at_s(std::min(at_s, end_s)).p_W;
    if (world.clearance_m(p_W, kBodyRadius_m) < kBodyRadius_m || p_W.z() < kBodyRadius_m) return false;
  }
  return true;
}

inline RandomWorldsResult fly_random_worlds(std::uint64_t first, std::uint64_t count) {
  const board::Profile profile = board::paper();
  RandomWorldsResult result;
  for (std::uint64_t n = first; n < first + count; ++n) {
    const sitl::World world = random_world(n);
    MissionConfig config;
    config.flight.costs = profile.costs;
    config.flight.model = profile.model;
    config.flight.vehicle = vehicle::load_vehicle("paper").model;
    config.seed = n;
    config.simulator.camera.pixels =
        48;  // a quarter of the pixels over two thirds of the range: as fine where it matters
    config.simulator.camera.range_m = 16.0;
    MonotonicTime committed_at{Nanos{-1}};
    config.each_frame = [&](const FrameRecord& frame) {
      if (!frame.airborne) return;
      ++result.frames;
      const sitl::VehicleState& s = frame.truth;
      result.fastest_mps = std::max(result.fastest_mps, s.v_WB.norm());
      const double up = (s.q_WB.toRotationMatrix() * Vector3::UnitZ()).z();
      result.most_tilted_rad = std::max(result.most_tilted_rad, std::acos(std::min(up, 1.0)));
      const TrajectoryPoint wanted = frame.committed.at(frame.now);
      result.fastest_plan_mps = std::max(result.fastest_plan_mps, wanted.v_W.norm());
      result.hardest_plan_mps2 = std::max(result.hardest_plan_mps2, wanted.a_W.norm());
      result.most_tilted_plan_rad = std::max(
          result.most_tilted_plan_rad, std::atan2(wanted.a_W.head<2>().norm(), 9.80665 + wanted.a_W.z()));
      // The way to the stop of each commitment, once: what follows is a part of it.
      if (frame.committed.start_time == committed_at) return;
      committed_at = frame.committed.start_time;
      if (!ends_in_a_stop(world, frame.committed, seconds(frame.now - committed_at))) {
        ++result.without_a_stop;
        ADD_FAILURE() << "no stop in world " << n << " at " << seconds(frame.now.time_since_epoch()) << " s";
      }
    };
    const report::MissionReport report = fly_mission(world, config, {});
    result.reached += report.result.reached_goal ? 1 : 0;
    const bool possible = !std::isnan(evaluation::judged_way_m(world, kBodyRadius_m));
    result.possible += possible ? 1 : 0;
    result.possible_reached += possible && report.result.reached_goal ? 1 : 0;
    if (possible && !report.result.reached_goal)
      std::printf("  world %llu: %s after %.0f s, %.1f m flown\n", static_cast<unsigned long long>(n),
                  report.result.reason.c_str(), report.result.mission_time_s, report.result.distance_m);
    result.collided += report.result.collided ? 1 : 0;
    ++result.reasons[report.result.reason];
    if (report.result.collided) ADD_FAILURE() << "collision in world " << n;
  }
  std::printf(
      "%llu worlds: %d reached the goal, %d of %d that have a way, %d collided, %d commitments without a "
      "stop; vehicle at most %.2f "
      "m/s and %.1f degrees, trajectories %.2f m/s, %.2f m/s2 and %.1f degrees\n",
      static_cast<unsigned long long>(count), result.reached, result.possible_reached, result.possible,
      result.collided, result.without_a_stop, result.fastest_mps, result.most_tilted_rad * 57.29578,
      result.fastest_plan_mps, result.hardest_plan_mps2, result.most_tilted_plan_rad * 57.29578);
  for (const auto& [reason, times] : result.reasons) std::printf("  %s: %d\n", reason.c_str(), times);
  return result;
}

inline void expect_safe(const RandomWorldsResult& result, int worlds) {
  EXPECT_EQ(result.collided, 0);
  EXPECT_EQ(result.without_a_stop, 0);
  EXPECT_GT(result.frames, 1000 * worlds) << "something was judged";
  EXPECT_GT(result.reached, worlds / 2);
  EXPECT_GT(result.possible, worlds / 2);
  EXPECT_LE(200 * (result.possible - result.possible_reached), result.possible) << "0.5 % at most";
  EXPECT_LE(result.fastest_mps, 6.0 * 1.15);
  EXPECT_LE(result.fastest_plan_mps, 6.0 * 1.10);
  EXPECT_LE(result.hardest_plan_mps2, 4.0 * 1.20);
  EXPECT_LE(result.most_tilted_plan_rad, 0.60) << "what the tracker allows";
  // A damping of 0.67 overshoots by exp(-pi 0.67 / sqrt(1 - 0.67^2)) of the step: 5.9 % of the way from the
  // tracker's limit on one side to that on the other.
  EXPECT_LE(result.most_tilted_rad, 0.60 + 0.059 * 1.20);
}

}  // namespace roborun::mission
