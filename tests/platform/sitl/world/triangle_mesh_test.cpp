#include "platform/sitl/world/triangle_mesh.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random/counter_rng.hpp"
#include "platform/sitl/world/mesh_file.hpp"
#include "platform/sitl/world/voxel_grid.hpp"

namespace roborun::sitl {
namespace {

Vector3 random_point(core::CounterRng& rng, double half_m) {
  return {rng.uniform(-half_m, half_m), rng.uniform(-half_m, half_m), rng.uniform(-half_m, half_m)};
}

TEST(TriangleMesh, TreeAndEachTriangleByItselfAgree) {
  core::CounterRng rng(7);
  std::vector<Triangle> triangles;
  std::vector<TriangleMesh> single;
  for (int i = 0; i < 300; ++i) {
    const Vector3 at = random_point(rng, 10.0);
    triangles.push_back({at, at + random_point(rng, 1.0), at + random_point(rng, 1.0)});
    single.emplace_back(std::vector<Triangle>{triangles.back()});
  }
  const TriangleMesh sut(triangles);
  ASSERT_EQ(sut.triangles().size(), 300U);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3 from = random_point(rng, 12.0);
    const Vector3 direction = random_point(rng, 1.0).normalized();
    double hit_m = kInfinity;
    double clear_m = 5.0;
    for (const TriangleMesh& one : single) {
      hit_m = std::min(hit_m, one.hit_distance_m(from, direction, 30.0));
      clear_m = std::min(clear_m, one.clearance_m(from, 5.0));
    }
    ASSERT_EQ(sut.hit_distance_m(from, direction, 30.0), hit_m);
    ASSERT_EQ(sut.clearance_m(from, 5.0), clear_m);
    hits += hit_m < kInfinity ? 1 : 0;
  }
  EXPECT_GT(hits, 50);
}

TEST(TriangleMesh, DistanceIsThatOfADenseSampling) {
  core::CounterRng rng(9);
  for (int i = 0; i < 200; ++i) {
    const Triangle t{random_point(rng, 2.0), random_point(rng, 2.0), random_point(rng, 2.0)};
    const Vector3 p = random_point(rng, 3.0);
    double least_m = kInfinity;
    for (int a = 0; a <= 60; ++a)
      for (int b = 0; a + b <= 60; ++b)
        least_m = std::min(least_m, (t[0] + a / 60.0 * (t[1] - t[0]) + b / 60.0 * (t[2] - t[0]) - p).norm());
    const double sut_m = std::sqrt(squared_distance_m2(t, p));
    EXPECT_LE(sut_m, least_m + 1e-9);
    EXPECT_GE(sut_m, least_m - 0.12);  // half a step of the sampling
  }
}

TEST(TriangleMesh, NoRayGetsThroughAnEdgeBetweenTwo) {
  const TriangleMesh sut({{Vector3(0, -1, -1), Vector3(0, 1, -1), Vector3(0, 1, 1)},
                          {Vector3(0, -1, -1), Vector3(0, 1, 1), Vector3(0, -1, 1)}});
  core::CounterRng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const double s = rng.uniform(-0.99, 0.99);
    const Vector3 from = Vector3(-3, 0, 0) + random_point(rng, 1.0);
    const Vector3 direction = (Vector3(0, s, s) - from).normalized();
    ASSERT_NEAR(sut.hit_distance_m(from, direction, 10.0), (Vector3(0, s, s) - from).norm(), 1e-6);
  }
}

TEST(TriangleMesh, TrianglesWithoutAreaAreDropped) {
  const TriangleMesh sut({{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(2, 0, 0)},
                          {Vector3(1, 1, 1), Vector3(1, 1, 1), Vector3(1, 1, 1)}});
  EXPECT_TRUE(sut.empty());
  EXPECT_EQ(sut.clearance_m(Vector3::Zero(), 2.0), 2.0);
  EXPECT_EQ(sut.hit_distance_m(Vector3::Zero(), Vector3::UnitX(), 9.0), kInfinity);
}

TEST(OpenEdges, AreCountedWhereNoOtherTriangleIs) {
  const Vector3 a(0, 0, 0);
  const Vector3 b(1, 0, 0);
  const Vector3 c(0, 1, 0);
  const Vector3 d(0, 0, 1);
  EXPECT_EQ(open_edges({{a, b, c}}), 3U);
  EXPECT_EQ(open_edges({{a, b, c}, {a, b, d}, {b, c, d}}), 3U);
  EXPECT_EQ(open_edges({{a, b, c}, {a, b, d}, {b, c, d}, {c, a, d}}), 0U);
}

}  // namespace
}  // namespace roborun::sitl
