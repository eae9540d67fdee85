#include "platform/sitl/world/world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::sitl {
namespace {

WorldDescription empty_world() {
  WorldDescription d;
  d.bounds_W = {{-50.0, -50.0, 0.5}, {50.0, 50.0, 15.0}};
  d.start_W = {-40.0, 0.0, 5.0};
  d.goal_W = {40.0, 0.0, 5.0};
  return d;
}

TEST(World, ARayHitsTheFirstOfSeveralObstacles) {
  WorldDescription d = empty_world();
  d.pillars = {{10.0, 0.0, 2.0, 0.0, 20.0}, {30.0, 0.0, 2.0, 0.0, 20.0}};
  d.boxes = {{{20.0, -1.0, 0.0}, {22.0, 1.0, 8.0}}};
  const World world(d);
  EXPECT_NEAR(world.hit_distance_m({0.0, 0.0, 5.0}, Vector3::UnitX(), 100.0), 8.0, 1e-9);
  EXPECT_NEAR(world.hit_distance_m({15.0, 0.0, 5.0}, Vector3::UnitX(), 100.0), 5.0, 1e-9);
  EXPECT_NEAR(world.hit_distance_m({15.0, 0.0, 9.0}, Vector3::UnitX(), 100.0), 13.0, 1e-9) << "over the box";
  EXPECT_NEAR(world.hit_distance_m({0.0, 0.0, 5.0}, -Vector3::UnitZ(), 100.0), 5.0, 1e-9) << "the ground";
  EXPECT_TRUE(std::isinf(world.hit_distance_m({0.0, 0.0, 5.0}, Vector3::UnitY(), 100.0)));
  EXPECT_TRUE(std::isinf(world.hit_distance_m({0.0, 0.0, 5.0}, Vector3::UnitX(), 7.9))) << "out of reach";
}

TEST(VoxelGrid, ClearanceIsThatOfTheNearestOfAllVoxels) {
  const Vector3 min_W(-3.0, 1.0, -2.0);
  constexpr double kCell_m = 0.3;
  VoxelGrid sut(min_W, kCell_m, {37, 20, 11});
  core::CounterRng rng(11);
  std::vector<Vector3> corners;
  for (int i = 0; i < 40; ++i) {
    const std::array<std::int64_t, 3> cell{static_cast<std::int64_t>(rng.below(37)),
                                           static_cast<std::int64_t>(rng.below(20)),
                                           static_cast<std::int64_t>(rng.below(11))};
    sut.fill(cell, 1);
    corners.emplace_back(min_W + kCell_m * Vector3(static_cast<double>(cell[0]), static_cast<double>(cell[1]),
                                                   static_cast<double>(cell[2])));
  }
  int capped = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3 p_W(rng.uniform(-8.0, 12.0), rng.uniform(-3.0, 10.0), rng.uniform(-5.0, 4.0));
    const double cap_m = rng.uniform(0.0, 6.0);
    double least_m = cap_m;
    for (const Vector3& corner : corners)
      least_m = std::min(least_m,
                         (p_W - p_W.cwiseMax(corner).cwiseMin(corner + Vector3::Constant(kCell_m))).norm());
    ASSERT_NEAR(sut.clearance_m(p_W, cap_m), least_m, 1e-12);
    capped += least_m == cap_m ? 1 : 0;
  }
  EXPECT_GT(capped, 300);
  EXPECT_LT(capped, 2700);
  EXPECT_EQ(VoxelGrid(min_W, kCell_m, {4, 4, 4}).clearance_m(Vector3::Zero(), kInfinity), kInfinity);
}

TEST(World, ClearanceIsZeroInsideAndTheDistanceOutside) {
  WorldDescription d = empty_world();
  d.pillars = {{10.0, 0.0, 2.0, 0.0, 20.0}};
  const World world(d);
  EXPECT_EQ(world.clearance_m({10.5, 0.0, 5.0}, 10.0), 0.0);
  EXPECT_NEAR(world.clearance_m({5.0, 0.0, 5.0}, 10.0), 3.0, 1e-9);
  EXPECT_EQ(world.clearance_m({-30.0, 0.0, 5.0}, 10.0), 10.0);
  EXPECT_NEAR(world.clearance_m({10.0, 0.0, 23.0}, 10.0), 3.0, 1e-9) << "above its top";
}

