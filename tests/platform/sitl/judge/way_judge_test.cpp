#include "platform/sitl/judge/way_judge.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "platform/input/input_error.hpp"
#include "platform/sitl/world/world_maker.hpp"

namespace roborun::sitl {
namespace {

/// 20 m of free way along x, in bounds of 24 x 12 x 4 m.
WorldDescription open_way() {
  WorldDescription d;
  d.bounds_W = {{-2, -6, 1}, {22, 6, 5}};
  d.start_W = {0, 0, 3};
  d.goal_W = {20, 0, 3};
  return d;
}

WayVerdict judged(const WorldDescription& d, double radius_m, double resolution_m = 0.0) {
  WayQuestion question;
  question.radius_m = radius_m;
  question.resolution_m = resolution_m;
  return judge_way(World(d), question);
}

/// Every way that is claimed is walked in steps of 1 cm.
void expect_free(const WorldDescription& d, const WayVerdict& verdict, double radius_m) {
  const World world(d);
  ASSERT_GE(verdict.way_W.size(), 2U);
  EXPECT_EQ(verdict.way_W.front(), d.start_W);
  EXPECT_EQ(verdict.way_W.back(), d.goal_W);
  double length_m = 0.0;
  for (std::size_t i = 1; i < verdict.way_W.size(); ++i) {
    const Vector3 step = verdict.way_W[i] - verdict.way_W[i - 1];
    length_m += step.norm();
    const int count = static_cast<int>(step.norm() / 0.01) + 1;
    for (int k = 0; k <= count; ++k) {
      const Vector3 p_W = verdict.way_W[i - 1] + static_cast<double>(k) / count * step;
      ASSERT_GE(world.clearance_m(p_W, 3.0), radius_m - 0.011);
      ASSERT_TRUE(world.bounds_W().contains(p_W));
    }
  }
  EXPECT_NEAR(length_m, verdict.shortest_m, 1e-9);
}

TEST(WayJudge, AnOpenWorldIsStraight) {
  const WayVerdict verdict = judged(open_way(), 0.8);
  EXPECT_TRUE(verdict.way);
  EXPECT_NEAR(verdict.shortest_m, 20.0, 1e-9);
  EXPECT_EQ(verdict.narrowest_m, 2.0 * kWidest_m);
}

TEST(WayJudge, AGapOfExactlyTheDiameterIsAWayAndASmallerOneIsNot) {
  for (const double gap_m : {1.6, 1.58}) {
    WorldDescription d = open_way();
    d.boxes.push_back({{10, -8, 0}, {10.6, -0.5 * gap_m, 9}});
    d.boxes.push_back({{10, 0.5 * gap_m, 0}, {10.6, 8, 9}});
    const WayVerdict verdict = judged(d, 0.8);
    EXPECT_EQ(verdict.way, gap_m == 1.6);
    EXPECT_NEAR(verdict.narrowest_m, gap_m, 0.01);
    EXPECT_NEAR(verdict.narrowest_W.x(), 10.3, 0.5);
    if (verdict.way) expect_free(d, verdict, 0.8);
  }
}

TEST(WayJudge, AWayAroundAWallHasTheLengthOfATangent) {
  WorldDescription d = open_way();
  d.boxes.push_back({{10, -3, 0}, {10.4, 6.5, 9}});
  const double radius_m = 0.8;
  const WayVerdict verdict = judged(d, radius_m);
  ASSERT_TRUE(verdict.way);
  expect_free(d, verdict, radius_m);
  // Tangents from start and goal to the circle about the corner (10, -3), and 0.4 m along the wall's face.
  const double far_m = std::hypot(10.0, 3.0);
  const double tangent_m = std::sqrt(far_m * far_m - radius_m * radius_m);
  const double turn_rad = std::atan2(3.0, 10.0) + std::asin(radius_m / far_m);
  const double far2_m = std::hypot(9.6, 3.0);
  const double tangent2_m = std::sqrt(far2_m * far2_m - radius_m * radius_m);
  const double turn2_rad = std::atan2(3.0, 9.6) + std::asin(radius_m / far2_m);
  const double shortest_m = tangent_m + tangent2_m + 0.4 + radius_m * (turn_rad + turn2_rad);
  EXPECT_GE(verdict.shortest_m, shortest_m - 0.05);
  EXPECT_LE(verdict.shortest_m, 1.03 * shortest_m);
}

TEST(WayJudge, GoesOverAndUnderToo) {
  WorldDescription d = open_way();
  d.boxes.push_back({{10, -8, 0}, {10.4, 8, 3.4}});  // 1.6 m and no more up to the bounds
  EXPECT_TRUE(judged(d, 0.8).way);
  d.boxes.back().max_W.z() = 4.4;
  EXPECT_FALSE(judged(d, 0.8).way);
  d.boxes.back() = {{10, -8, 2.4}, {10.4, 8, 9}};
  const WayVerdict under = judged(d, 0.8);
  ASSERT_TRUE(under.way);
  expect_free(d, under, 0.8);
}

TEST(WayJudge, SaysHowWideTheBestOfSeveralGapsIs) {
  WorldDescription d = open_way();
  // Gaps of 1.0 m at y = -4, and 1.4 m at y = 3.
  d.boxes.push_back({{10, -8, 0}, {10.4, -4.5, 9}});
  d.boxes.push_back({{10, -3.5, 0}, {10.4, 2.3, 9}});
  d.boxes.push_back({{10, 3.7, 0}, {10.4, 8, 9}});
  const WayVerdict verdict = judged(d, 0.8, 0.1);
  EXPECT_FALSE(verdict.way);
  EXPECT_TRUE(verdict.way_W.empty());
  EXPECT_TRUE(std::isinf(verdict.shortest_m));
  EXPECT_NEAR(verdict.narrowest_m, 1.4, 0.01);
  EXPECT_TRUE(judged(d, 0.65, 0.1).way);
}

TEST(WayJudge, AWireIsNotJumpedOver) {
  WorldDescription d = open_way();
  // A net of wires of 2 cm, 1 m apart, none of them on a place of the lattice.
  for (double y_m = -8.07; y_m < 8.0; y_m += 1.0)
    d.boxes.push_back({{10.09, y_m, 0}, {10.11, y_m + 0.02, 9}});
  const WayVerdict verdict = judged(d, 0.6);
  EXPECT_FALSE(verdict.way);
  EXPECT_NEAR(verdict.narrowest_m, 0.98, 0.1);
  EXPECT_LE(verdict.narrowest_m, 0.9801);
}

TEST(WayJudge, EveryWorldThatIsMadeHasAWayUnlessClosed) {
  for (const WorldKind kind : {WorldKind::kMaze, WorldKind::kTrap, WorldKind::kWalls, WorldKind::kGaps,
                               WorldKind::kWindows, WorldKind::kOffice, WorldKind::kCave}) {
    const auto name = kWorldKindName[static_cast<std::size_t>(kind)];
    for (const double radius_m : {0.6, 0.15}) {
      const bool doors =
          kind == WorldKind::kGaps || kind == WorldKind::kWindows || kind == WorldKind::kOffice;
      if (radius_m < 0.2 && !doors) continue;  // the others are as wide for every vehicle
      WorldMakerOptions options;
      options.radius_m = radius_m;
      const WorldDescription open = make_world(kind, 2, options);
      const WayVerdict verdict = judged(open, radius_m + 0.2);
      ASSERT_TRUE(verdict.way) << name << ' ' << radius_m;
      expect_free(open, verdict, radius_m + 0.2);
      EXPECT_GE(verdict.narrowest_m, 2.0 * radius_m + 0.39) << name;
      if ((kind != WorldKind::kMaze && kind != WorldKind::kOffice) || radius_m < 0.2) continue;
      options.closed = true;
      const WayVerdict closed = judged(make_world(kind, 2, options), radius_m + 0.2, 0.2);
      EXPECT_FALSE(closed.way) << name;
      EXPECT_EQ(closed.narrowest_m, 0.0) << name;
    }
  }
}

TEST(WayJudge, RefusesARadiusOrResolutionThatCannotBe) {
  EXPECT_THROW((void)judged(open_way(), 0.0), InputError);
  EXPECT_THROW((void)judged(open_way(), 5.0), InputError);
  EXPECT_THROW((void)judged(open_way(), 0.8, 1e-6), InputError);
}

}  // namespace
}  // namespace roborun::sitl
