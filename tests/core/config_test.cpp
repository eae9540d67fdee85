// Configs of core, and what they are checked with.
#include <gtest/gtest.h>

#include <limits>

#include "core/executive/lane_meter.hpp"
#include "core/memory/enum_array.hpp"
#include "core/range.hpp"
#include "tests/support/config_death.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/names.hpp"

namespace roborun::core {
namespace {

using test::kNan;

TEST(Range, HoldsTheEndsThatItSays) {
  EXPECT_TRUE(within(0.0, 0.0, 1.0));
  EXPECT_TRUE(within(1.0, 0.0, 1.0));
  EXPECT_FALSE(within(1.1, 0.0, 1.0));
  EXPECT_FALSE(above(0.0, 0.0, 1.0));
  EXPECT_TRUE(above(1.0, 0.0, 1.0));
  EXPECT_FALSE(within(kNan, 0.0, 1.0));
  EXPECT_FALSE(above(kNan, 0.0, 1.0));
}

TEST(StageArray, IsIndexedByStageAndByNumber) {
  StageArray<int> sut{};
  sut[StageId::kPlanner] = 7;
  EXPECT_EQ(sut[static_cast<std::size_t>(StageId::kPlanner)], 7);
  EXPECT_EQ(sut.size(), kStageCount);
  const std::array<int, kStageCount> plain = sut;
  EXPECT_EQ(plain[4], 7);
}

TEST(StageId, HasTheNameOfItsSlot) {
  test::expect_names<StageId>({"point_cloud", "governor", "map", "export", "planner", "smoother"}, "unknown");
  for (std::size_t i = 0; i < kStageCount; ++i) {
    const auto id = static_cast<StageId>(i);
    EXPECT_STREQ(to_string(id), slot(slot_of(id)).name);
  }
}

TEST(CostProfileConfigDeathTest, OnlyValidOnesAreMade) {
  test::expect_only_valid_configs<CostProfile>(
      paper_profile(),
      [](const CostProfile& profile) {
        VirtualClock clock;
        const CostProfileMeter sut(profile, clock);
      },
      {{"time back", [](CostProfile& p) { p.stage[StageId::kMap].fixed_s[0] = -0.1; }},
       {"no number", [](CostProfile& p) { p.stage[StageId::kMap].per_m3_s[5] = kNan; }},
       {"no end", [](CostProfile& p) {
          p.stage[StageId::kSmoother].per_unit_s = std::numeric_limits<double>::infinity();
        }}});
}

}  // namespace
}  // namespace roborun::core
