#include "platform/mission/work_check.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/mission.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/support/busy_planner.hpp"

namespace roborun::mission {
namespace {

TEST(WorkRecord, IsBelievedUpToFiveTimesWhatItsWorkIsWorth) {
  EXPECT_TRUE(is_believable({"planner", 1.0, 0.201}));
  EXPECT_FALSE(is_believable({"planner", 1.0, 0.199}));
  EXPECT_TRUE(is_believable({"planner", 1.0, 100.0})) << "who says more than he did is charged for it";
  EXPECT_TRUE(is_believable({"planner", 0.049, 0.0})) << "too short to tell";
  EXPECT_FALSE(is_believable({"planner", 0.051, 0.0}));
  EXPECT_FALSE(is_believable({"planner", 1.0, std::numeric_limits<double>::quiet_NaN()}));
}

class WorkCheck : public ::testing::Test {
 protected:
  WorkCheck() : world_(sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {})) {
    config_.flight.costs = board::paper().costs;
    config_.flight.model = board::paper().model;
  }
  void plan_with(int repeats, double share) {
    config_.own.planner = [=](const board::PartRequest&) {
      return std::make_unique<test::BusyPlanner>(repeats, share);
    };
  }
  [[nodiscard]] report::WorkRecord planner() const {
    const report::MissionReport flown = fly_mission(world_, config_, {});
    EXPECT_TRUE(flown.result.reached_goal) << flown.result.reason;
    EXPECT_EQ(flown.work.size(), 3U);
    return flown.work.back();
  }
  sitl::World world_;
  MissionConfig config_;
};

TEST_F(WorkCheck, ThePartsThatShipAreBelieved) {
  const report::MissionReport flown = fly_mission(world_, config_, {});
  ASSERT_EQ(flown.work.size(), 3U);
  for (const report::WorkRecord& w : flown.work) {
    EXPECT_TRUE(is_believable(w)) << w.stage << ": " << w.measured_s << " s, counted " << w.counted_s;
    EXPECT_GT(w.measured_s, 0.0) << w.stage;
    EXPECT_GT(w.counted_s, 0.0) << w.stage;
  }
}

TEST_F(WorkCheck, APlannerThatCountsItsWorkIsBelieved) {
  plan_with(1, 1.0);
  EXPECT_TRUE(is_believable(planner()));
}

TEST_F(WorkCheck, APlannerThatWorksMuchAndSaysLittleIsNotBelieved) {
  plan_with(300, 1e-3);
  const report::WorkRecord lie = planner();
  EXPECT_FALSE(is_believable(lie)) << lie.measured_s << " s, counted " << lie.counted_s;
}

TEST_F(WorkCheck, TheLowestPriceCounts) {
  config_.host_costs = core::CostProfile{};
  EXPECT_EQ(planner().counted_s, 0.0) << "nothing costs anything on that machine";
  config_.host_costs.reset();
  const double at_factor_1_s = planner().counted_s;
  config_.host_factor = 4.0;
  EXPECT_NEAR(planner().counted_s, at_factor_1_s / 4.0, 1e-6);
}

TEST_F(WorkCheck, APathForNothingIsRefused) {
  plan_with(1, 0.0);
  try {
    (void)fly_mission(world_, config_, {});
    FAIL() << "flown";
  } catch (const InputError& refusal) {
    EXPECT_EQ(
        std::string(refusal.what()).find("--planner: custom: planned a path, and said that it did no work"),
        0U)
        << refusal.what();
  }
}

TEST_F(WorkCheck, LooksAreNotChangedByBeingTimed) {
  const std::string hash = fly_mission(world_, config_, {}).result.state_hash;
  config_.host_costs = core::CostProfile{};
  EXPECT_EQ(fly_mission(world_, config_, {}).result.state_hash, hash);
}

}  // namespace
}  // namespace roborun::mission
