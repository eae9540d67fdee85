/// Openings of 0.4 m more than the vehicle: where plans have hardly any room, and the map's noise leaves less.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "core/executive/cost_profile.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/mission/mission.hpp"
#include "platform/sitl/world/world_maker.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::mission {
namespace {

constexpr std::uint64_t kSeeds = 6;

/// Three openings one after the other.
bool flies_through(sitl::WorldKind kind, std::uint64_t seed, const board::Profile& board,
                   const std::string& name) {
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(name);
  MissionConfig config;
  set_vehicle(config, vehicle);
  config.seed = seed;
  config.flight.costs = board.costs;
  config.flight.model = board.model;
  config.judge.time_limit_s = 300.0;
  sitl::WorldMakerOptions options;
  options.radius_m = vehicle.model.radius_m;
  const sitl::World world(sitl::make_world(kind, seed, options));
  const report::MissionResult r = fly_mission(world, config, {}).result;
  EXPECT_FALSE(r.collided) << seed;
  std::printf("seed %d: %s after %.0f s\n", static_cast<int>(seed), r.reason.c_str(), r.mission_time_s);
  return r.reason == "reached_goal";
}

TEST(Narrow, GapsAndWindowsAreFlownThrough) {
  const board::Profile board = board::slower(board::paper(), 0.1);
  for (const sitl::WorldKind kind : {sitl::WorldKind::kGaps, sitl::WorldKind::kWindows}) {
    std::uint64_t arrived = 0;
    for (std::uint64_t seed = 61; seed < 61 + kSeeds; ++seed)
      arrived += flies_through(kind, seed, board, "paper") ? 1U : 0U;
    EXPECT_EQ(arrived, kSeeds);
  }
}

/// With one camera it goes to where it sees what it does not know of the opening.
TEST(Narrow, WindowsAreFlownThroughWithOneCamera) {
  EXPECT_TRUE(flies_through(sitl::WorldKind::kWindows, 70, board::slower(board::paper(), 0.1), "x500"));
}

}  // namespace
}  // namespace roborun::mission