TEST(MovingBody, GoesAlongItsWayPointsAndStaysAtTheLast) {
  Body body{0.5, 0.0, 2.0, 3.0, {{0, 0, 4}, {4, 0, 4}, {4, 6, 4}}};
  const auto at = [&body](double time_s) { return body.center_W(MonotonicTime{from_seconds(time_s)}); };
  EXPECT_EQ(at(0.0), Vector3(0, 0, 4));
  EXPECT_EQ(at(3.0), Vector3(0, 0, 4)) << "it waits until then";
  EXPECT_NEAR((at(4.0) - Vector3(2, 0, 4)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((at(6.0) - Vector3(4, 2, 4)).norm(), 0.0, 1e-9) << "round the corner";
  EXPECT_EQ(at(100.0), Vector3(4, 6, 4));
}

TEST(MovingBody, IsSeenAndMeasuredWhereItIsAtThatInstant) {
  WorldDescription d = empty_world();
  d.bodies = {{1.0, 0.0, 1.0, 0.0, {{10, 0, 5}, {10, 20, 5}}}, {2.0, 4.0, 1.0, 0.0, {{20, 0, 5}}}};
  const World world(d);
  const MonotonicTime begin{};
  const MonotonicTime later{from_seconds(10.0)};
  const Vector3 eye_W(0, 0, 5);
  EXPECT_NEAR(world.hit_distance_m(eye_W, Vector3::UnitX(), 50.0, begin), 9.0, 1e-9) << "the sphere";
  EXPECT_NEAR(world.hit_distance_m(eye_W, Vector3::UnitX(), 50.0, later), 18.0, 1e-9) << "the cylinder";
  EXPECT_TRUE(std::isinf(world.hit_distance_m(eye_W, -Vector3::UnitX(), 50.0, begin))) << "behind";
  EXPECT_TRUE(std::isinf(world.hit_distance_m(eye_W, Vector3::UnitX(), 8.9, begin))) << "out of reach";
  EXPECT_TRUE(std::isinf(world.hit_distance_m(eye_W, Vector3::UnitX(), 50.0))) << "nothing that stands";
  const auto nearest = world.nearest_body({20, 0, 8.5}, 5.0, later);
  ASSERT_TRUE(nearest.has_value());
  EXPECT_NEAR(nearest->distance_m, 1.5, 1e-9) << "over its top";
  EXPECT_NEAR((nearest->core_W - Vector3(20, 0, 7)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(world.nearest_body({10, 7, 5}, 5.0, later)->distance_m, 2.0, 1e-9);
  EXPECT_FALSE(world.nearest_body({10, 0, 5}, 5.0, later).has_value()) << "it went away";
}

TEST(World, TheSearchGridAgreesWithAWalkOverEverything) {
  WorldDescription d = empty_world();
  core::CounterRng rng(5);
  for (int i = 0; i < 40; ++i) {
    d.pillars.push_back(
        {rng.uniform(-45, 45), rng.uniform(-45, 45), rng.uniform(0.3, 3.0), 0.0, rng.uniform(2, 20)});
  }
  const World world(d);
  for (int i = 0; i < 3000; ++i) {
    const Vector3 p_W(rng.uniform(-50, 50), rng.uniform(-50, 50), rng.uniform(0.5, 15));
    double nearest_m = 6.0;
    for (const Pillar& pillar : d.pillars) {
      const double side_m =
          std::max(std::hypot(p_W.x() - pillar.x_m, p_W.y() - pillar.y_m) - pillar.radius_m, 0.0);
      const double up_m = std::max({p_W.z() - pillar.top_m, pillar.bottom_m - p_W.z(), 0.0});
      nearest_m = std::min(nearest_m, std::hypot(side_m, up_m));
    }
    ASSERT_NEAR(world.clearance_m(p_W, 6.0), nearest_m, 1e-9);
    // Along a ray, the first hit is where the clearance is 0 and never before it.
    const Vector3 way = Vector3(rng.normal(), rng.normal(), 0.2 * rng.normal()).normalized();
    const double hit_m = world.hit_distance_m(p_W, way, 60.0);
    if (std::isfinite(hit_m) && nearest_m > 0.0) {
      const Vector3 hit_W = p_W + hit_m * way;
      ASSERT_LT(std::min(world.clearance_m(hit_W, 1.0), std::fabs(hit_W.z())), 1e-6);
      for (double s = 0.05; s < hit_m; s += 0.25) ASSERT_GT(world.clearance_m(p_W + s * way, 1.0), 0.0);
    }
  }
}

TEST(World, RefusesBoundsAndEndsThatMakeNoSense) {
  WorldDescription d = empty_world();
  d.goal_W.x() = 60.0;
  EXPECT_THROW(World{d}, InputError);
  d = empty_world();
  d.bounds_W.max_W.x() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(World{d}, InputError);
  d = empty_world();
  std::swap(d.bounds_W.min_W, d.bounds_W.max_W);
  EXPECT_THROW(World{d}, InputError);
}

TEST(World, CongestionIsBetweenZeroAndOneAndHighestInTheCrowd) {
  WorldDescription d = empty_world();
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k) d.pillars.push_back({25.0 + 5.0 * i, -10.0 + 5.0 * k, 1.0, 0.0, 20.0});
  const World world(d);
  EXPECT_GT(world.congestion_ratio(30.0, 0.0), world.congestion_ratio(-30.0, 0.0));
  EXPECT_LE(world.congestion_ratio(30.0, 0.0), 1.0);
  EXPECT_EQ(world.congestion_ratio(-40.0, 40.0), 0.0);
  // Thin pillars on the corners of cells count as well.
  WorldDescription corner = empty_world();
  corner.pillars = {{30.0, 0.0, 2.0, 0.0, 20.0}};
  EXPECT_GT(World(corner).congestion_ratio(25.0, 5.0), 0.05);
}

}  // namespace
}  // namespace roborun::sitl
