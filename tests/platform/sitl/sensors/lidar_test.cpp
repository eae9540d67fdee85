#include "platform/sitl/sensors/lidar.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "core/executive/frame_table.hpp"
#include "platform/input/input_error.hpp"
#include "tests/platform/sitl/sensors/one_wall.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::sitl {
namespace {

LidarSpec spec() {
  LidarSpec s;
  s.rings = 5;
  s.columns = 90;
  s.lowest_deg = -20.0;
  s.highest_deg = 20.0;
  s.range_m = 30.0;
  return s;
}
constexpr LidarNoise kExact{0.0, 0.0, 0.0};

/// The sweep at `time_s`, with what came before it read or not.
Status sweep_at(SimulatedLidar& lidar, double time_s, firmware_if::LidarSweep& sweep, bool read_all = false) {
  Status status = Status::kNotReady;
  for (MonotonicTime now{}; seconds(now.time_since_epoch()) < time_s; now += core::kMinorFrame) {
    lidar.expose(now, kAt5m);
    if (read_all) status = lidar.read(sweep);
  }
  return read_all ? status : lidar.read(sweep);
}

TEST(SimulatedLidar, PointsStandOnTheWallAndOnTheGround) {
  const World world = one_wall();
  SimulatedLidar sut(world, spec(), {}, kExact, 1, 0);
  firmware_if::LidarSweep sweep;
  EXPECT_EQ(sut.read(sweep), Status::kNotReady) << "before the first one";
  ASSERT_EQ(sweep_at(sut, 0.2, sweep), Status::kOk);
  EXPECT_EQ(sweep.points_L_m.size(), 450U);
  EXPECT_EQ(sweep.range_m, 30.0F);
  int wall = 0, ground = 0, nothing = 0;
  for (const auto& p : sweep.points_L_m) {
    const double range_m = std::hypot(p[0], p[1], p[2]);
    if (range_m >= 30.0) {
      ++nothing;
    } else if (std::fabs(p[0] - 10.0F) < 1e-3F) {
      ++wall;
    } else {
      EXPECT_NEAR(p[2], -5.0, 1e-3);
      ++ground;
    }
  }
  EXPECT_GT(wall, 50);
  EXPECT_GT(ground, 20);
  EXPECT_GT(nothing, 100);
  EXPECT_EQ(sut.read(sweep), Status::kNotReady) << "never the same sweep twice";
}

TEST(SimulatedLidar, WhatIsReadDoesNotDependOnWhatWasReadBefore) {
  const World world = one_wall();
  const LidarNoise noise{0.02, 0.1, 0.2};
  SimulatedLidar every(world, spec(), {}, noise, 4, 0), last(world, spec(), {}, noise, 4, 0),
      other(world, spec(), {}, noise, 4, 1);
  firmware_if::LidarSweep a, b, c;
  ASSERT_EQ(sweep_at(last, 1.93, b), Status::kOk);
  (void)sweep_at(every, 1.93, a, true);
  const std::vector<std::array<float, 3>> all(a.points_L_m.begin(), a.points_L_m.end());
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(all, std::vector(b.points_L_m.begin(), b.points_L_m.end()));
  ASSERT_EQ(sweep_at(other, 1.93, c), Status::kOk);
  EXPECT_NE(all, std::vector(c.points_L_m.begin(), c.points_L_m.end())) << "another sensor, another noise";
  EXPECT_LT(all.size(), 450U * 95 / 100) << "a tenth of the rays is lost";
  EXPECT_GT(all.size(), 450U * 80 / 100);
}

TEST(SimulatedLidar, LosesTheShareOfSweepsThatItIsTold) {
  const World world = one_wall();
  SimulatedLidar sut(world, spec(), {}, {0.0, 0.0, 0.25}, 7, 0);
  firmware_if::LidarSweep sweep;
  int got = 0;
  for (MonotonicTime now{}; seconds(now.time_since_epoch()) < 60.0; now += core::kMinorFrame) {
    sut.expose(now, kAt5m);
    got += sut.read(sweep) == Status::kOk ? 1 : 0;
  }
  EXPECT_NEAR(got, 450, 45);
}

TEST(LidarPattern, IsReadLineByLine) {
  const std::string path = test::scratch("pattern.txt");
  const auto write = [&](const std::string& text) { std::ofstream(path) << text; };
  std::string rays = "# azimuth elevation\n\n";
  for (int i = 0; i < 40; ++i) rays += std::to_string(9 * i) + " " + std::to_string(i - 10) + ".5 # ray\n";
  write(rays);
  const std::vector<LidarRay> pattern = load_lidar_pattern(path);
  ASSERT_EQ(pattern.size(), 40U);
  EXPECT_EQ(pattern[3].azimuth_deg, 27.0);
  EXPECT_EQ(pattern[3].elevation_deg, -7.5);
  const LidarSpec s = spec_of(pattern, spec());
  EXPECT_EQ(s.lowest_deg, -10.5);
  EXPECT_EQ(s.highest_deg, 29.5);
  const World world = one_wall();
  SimulatedLidar sut(world, s, pattern, kExact, 1, 0);
  EXPECT_EQ(sut.rays(), 40U);
  const auto refusal = [&](const std::string& text) -> std::string {
    write(text);
    try {
      (void)load_lidar_pattern(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_NE(refusal("1 2\n1 x\n").find(":2: must be two numbers"), std::string::npos);
  EXPECT_NE(refusal("1 2 3\n").find(":1: must be two numbers"), std::string::npos);
  EXPECT_NE(refusal("1 91\n").find("elevation_deg from -90 to 90"), std::string::npos);
  EXPECT_NE(refusal("nan 1\n").find(":1:"), std::string::npos);
  EXPECT_NE(refusal("").find("at least 16 rays"), std::string::npos);
  EXPECT_THROW((void)load_lidar_pattern(test::scratch("not_there.txt")), InputError);
}

}  // namespace
}  // namespace roborun::sitl
