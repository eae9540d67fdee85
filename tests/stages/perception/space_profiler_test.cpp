#include "stages/perception/space_profiler.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/geometry/math.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;
constexpr double kRadius_m = 0.6;

/// Free is only what lies behind a plane 3 m ahead of the vehicle, which is at the origin at 5 m height.
class SpaceProfilerTest : public ::testing::Test {
 protected:
  SpaceProfilerTest() { view_.free_W = {Vector3(-40, -40, 0), Vector3(3, 40, 12)}; }
  const SpaceProfile& profile(const Vector3& v_WB, const Trajectory& committed) {
    core::UnlimitedBudget budget;
    core::Work work;
    EXPECT_EQ(profile_space(SpaceProfilerConfig{}, points_, view_, committed, {}, p_WB_, v_WB, goal_W_,
                            relevant_W_, kRadius_m, profile_, budget, work),
              Status::kOk);
    return profile_;
  }
  static Trajectory straight(const Vector3& from_W, const Vector3& v_W, double duration_s) {
    Trajectory t = Trajectory::hold(from_W, {});
    t.segment_count = 1;
    t.segment[0].duration_s = duration_s;
    t.segment[0].coefficient[0] = from_W;
    t.segment[0].coefficient[1] = v_W;
    return t;
  }

  test::BoxView view_;
  std::vector<CloudPoint> points_;
  Vector3 p_WB_{0, 0, 5};
  Vector3 goal_W_{50, 0, 5};
  Aabb relevant_W_{Vector3(-30, -30, 1), Vector3(30, 30, 9)};
  SpaceProfile profile_;
};

TEST_F(SpaceProfilerTest, FlyingAwayFromTheUnknownIsNotFlyingTowardsIt) {
  const Trajectory hold = Trajectory::hold(p_WB_, {});
  const double towards_m = profile(Vector3(4, 0, 0), hold).closest_unknown_m;
  EXPECT_GT(towards_m, 1.5);
  EXPECT_LE(towards_m, 3.0 - kRadius_m);
  EXPECT_DOUBLE_EQ(profile(Vector3(-4, 0, 0), hold).closest_unknown_m, 25.0);
  EXPECT_DOUBLE_EQ(profile(Vector3(0, 4, 0), hold).closest_unknown_m, 25.0) << "along the plane";
  EXPECT_DOUBLE_EQ(profile(Vector3::Zero(), hold).closest_unknown_m, towards_m)
      << "at rest: towards the goal";
}

TEST_F(SpaceProfilerTest, TheOutlookSeesTheUnknownOnlyWhereTheTrajectoryHeadsForIt) {
  const SpaceProfile& away = profile(Vector3(-4, 0, 0), straight(p_WB_, Vector3(-4, 0, 0), 4.0));
  ASSERT_EQ(away.outlook_count, 17U);
  for (std::size_t i = 0; i < away.outlook_count; ++i) EXPECT_GT(away.outlook[i].visible_m, 20.0) << i;
  const SpaceProfile& towards =
      profile(Vector3(4, 0, 0), straight(Vector3(-14, 0, 5), Vector3(4, 0, 0), 4.0));
  ASSERT_EQ(towards.outlook_count, 17U);
  for (std::size_t i = 0; i + 1 < towards.outlook_count; ++i) {  // at the last one it stands
    EXPECT_NEAR(towards.outlook[i].visible_m, 17.0 - kRadius_m - 4.0 * towards.outlook[i].time_s, 1.0) << i;
    EXPECT_NEAR(towards.outlook[i].speed_mps, 4.0, 1e-9);
  }
}

TEST_F(SpaceProfilerTest, KeepsTheOutlookBoundedHoweverLongTheTrajectory) {
  const SpaceProfile& p = profile(Vector3(-1, 0, 0), straight(p_WB_, Vector3(-0.1, 0, 0), 300.0));
  EXPECT_LE(p.outlook_count, SpaceProfile::kMaxOutlook);
  EXPECT_GT(p.outlook[p.outlook_count - 1].time_s, 250.0);
}

TEST_F(SpaceProfilerTest, MeasuresGapsAndTheClosestObstacleThatMatters) {
  const Trajectory hold = Trajectory::hold(p_WB_, {});
  EXPECT_EQ(profile(Vector3::Zero(), hold).gap_average_m, kInfinity);
  EXPECT_EQ(profile_.closest_obstacle_m, kInfinity);
  // Two posts 3 m apart, a third 6 m from the second; one out of the height band, one where nobody flies.
  points_ = {{Vector3(8, -1.5, 5)},
             {Vector3(8, 1.5, 5)},
             {Vector3(8, 7.5, 5)},
             {Vector3(8, 4, 8)},
             {Vector3(0, 2, 0.2)}};
  (void)profile(Vector3::Zero(), hold);
  EXPECT_NEAR(profile_.gap_average_m, 6.0, 1e-9) << "the chord of the way round, 9 m, counts too";
  EXPECT_NEAR(profile_.closest_obstacle_m, core::hypot2(8, 1.5), 1e-9);
}

}  // namespace
}  // namespace roborun::stages
