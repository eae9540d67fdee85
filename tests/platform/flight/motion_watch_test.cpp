#include "platform/flight/motion_watch.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/boxes_map.hpp"

namespace roborun::flight {
namespace {

/// All is known to be free but a wall from y = 2 on.
struct Scene {
  test::BoxesMap map;
  MotionWatch watch;
  MotionWatch::Input in{.now = MonotonicTime{std::chrono::seconds{1}},
                        .relevant_W = {Vector3(-50, -50, -50), Vector3(50, 50, 50)},
                        .error = {.constant_m = 0.01, .quadratic_per_m = 0.0}};
  std::vector<stages::CloudPoint> points;
  core::Work work;

  Scene() {
    map.box.free_W = {Vector3(-60, -60, -60), Vector3(60, 60, 60)};
    map.box.occupied.push_back({Vector3(-60, 2, -60), Vector3(60, 60, 60)});
  }
  void see(const Vector3& p_W) { points.push_back({p_W, 1}); }
  std::size_t appeared() {
    core::UnlimitedBudget unlimited;
    watch.sense(in, points, map, unlimited, work);
    return watch.appeared_W().size();
  }
};

TEST(MotionWatch, SeesAnUprightBodyByOnePixelAboveTheOther) {
  Scene scene;
  for (const double z_m : {2.0, 2.45, 2.9}) scene.see(Vector3(10, 0, z_m));
  EXPECT_EQ(scene.appeared(), 1U);
}

TEST(MotionWatch, TakesPointsHereAndThereForNoBody) {
  Scene scene;
  for (const double y_m : {-1.6, -0.8, 0.0}) scene.see(Vector3(10, y_m, 2.0));
  for (const double z_m : {-2.0, 6.0}) scene.see(Vector3(10, 0, z_m));
  EXPECT_EQ(scene.appeared(), 0U);
}

TEST(MotionWatch, TakesForNoiseWhatTheDepthsMayBeWrongBy) {
  for (const double error_m : {0.01, 0.05}) {
    Scene scene;
    scene.in.error.constant_m = error_m;
    for (const double z_m : {2.0, 2.2, 2.4}) scene.see(Vector3(10, 1.85, z_m));
    EXPECT_EQ(scene.appeared(), error_m < 0.03 ? 1U : 0U) << error_m;
  }
}

TEST(MotionWatch, TakesForNoiseWhatAPixelIsWide) {
  for (const double angle_rad : {0.0, 0.01}) {
    Scene scene;
    scene.in.error.angle_rad = angle_rad;
    for (const double z_m : {2.0, 2.2, 2.4}) scene.see(Vector3(10, 1.85, z_m));
    EXPECT_EQ(scene.appeared(), angle_rad == 0.0 ? 1U : 0U) << angle_rad;
  }
}

TEST(MotionWatch, AsksTheImagesBeforeAboutWhatTheMapDoesNotKnowToBeFree) {
  Scene scene;
  // Inside what the map calls a wall.
  for (const double z_m : {2.0, 2.2, 2.4}) scene.see(Vector3(10, 3, z_m));
  EXPECT_EQ(scene.appeared(), 0U);
  scene.map.through = 0b011;
  EXPECT_EQ(scene.appeared(), 0U) << "two points are no body";
  scene.map.through = 0b111;
  EXPECT_EQ(scene.appeared(), 1U);
}

TEST(MotionWatch, IsStartledByWhatAppearsNearAheadAlone) {
  for (const double x_m : {5.0, 7.0, -5.0}) {
    Scene scene;
    scene.in.v_WB = Vector3(2, 0, 0);
    for (const double z_m : {0.0, 0.2, 0.4}) scene.see(Vector3(x_m, 0, z_m));
    EXPECT_EQ(scene.appeared(), 1U);
    EXPECT_EQ(scene.watch.startled(scene.in.now + from_seconds(2.9)), x_m == 5.0) << x_m;
    EXPECT_FALSE(scene.watch.startled(scene.in.now + from_seconds(3.1)));
  }
}

TEST(MotionWatch, IsStartledFartherAwayByAsMuchAsItNeedsToStop) {
  for (const double x_m : {9.2, 9.5}) {
    Scene scene;
    scene.in.v_WB = Vector3(5, 0, 0);
    scene.in.stop_m = 5.2;  // takes 2.08 s, in which a body comes 4.16 m
    for (const double z_m : {0.0, 0.2, 0.4}) scene.see(Vector3(x_m, 0, z_m));
    EXPECT_EQ(scene.appeared(), 1U);
    EXPECT_EQ(scene.watch.startled(scene.in.now + from_seconds(1.0)), x_m == 9.2) << x_m;
  }
}

TEST(MotionWatch, AsksAboutAllPointsOfACloud) {
  Scene scene;
  for (int i = 0; i < 200; ++i) scene.see(Vector3(10, 3 + 0.001 * i, 2.0));
  scene.map.through = 0b111;  // of each question
  EXPECT_EQ(scene.appeared(), 1U);
  EXPECT_GE(scene.work.units, 200U);
}

}  // namespace
}  // namespace roborun::flight
