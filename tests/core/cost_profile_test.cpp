#include "core/executive/cost_profile.hpp"

#include <gtest/gtest.h>

namespace roborun::core {
namespace {

double cost_s(StageId id, double volume_m3, int level) {
  static const CostProfile profile = paper_profile();
  return seconds(profile.cost(id, {0, volume_m3, level}));
}

TEST(PaperProfile, RecomputesTheStaticKnobs) {
  // Expected by the authors' fits: map 7.1, export 0.8, planner 5.6 s. From the measured table, without the
  // hand-over of 0.25 s: 4.6 * 1.26 = 5.796; 15 * 0.074 = 1.11; 15 * 0.37 = 5.55 s.
  EXPECT_NEAR(cost_s(StageId::kMap, 46e3, 0) - cost_s(StageId::kMap, 0, 0), 5.796, 1e-6);
  EXPECT_NEAR(cost_s(StageId::kExport, 150e3, 0) - cost_s(StageId::kExport, 0, 0), 1.11, 1e-6);
  EXPECT_NEAR(cost_s(StageId::kPlanner, 150e3, 0), 5.55, 1e-6);
}

TEST(PaperProfile, CostsNeverGrowWithCoarserCells) {
  for (const StageId id : {StageId::kMap, StageId::kExport, StageId::kPlanner}) {
    for (int level = 0; level + 1 < kPrecisionLevels; ++level)
      EXPECT_GE(cost_s(id, 1e4, level), cost_s(id, 1e4, level + 1));
  }
  EXPECT_NEAR(cost_s(StageId::kPlanner, 1e4, 5), 0.005, 1e-5) << "the authors' fit at 9.6 m";
}

TEST(CostProfile, ClampsLevelsAndNegativeWork) {
  EXPECT_EQ(cost_s(StageId::kMap, 1e4, 99), cost_s(StageId::kMap, 1e4, 5));
  EXPECT_EQ(cost_s(StageId::kMap, -1e9, 0), cost_s(StageId::kMap, 0.0, 0));
}

TEST(CostProfile, OnHalfTheCellsIsOneLevelOffAndGrowsBelow) {
  const std::array<double, kPrecisionLevels> published{8.0, 2.0, 1.0, 0.5, 0.5, 0.25};
  const auto half = on_lattice(published, {0.15});
  EXPECT_EQ(half, (std::array<double, kPrecisionLevels>{32.0, 8.0, 2.0, 1.0, 0.5, 0.5}));
  EXPECT_EQ(on_lattice(published, {}), published);
  const auto third = on_lattice(published, {0.1});
  EXPECT_GT(third[0], half[0]);
  EXPECT_GT(third[1], half[1]) << "0.2 m";
  EXPECT_LT(third[1], half[0]);
}

}  // namespace
}  // namespace roborun::core
