#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "stages/planning/ompl_backend/ompl_backend.hpp"
#include "stages/planning/rrt_star.hpp"
#include "stages/planning/smoother.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/config_death.hpp"

namespace roborun::stages {
namespace {

TEST(RrtStarConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = RrtStar::Config;
  test::expect_only_valid_configs<Config>(
      {},
      [](const Config& config) {
        std::vector<std::byte> block(RrtStar::arena_bytes({}));
        core::Arena arena(block);
        const RrtStar sut(config, arena);
      },
      {{"nodes", [](Config& c) { c.max_nodes = 15; }},
       {"samples", [](Config& c) { c.max_samples = 15; }},
       {"step", [](Config& c) { c.step_m = 0.4; }},
       {"neighbourhood", [](Config& c) { c.rewire_m = std::numeric_limits<double>::quiet_NaN(); }},
       {"patience", [](Config& c) { c.patience = 15; }}});
}

TEST(OmplConfigDeathTest, OnlyValidOnesAreMade) {
  test::expect_only_valid_configs<OmplConfig>(
      {}, [](const OmplConfig& config) { (void)make_ompl_planner("none of its planners", config); },
      {{"no check", [](OmplConfig& c) { c.max_iterations = 0; }}});
}

TEST(MotionLimits, OfARequestAreRefusedNotAsserted) {
  EXPECT_EQ(MotionLimits{}.validate(), Status::kOk);
  const std::vector<Vector3> path_W{Vector3::Zero(), Vector3(5, 0, 0)};
  Smoother sut;
  core::UnlimitedBudget budget;
  for (const MotionLimits limits :
       {MotionLimits{0.0, 4.0}, MotionLimits{6.0, 31.0}, MotionLimits{6.0, 4.0, 0.0},
        MotionLimits{6.0, 4.0, 20.0, 0.0}, MotionLimits{6.0, 4.0, 20.0, 6.0, 0.0}}) {
    EXPECT_EQ(limits.validate(), Status::kInvalidArgument);
    SmoothRequest request;
    request.path_W = path_W;
    request.radius_m = 0.6;
    request.limits = limits;
    SmoothResult result;
    EXPECT_EQ(sut.smooth(request, test::BoxView(), budget, result), Status::kInvalidArgument);
  }
}

}  // namespace
}  // namespace roborun::stages
