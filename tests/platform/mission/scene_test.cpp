#include "platform/mission/scene.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "platform/report/svg_plot.hpp"

namespace roborun::mission {
namespace {

sitl::WorldDescription empty() {
  sitl::WorldDescription d;
  d.bounds_W = {{-20, -20, 0.5}, {20, 20, 10}};
  d.start_W = {-15, 0, 3};
  d.goal_W = {15, 0, 3};
  return d;
}

/// Area of a polygon, m2; positive if its corners go anticlockwise.
double area_m2(const std::vector<std::array<double, 2>>& corners) {
  double twice = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& a = corners[i];
    const auto& b = corners[(i + 1) % corners.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return 0.5 * twice;
}

TEST(SceneOfAWorld, ABallIsACircle) {
  sitl::WorldDescription d = empty();
  d.balls.push_back({{4, 5, 3}, 1.5});
  const report::Scene scene = scene_of(sitl::World(d), "", 0.0);
  ASSERT_EQ(scene.circles.size(), 1U);
  EXPECT_EQ(scene.circles[0].x_m, 4.0);
  EXPECT_EQ(scene.circles[0].y_m, 5.0);
  EXPECT_EQ(scene.circles[0].radius_m, 1.5);
}

TEST(SceneOfAWorld, ATurnedBoxIsItsOutline) {
  sitl::WorldDescription d = empty();
  Pose X_WS;
  X_WS.p_RT = {3, -2, 4};
  X_WS.R_RT = Eigen::AngleAxisd(std::atan(1.0), Vector3::UnitZ()).toRotationMatrix();
  d.turned.push_back({X_WS, Aabb{{-1, -1, -1}, {1, 1, 1}}});
  const report::Scene scene = scene_of(sitl::World(d), "", 0.0);
  ASSERT_EQ(scene.outlines.size(), 1U);
  EXPECT_NEAR(area_m2(scene.outlines[0]), 4.0, 1e-9);
  for (const auto& [x_m, y_m] : scene.outlines[0])
    EXPECT_NEAR(std::hypot(x_m - 3.0, y_m + 2.0), std::sqrt(2.0), 1e-9) << "every corner of it";
}

TEST(SceneOfAWorld, ALyingCylinderIsItsOutline) {
  sitl::WorldDescription d = empty();
  Pose X_WS;
  X_WS.p_RT = {0, 0, 5};
  X_WS.R_RT =
      Eigen::AngleAxisd(2.0 * std::atan(1.0), Vector3::UnitY()).toRotationMatrix();  // its axis along x
  d.turned.push_back({X_WS, sitl::Pillar{0, 0, 0.5, -4, 4}});
  const report::Scene scene = scene_of(sitl::World(d), "", 0.0);
  ASSERT_EQ(scene.outlines.size(), 1U);
  EXPECT_NEAR(area_m2(scene.outlines[0]), 8.0 * 1.0, 1e-6);
  X_WS.R_RT.setIdentity();
  d.turned[0].X_WS = X_WS;
  EXPECT_NEAR(area_m2(scene_of(sitl::World(d), "", 0.0).outlines[0]), 4.0 * std::atan(1.0) * 0.25, 0.01)
      << "upright: a circle";
}

TEST(SceneOfAWorld, TrianglesAreCutAtTheHeightOfTheStart) {
  sitl::WorldDescription d = empty();
  // A wall at x = 5 from y = -10 to 10 up to 8 m, a beam at 9 m, and a floor.
  const auto quad = [](const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& e) {
    return std::vector<sitl::Triangle>{{a, b, c}, {a, c, e}};
  };
  std::vector<sitl::Triangle> triangles = quad({5, -10, 0}, {5, 10, 0}, {5, 10, 8}, {5, -10, 8});
  for (const double z_m : {0.0, 9.0}) {
    const auto flat = quad({-9, -9, z_m}, {-7, -9, z_m}, {-7, 9, z_m}, {-9, 9, z_m});
    triangles.insert(triangles.end(), flat.begin(), flat.end());
  }
  d.mesh = sitl::TriangleMesh(triangles);
  const report::Scene scene = scene_of(sitl::World(d), "", 0.0);
  ASSERT_FALSE(scene.rects.empty());
  double length_m = 0.0;
  for (const report::Scene::Rect& r : scene.rects) {
    EXPECT_LT(std::fabs(r.x_m + 0.5 * r.width_m - 5.0), 0.2) << "only the wall is at 3 m";
    length_m += r.height_m;
  }
  EXPECT_NEAR(length_m, 20.0, 0.4) << "and all of it";
}

TEST(SceneOfAWorld, EveryOutlineIsDrawn) {
  sitl::WorldDescription d = empty();
  d.turned.push_back({Pose{}, Aabb{{-1, -1, 0}, {1, 1, 2}}});
  const std::vector<report::MissionReport> missions(1);
  const std::string svg =
      report::mission_svg(scene_of(sitl::World(d), "", 0.0), missions, report::PathColour::kSpeed);
  EXPECT_NE(svg.find("<polygon points="), std::string::npos);
}

}  // namespace
}  // namespace roborun::mission
