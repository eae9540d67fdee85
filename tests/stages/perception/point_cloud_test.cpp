// What is left out of a cloud because nobody asks for it changes nothing of what somebody asks for.
#include "stages/perception/point_cloud.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "stages/perception/space_profiler.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;

struct Fixture {
  static constexpr PointCloud::Config kLarge{.max_points = 262144};
  Fixture()
      : block(2 * PointCloud::arena_bytes(kLarge)), arena(block), all(kLarge, arena), some(kLarge, arena) {}
  /// Both clouds of the same images: with all points, and with those that are needed.
  void look(const test::Scene& at_scene, const Vector3& p_W, const CloudNeed& need, int pixels) {
    test::Scene scene = at_scene;
    const auto frames = scene.look(p_W, pixels, 40.0F);
    core::UnlimitedBudget unlimited;
    core::Work work;
    ASSERT_EQ(all.step(frames, 0, unlimited, work), Status::kOk);
    const std::uint64_t units = work.units;
    ASSERT_EQ(some.step(frames, 0, need, unlimited, work), Status::kOk);
    EXPECT_EQ(work.units, units);
    EXPECT_EQ(some.seen_volume_m3(), all.seen_volume_m3());
  }
  std::vector<std::byte> block;
  core::Arena arena;
  PointCloud all, some;
};

/// A floor, a roof and boxes of up to 3 m, none nearer to the middle than `room_m`.
test::Scene scene_of(std::uint64_t seed, double room_m) {
  core::CounterRng rng(seed, 1);
  test::Scene scene;
  scene.solid = {{Vector3(-60, -60, -1), Vector3(60, 60, 0)}, {Vector3(-60, -60, 14), Vector3(60, 60, 15)}};
  while (scene.solid.size() < 40) {
    const Vector3 p(60.0 * rng.uniform() - 30.0, 60.0 * rng.uniform() - 30.0, 14.0 * rng.uniform());
    const Vector3 half(0.1 + rng.uniform(), 0.1 + rng.uniform(), 0.1 + 3.0 * rng.uniform());
    if (p.head<2>().norm() > room_m + 1.6) scene.solid.push_back({p - half, p + half});
  }
  return scene;
}

SpaceProfile profile_of(const PointCloud& cloud, const Vector3& p_WB, const Aabb& relevant_W) {
  const test::BoxView view;
  SpaceProfile profile;
  core::UnlimitedBudget unlimited;
  core::Work work;
  EXPECT_EQ(profile_space({}, cloud.points(), view, Trajectory::hold(p_WB, {}), {}, p_WB, Vector3::Zero(),
                          Vector3(50, 0, 5), relevant_W, 0.6, profile, unlimited, work),
            Status::kOk);
  return profile;
}

TEST(PointCloud, WhatIsNotNeededChangesNoProfile) {
  Fixture f;
  const Aabb relevant_W{Vector3(-25, -25, 0.9), Vector3(25, 25, 8.6)};
  std::size_t points = 0, needed = 0, with_gap = 0, far = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Vector3 p_WB(0.3 * static_cast<double>(seed % 5), 0.1, 2.0 + 0.1 * static_cast<double>(seed));
    f.look(scene_of(seed, seed % 2 == 0 ? 3.0 : 17.0), p_WB, needed_points({}, p_WB, relevant_W), 64);
    const SpaceProfile all = profile_of(f.all, p_WB, relevant_W), some = profile_of(f.some, p_WB, relevant_W);
    EXPECT_EQ(all.closest_obstacle_m, some.closest_obstacle_m) << seed;
    EXPECT_EQ(all.gap_average_m, some.gap_average_m) << seed;
    points += f.all.points().size();
    needed += f.some.points().size();
    with_gap += all.gap_average_m < kInfinity ? 1U : 0U;
    far += all.closest_obstacle_m > 16.0 && all.closest_obstacle_m < kInfinity ? 1U : 0U;
  }
  EXPECT_GT(with_gap, 10U);
  EXPECT_GT(far, 10U) << "the nearest point is beyond the reach";
  EXPECT_LT(2 * needed, points);
}

TEST(PointCloud, NeededPointsAreThereInTheSameOrderWithAllTheirPixels) {
  Fixture f;
  std::size_t compared = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Vector3 p_WB(0.07 * static_cast<double>(seed), -0.2, 4.0);
    const CloudNeed need{p_WB, 12.0, 1.0, 7.0, {Vector3(-10, -9, 1.5), Vector3(10, 9, 7)}};
    f.look(scene_of(seed, 2.0), p_WB, need, 192);  // several pixels a cell at the end of the reach
    const auto is_needed = [&](const CloudPoint& p) {
      return (p.p_W - p_WB).norm() < need.reach_m && p.p_W.z() > need.low_m && p.p_W.z() < need.high_m;
    };
    const auto of = [&](const PointCloud& cloud) {
      std::vector<CloudPoint> points;
      std::copy_if(cloud.points().begin(), cloud.points().end(), std::back_inserter(points), is_needed);
      return points;
    };
    const std::vector<CloudPoint> all = of(f.all), some = of(f.some);
    ASSERT_EQ(all.size(), some.size()) << seed;
    compared += all.size();
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_EQ(all[i].p_W, some[i].p_W);
      EXPECT_EQ(all[i].count, some[i].count);
    }
  }
  EXPECT_GT(compared, 1000U);
}

/// A wall at 2 m to the left of the middle before one at 9 m, and along its rim pixels between both, of one row in three.
class RimOfAWall : public ::testing::Test {
 protected:
  RimOfAWall() : depth_m_(static_cast<std::size_t>(kSide) * kSide, 9.0F) {
    for (std::size_t v = 0; v < kSide; ++v) {
      std::fill_n(depth_m_.begin() + static_cast<std::ptrdiff_t>(v * kSide), kSide / 2, 2.0F);
      if (v % 3 == 1) depth_m_[v * kSide + kSide / 2] = 5.0F;
    }
  }
  /// Points that are on neither wall, of a camera that mixes or does not.
  std::size_t between(bool mixes) {
    PosedDepthFrame posed;
    posed.frame.depth_m = depth_m_;
    posed.frame.width = posed.frame.height = kSide;
    posed.frame.tan_half_width = posed.frame.tan_half_height = 1.0F;
    posed.frame.range_m = 20.0F;
    posed.error.mixes = mixes;
    core::UnlimitedBudget unlimited;
    core::Work work;
    EXPECT_EQ(f_.all.step({&posed, 1}, 0, unlimited, work), Status::kOk);
    return static_cast<std::size_t>(
        std::count_if(f_.all.points().begin(), f_.all.points().end(),
                      [](const CloudPoint& p) { return p.p_W.x() > 3.0 && p.p_W.x() < 8.0; }));
  }

 private:
  static constexpr std::uint16_t kSide = 64;
  Fixture f_;
  std::vector<float> depth_m_;
};

TEST_F(RimOfAWall, PixelsBetweenTwoDepthsAreNoPoints) {
  EXPECT_GT(between(false), 5U) << "of a camera that does not mix they are there";
  EXPECT_EQ(between(true), 0U);
}

}  // namespace
}  // namespace roborun::stages
