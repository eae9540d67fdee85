#include "platform/sitl/sensors/depth_camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/executive/frame_table.hpp"
#include "core/geometry/camera_pose.hpp"
#include "tests/platform/sitl/sensors/one_wall.hpp"

namespace roborun::sitl {
namespace {

DepthCameraConfig exact() {
  DepthCameraConfig c;
  c.pixels = 16;
  c.noise_m = 0.0;
  c.noise_per_m = 0.0;
  c.pixel_dropout_ratio = 0.0;
  c.frame_dropout_ratio = 0.0;
  return c;
}

TEST(DepthCamera, SeesAWallAtItsDepthAlongTheOpticalAxis) {
  const World world = one_wall();
  SimulatedDepthCamera camera(world, exact(), six_camera_mounts()[0], 1, 0);
  camera.expose(MonotonicTime{}, kAt5m);
  camera.expose(MonotonicTime{} + Nanos{30'000'000}, kAt5m);
  firmware_if::DepthFrame frame;
  ASSERT_EQ(camera.read(frame), Status::kOk);
  EXPECT_EQ(frame.stamp, MonotonicTime{});
  for (std::size_t v = 0; v < 16; ++v) {
    for (std::size_t u = 0; u < 16; ++u) {
      // The wall, or the ground where the ray meets that first.
      const double down = (2.0 * (static_cast<double>(v) + 0.5) / 16.0) - 1.0;
      const double wanted = down > 0.5 ? 5.0 / down : 10.0;
      const float depth_m = frame.depth_m[v * 16 + u];
      ASSERT_NEAR(depth_m, std::round(1000.0 * wanted) * 0.001, 1e-4) << u << " " << v;
      ASSERT_EQ(depth_m, std::round(1000.0F * depth_m) * 0.001F) << "whole millimetres";
    }
  }
}

TEST(DepthCamera, GivesTheNewestFrameThatHasArrivedAndNoneTwice) {
  const World world = one_wall();
  DepthCameraConfig config = exact();
  config.latency_s = 0.030;
  SimulatedDepthCamera camera(world, config, six_camera_mounts()[0], 1, 0);
  firmware_if::DepthFrame frame;
  EXPECT_EQ(camera.read(frame), Status::kNotReady);
  MonotonicTime now{};
  for (int k = 0; k <= 52; ++k, now += core::kMinorFrame)
    camera.expose(now, kAt5m);  // exposures at 0, 50 and 100 ms
  ASSERT_EQ(camera.read(frame), Status::kOk);
  EXPECT_EQ(frame.stamp, MonotonicTime{} + Nanos{100'000'000});
  EXPECT_EQ(camera.read(frame), Status::kNotReady);
}

TEST(DepthCamera, NoiseGrowsWithDepthAndDropoutsAreNan) {
  const World world = one_wall();
  DepthCameraConfig config;
  config.pixels = 128;
  config.frame_dropout_ratio = 0.0;
  config.pixel_dropout_ratio = 0.02;
  SimulatedDepthCamera camera(world, config, six_camera_mounts()[0], 1, 0);
  camera.expose(MonotonicTime{}, kAt5m);
  camera.expose(MonotonicTime{} + Nanos{30'000'000}, kAt5m);
  firmware_if::DepthFrame frame;
  ASSERT_EQ(camera.read(frame), Status::kOk);
  double sum_squares = 0.0;
  int count = 0;
  int lost = 0;
  for (std::size_t i = 0; i < 128U * 60U; ++i) {  // rows above the horizon: the wall only
    if (std::isnan(frame.depth_m[i])) {
      ++lost;
      continue;
    }
    const double e = static_cast<double>(frame.depth_m[i]) - 10.0;
    sum_squares += e * e;
    ++count;
  }
  EXPECT_NEAR(std::sqrt(sum_squares / count), config.noise_m + config.noise_per_m * 100.0, 0.004);
  EXPECT_NEAR(lost / (128.0 * 60.0), 0.02, 0.006);
}

TEST(DepthCamera, WhatIsReadDoesNotDependOnWhatWasReadBefore) {
  const World world = one_wall();
  SimulatedDepthCamera every(world, {}, six_camera_mounts()[0], 4, 0);
  SimulatedDepthCamera last(world, {}, six_camera_mounts()[0], 4, 0);
  firmware_if::DepthFrame a;
  firmware_if::DepthFrame b;
  MonotonicTime now{};
  for (int k = 0; k < 400; ++k, now += core::kMinorFrame) {
    every.expose(now, kAt5m);
    last.expose(now, kAt5m);
    (void)every.read(a);
  }
  ASSERT_EQ(last.read(b), Status::kOk);
  ASSERT_EQ(a.sequence, b.sequence);
  for (std::size_t i = 0; i < a.depth_m.size(); ++i)
    ASSERT_TRUE(a.depth_m[i] == b.depth_m[i] || (std::isnan(a.depth_m[i]) && std::isnan(b.depth_m[i])));
}

TEST(DepthCamera, LosesTheShareOfFramesThatItIsTold) {
  const World world = one_wall();
  DepthCameraConfig config = exact();
  config.pixels = 8;
  config.latency_s = 0.0;
  config.frame_dropout_ratio = 0.2;
  SimulatedDepthCamera camera(world, config, six_camera_mounts()[0], 1, 0);
  firmware_if::DepthFrame frame;
  int got = 0;
  for (int k = 0; k < 2000; ++k) {
    camera.expose(MonotonicTime{} + k * Nanos{50'000'000}, kAt5m);
    got += camera.read(frame) == Status::kOk ? 1 : 0;
  }
  EXPECT_NEAR(got / 2000.0, 0.8, 0.03);
}

TEST(DepthCamera, HasOpticsOfItsOwn) {
  const World world = one_wall();
  CameraSpec spec = exact().spec();
  spec.width = 32;
  spec.height = 12;
  spec.tan_half_width = 1.2;
  spec.tan_half_height = 0.3;
  spec.range_min_m = 9.0;
  for (const double range_min_m : {9.0, 10.5}) {
    spec.range_min_m = range_min_m;
    SimulatedDepthCamera camera(world, spec, six_camera_mounts()[0], exact(), 1, 0);
    firmware_if::DepthFrame frame;
    for (MonotonicTime now{}; now < MonotonicTime{Nanos{100'000'000}}; now += core::kMinorFrame)
      camera.expose(now, kAt5m);
    ASSERT_EQ(camera.read(frame), Status::kOk);
    EXPECT_EQ(frame.width, 32);
    EXPECT_EQ(frame.height, 12);
    EXPECT_EQ(frame.tan_half_width, 1.2F);
    EXPECT_EQ(frame.tan_half_height, 0.3F);
    EXPECT_EQ(frame.range_min_m, static_cast<float>(range_min_m));
    ASSERT_EQ(frame.depth_m.size(), 32U * 12U);
    for (const float depth_m : frame.depth_m) {
      if (range_min_m < 10.0) {
        EXPECT_NEAR(depth_m, 10.0, 1e-4) << "the wall, in the whole image";
      } else {
        EXPECT_TRUE(std::isnan(depth_m)) << "too near";
      }
    }
  }
}

TEST(DepthCamera, TheRigOfSixStandsWhereTheirMountsSay) {
  const SensorRig rig = six_cameras(96, 25.0);
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    EXPECT_EQ(camera_mount(rig.cameras[i].mount).R_BC, six_camera_mounts()[i].R_BC);
}

TEST(DepthCamera, SixCamerasSeeTheWholeSphere) {
  for (double a = 0.0; a < 6.28; a += 0.1) {
    for (double b = -1.5; b < 1.5; b += 0.1) {
      const Vector3 way(std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b));
      int seen = 0;
      for (const auto& mount : six_camera_mounts()) {
        const Matrix3 R_BC = core::camera_pose({}, mount).R_RT;
        EXPECT_NEAR(R_BC.determinant(), 1.0, 1e-12) << "a rotation";
        const Vector3 way_C = R_BC.transpose() * way;
        seen += way_C.x() > 0 && std::max(std::fabs(way_C.y()), std::fabs(way_C.z())) <= way_C.x() + 1e-12
                    ? 1
                    : 0;
      }
      ASSERT_GE(seen, 1);
    }
  }
}

}  // namespace
}  // namespace roborun::sitl
