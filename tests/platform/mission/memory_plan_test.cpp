#include <gtest/gtest.h>

#include <set>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/mission/audit_run.hpp"
#include "platform/mission/mission.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::mission {
namespace {

sitl::World world() {
  return sitl::generate(sitl::environment("14").knobs, sitl::Mission::kPackageDelivery, 1);
}

MissionConfig config_of(const char* vehicle) {
  MissionConfig config;
  set_vehicle(config, vehicle::load_vehicle(vehicle));
  config.flight.costs = board::paper().costs;
  config.flight.model = board::paper().model;
  config.judge.time_limit_s = 25.0;
  return config;
}

void expect_names_of_their_own(const std::vector<report::PoolUse>& pools) {
  std::set<std::string> names;
  for (const report::PoolUse& p : pools) EXPECT_TRUE(names.insert(p.name).second) << p.name << " twice";
}

class MemoryPlanTest : public ::testing::TestWithParam<const char*> {};

TEST_P(MemoryPlanTest, SaysOfEveryPoolHowMuchAFlightUsed) {
  const report::MissionReport flown = fly_mission(world(), config_of(GetParam()), {});
  ASSERT_GT(flown.result.decisions, 3U);
  ASSERT_GE(flown.pools.size(), 15U);
  expect_names_of_their_own(flown.pools);
  for (const report::PoolUse& p : flown.pools) {
    EXPECT_TRUE(p.tells_use) << p.name;
    // The lattice search waits for a way that sampling does not find.
    EXPECT_TRUE(p.high_water > 0 || p.name.rfind("lattice", 0) == 0) << p.name;
    EXPECT_LE(p.high_water, p.count) << p.name;
  }
}

// Cameras that see all around; a LiDAR alone.
INSTANTIATE_TEST_SUITE_P(Vehicles, MemoryPlanTest, ::testing::Values("paper", "racer"));

TEST(MemoryPlan, NamesEveryPoolOfItsOwnBeforeAFlight) {
  const auto pools = memory_plan_of(world(), config_of("paper"));
  ASSERT_GE(pools.size(), 15U);
  expect_names_of_their_own(pools);
}

}  // namespace
}  // namespace roborun::mission
