/// A vehicle that may fly faster does not need longer: forests, with four limits of its speed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "core/executive/cost_profile.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/mission/mission.hpp"
#include "platform/sitl/world/world_maker.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::mission {
namespace {

constexpr std::uint64_t kSeeds = 8;
constexpr double kTolerance = 1.1;  // of the mean: one forest differs from the next by a fifth

/// Through a forest of 5 m, on a board of a tenth of the published latencies.
double forest_s(double speed_mps, std::uint64_t seed) {
  vehicle::Vehicle vehicle = vehicle::load_vehicle("paper");
  vehicle.model.speed_mps = speed_mps;
  MissionConfig config;
  set_vehicle(config, vehicle);
  const board::Profile board = board::slower(board::paper(), 0.1);
  config.seed = seed;
  config.flight.costs = board.costs;
  config.flight.model = board.model;
  config.judge.time_limit_s = 300.0;
  sitl::WorldMakerOptions options;
  options.spacing_m = 5.0;
  const sitl::World world(sitl::make_world(sitl::WorldKind::kForest, seed, options));
  const report::MissionResult r = fly_mission(world, config, {}).result;
  EXPECT_EQ(r.reason, "reached_goal") << speed_mps << " m/s, seed " << seed;
  std::printf("%.0f m/s, seed %d: %.1f s\n", speed_mps, static_cast<int>(seed), r.mission_time_s);
  return r.mission_time_s;
}

TEST(SpeedLimit, MoreOfItMakesNoFlightThroughForestsSlower) {
  double least_s = std::numeric_limits<double>::infinity();
  for (const double speed_mps : {4.0, 6.0, 8.0, 12.0}) {
    double sum_s = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) sum_s += forest_s(speed_mps, seed);
    const double mean_s = sum_s / static_cast<double>(kSeeds);
    std::printf("at most %.0f m/s: %.1f s\n", speed_mps, mean_s);
    EXPECT_LE(mean_s, kTolerance * least_s) << speed_mps << " m/s";
    least_s = std::min(least_s, mean_s);
  }
}

}  // namespace
}  // namespace roborun::mission
