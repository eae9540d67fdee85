#include <gtest/gtest.h>

#include "governor/policy/governor.hpp"
#include "tests/support/config_death.hpp"
#include "tests/support/limits.hpp"

namespace roborun::governor {
namespace {

using test::kNan;

TEST(GovernorConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = GovernorConfig;
  test::expect_only_valid_configs<Config>(
      {}, [](const Config& config) { const Governor sut(config); },
      {{"budget", [](Config& c) { c.policy.decisions_per_budget = 0.9; }},
       {"shortest", [](Config& c) { c.policy.shortest = Nanos{0}; }},
       {"longest", [](Config& c) { c.policy.longest = c.policy.shortest - Nanos{1}; }},
       {"longest budget", [](Config& c) { c.policy.longest_budget = c.policy.longest - Nanos{1}; }},
       {"failures", [](Config& c) { c.policy.failures_until_finer = 0; }},
       {"shortest in motion", [](Config& c) { c.policy.shortest_in_motion = Nanos{0}; }},
       {"fine within", [](Config& c) { c.policy.fine_within = Nanos{0}; }},
       {"narrow tries", [](Config& c) { c.policy.narrow_tries = -1; }},
       {"coarser levels", [](Config& c) { c.policy.coarser_levels_per_decision = 0; }},
       {"cells", [](Config& c) { c.policy.cells_to_obstacle = 0.0; }},
       {"share", [](Config& c) { c.policy.planner_share = 1.1; }},
       {"fine volume", [](Config& c) { c.policy.fine_volume_m3 = 0.0; }},
       {"near goal", [](Config& c) { c.policy.near_goal_m = kNan; }},
       {"near goal speed", [](Config& c) { c.policy.near_goal_speed_mps = 0.0; }},
       {"motion speed", [](Config& c) { c.policy.motion_speed_mps = -1.0; }},
       {"thin speed", [](Config& c) { c.policy.thin_speed_mps = 0.0; }},
       {"thin step", [](Config& c) { c.thin_step_m = kNan; }},
       {"reserve", [](Config& c) { c.policy.reserve_ratio = 1.0; }},
       {"stopping", [](Config& c) { c.stopping.quadratic_s2pm = -0.1; }},
       {"model", [](Config& c) { c.model[Knob::kPlan].slope_s_per_m3[2] = kNan; }},
       {"fixed cost", [](Config& c) { c.smoother_s = -0.01; }},
       {"speed", [](Config& c) { c.v_max_mps = 0.0; }},
       {"cheapest speed", [](Config& c) { c.cheapest_mps = 0.0; }},
       {"width", [](Config& c) { c.vehicle_width_m = 0.0; }},
       {"view", [](Config& c) { c.sensor_volume_max_m3 = kNan; }},
       {"level", [](Config& c) { c.coarsest_level = kPrecisionLevels; }},
       {"visibility", [](Config& c) { c.design_visibility_m = 0.0; }},
       {"frame", [](Config& c) { c.minor_frame = Nanos{0}; }}});
}

TEST(BudgetLimitsConfigDeathTest, OnlyValidOnesAreUsed) {
  for (const bool along : {false, true}) {
    test::expect_only_valid_configs<BudgetLimits>(
        {},
        [along](const BudgetLimits& limits) {
          if (along) {
            (void)trajectory_budget({}, kSitlQuadrotorStopping, limits);
          } else {
            (void)time_budget(10.0, 1.0, kSitlQuadrotorStopping, limits);
          }
        },
        {{"nothing", [](BudgetLimits& l) { l.shortest = Nanos{0}; }},
         {"crossed", [](BudgetLimits& l) { l.longest = l.shortest - Nanos{1}; }}});
  }
}

TEST(StoppingModel, TheShippedOnesAreValid) {
  EXPECT_EQ(kRoborunStopping.validate(), Status::kOk) << "its constant is negative";
  EXPECT_EQ(kSitlQuadrotorStopping.validate(), Status::kOk);
}

TEST(KnobArray, NamesTheStageOfEachKnob) {
  EXPECT_EQ(stage_of(Knob::kPerceive), core::StageId::kMap);
  EXPECT_EQ(stage_of(Knob::kExport), core::StageId::kExport);
  EXPECT_EQ(stage_of(Knob::kPlan), core::StageId::kPlanner);
}

}  // namespace
}  // namespace roborun::governor
