/// Flights across the ways of moving bodies, judged against the truth at every minor frame.
#pragma once

#include <algorithm>
#include <cstdio>

#include "core/random/counter_rng.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/mission/mission.hpp"

namespace roborun::mission {

struct CrossingsResult {
  int reached{}, collided{}, struck_at_rest{}, struck_moving{}, other{};
};

/// The costs of the paper's machine times `cost_factor`: 0.15 is the library's.
inline MissionConfig crossing_mission(double cost_factor, std::uint64_t seed) {
  const board::Profile profile = board::slower(board::paper(), cost_factor);
  MissionConfig config;
  config.flight.costs = profile.costs;
  config.flight.model = profile.model;
  config.seed = seed;
  config.simulator.camera.pixels = 48;
  config.simulator.camera.range_m = 16.0;
  config.judge.time_limit_s = 90.0;
  return config;
}

/// 36 m to the goal, and three bodies of 0.3 to 0.8 m radius at 1 to 3 m/s that cross the straight line from
/// either side, each at about the time at which an undisturbed vehicle comes by.
inline sitl::World crossing_world(std::uint64_t number) {
  constexpr double kReady_s = 8.0;     // climb and first decision are over
  constexpr double kCruise_mps = 3.0;  // on the average
  constexpr double kAway_m = 24.0;     // where a body begins and ends
  core::CounterRng rng(number, 600);
  sitl::WorldDescription d;
  d.bounds_W = {Vector3(-6, -12, 1.5), Vector3(42, 12, 6)};
  d.start_W = Vector3(0, 0, 3);
  d.goal_W = Vector3(36, 0, 3);
  for (int i = 0; i < 3; ++i) {
    sitl::Body body;
    body.radius_m = rng.uniform(0.3, 0.8);
    body.height_m = rng.below(2) == 0 ? 0.0 : 3.0;
    body.speed_mps = rng.uniform(1.0, 3.0);
    const Vector3 crossing_W(rng.uniform(8.0, 30.0), 0.0, 3.0);
    const double side = rng.below(2) == 0 ? 1.0 : -1.0;
    const Vector3 way = Vector3(rng.uniform(-0.7, 0.7), side, 0.0).normalized();
    const double meets_s = kReady_s + crossing_W.x() / kCruise_mps + rng.uniform(-1.5, 1.5);
    // Shortened where it would have to begin before time zero.
    const double before_m = std::min(kAway_m, meets_s * body.speed_mps);
    body.start_s = meets_s - before_m / body.speed_mps;
    body.path_W = {crossing_W - before_m * way, crossing_W + kAway_m * way};
    d.bodies.push_back(body);
  }
  return sitl::World(d);
}

inline CrossingsResult fly_crossings(std::uint64_t first, std::uint64_t count, double cost_factor) {
  CrossingsResult result;
  for (std::uint64_t n = first; n < first + count; ++n) {
    MissionConfig config = crossing_mission(cost_factor, n);
    double speed_mps = 0.0;
    config.each_frame = [&speed_mps](const FrameRecord& frame) { speed_mps = frame.truth.v_WB.norm(); };
    const report::MissionReport report = fly_mission(crossing_world(n), config, {});
    const bool struck = report.result.reason == "struck";
    const bool rest = speed_mps < 0.3;
    result.reached += report.result.reached_goal ? 1 : 0;
    result.collided += report.result.collided ? 1 : 0;
    result.struck_at_rest += struck && rest ? 1 : 0;
    result.struck_moving += struck && !rest ? 1 : 0;
    result.other += report.result.reached_goal || report.result.collided || struck ? 0 : 1;
  }
  std::printf(
      "%llu crossings at %.2f of the paper's costs: %d reached the goal, %d flew into a body, %d were struck "
      "moving otherwise, %d at rest, %d ended otherwise\n",
      static_cast<unsigned long long>(count), cost_factor, result.reached, result.collided,
      result.struck_moving, result.struck_at_rest, result.other);
  return result;
}

}  // namespace roborun::mission
