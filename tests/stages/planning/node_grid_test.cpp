#include "stages/planning/node_grid.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "core/random/counter_rng.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

TEST(NodeGrid, FindsWhatALinearSearchFindsAlsoOutsideItsBox) {
  std::vector<std::byte> block(NodeGrid::arena_bytes(2000));
  core::Arena arena(block);
  NodeGrid sut(2000, arena);
  ASSERT_FALSE(arena.exhausted());
  core::CounterRng rng(3);
  for (const double half_m : {4.0, 30.0, 400.0}) {
    sut.reset({Vector3::Constant(-half_m), Vector3::Constant(half_m)});
    std::vector<Vector3> points;
    const auto draw = [&]() -> Vector3 {
      return 1.3 * half_m * Vector3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    };
    for (int n = 0; n < 1500; ++n) {
      points.push_back(draw());
      sut.insert(points.back());
      if (n % 7 != 0) continue;
      const Vector3 p = draw();
      std::vector<double> distance;
      const double radius_m = 0.4 * half_m;
      double nearest_m = 1e300;
      for (const Vector3& q : points) {
        nearest_m = std::min(nearest_m, (q - p).norm());
        if ((q - p).norm() <= radius_m) distance.push_back((q - p).norm());
      }
      std::sort(distance.begin(), distance.end());
      ASSERT_DOUBLE_EQ(sut.nearest(p).distance_m, nearest_m);
      std::array<NodeGrid::Near, 8> found{};
      const std::size_t count = sut.within(p, radius_m, found);
      ASSERT_EQ(count, std::min<std::size_t>(distance.size(), 8));
      for (std::size_t i = 0; i < count; ++i) ASSERT_DOUBLE_EQ(found[i].distance_m, distance[i]);
    }
  }
}

TEST(NodeGrid, DoesNotAllocate) {
  std::vector<std::byte> block(NodeGrid::arena_bytes(200));
  core::Arena arena(block);
  NodeGrid sut(200, arena);
  const test::NoAllocScope scope;
  sut.reset({Vector3::Constant(-9.0), Vector3::Constant(9.0)});
  for (int n = 0; n < 150; ++n) sut.insert(Vector3(0.1 * n - 7.0, 0.0, 0.0));
  EXPECT_EQ(sut.nearest(Vector3::Zero()).index, 70);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::stages
