#include "platform/sitl/sensors/lidar_effects.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/executive/frame_table.hpp"
#include "platform/sitl/sensors/lidar.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::sitl {
namespace {

WorldDescription empty() {
  WorldDescription d;
  d.bounds_W = {{-200.0, -200.0, 0.5}, {200.0, 200.0, 100.0}};
  d.start_W = {0.0, 0.0, 50.0};
  d.goal_W = {5.0, 0.0, 50.0};
  return d;
}
World wall_at(double x_m) {
  WorldDescription d = empty();
  d.boxes = {{{x_m, -190.0, 0.0}, {x_m + 1.0, 190.0, 100.0}}};
  return World(d);
}
const Pose kUp{Matrix3::Identity(), Vector3(0.0, 0.0, 50.0)};

/// Echoes of many rays straight ahead, at places that differ.
std::vector<double> echoes(const World& world, const LidarEffects& sut, int rays, double range_m,
                           double yaw_rad = 0.0) {
  std::vector<double> ranges_m;
  core::CounterRng rng(5);
  for (int i = 0; i < rays; ++i) {
    const Pose X_WL{Eigen::AngleAxisd(yaw_rad, Vector3::UnitZ()).toRotationMatrix(),
                    Vector3(0.0, 0.7 * (i % 100) - 35.0, 30.0 + 0.6 * (i / 100 % 60))};
    const Echo echo = sut.measure(world, X_WL, Vector3::UnitX(), range_m, MonotonicTime{}, rng);
    if (echo.there) ranges_m.push_back(echo.range_m);
  }
  return ranges_m;
}

TEST(LidarEffects, RangesHaveTheNoiseOfTheDataSheet) {
  const World world = wall_at(10.0);
  const LidarEffects sut(kMid360, 0.0, 1, 0);
  double squares_m2 = 0.0;
  int near = 0;
  for (const double range_m : echoes(world, sut, 6000, 70.0)) {
    if (std::fabs(range_m - 10.0) > 0.2) continue;
    squares_m2 += (range_m - 10.0) * (range_m - 10.0);
    ++near;
  }
  EXPECT_GT(near, 5900);
  EXPECT_NEAR(std::sqrt(squares_m2 / near), 0.02, 0.001);
}

TEST(LidarEffects, DarkAndObliqueSurfacesAreNotSeenFromAfar) {
  const LidarEffects sut(kMid360, 0.0, 1, 0);
  const auto share = [&](double x_m, double yaw_rad) {
    return static_cast<double>(echoes(wall_at(x_m), sut, 6000, 150.0, yaw_rad).size()) / 6000.0;
  };
  // 10 % at 40 m: what reflects less than 10 % (x / 40 m)^2 of 5 to 80 % is gone.
  EXPECT_GT(share(20.0, 0.0), 0.995);
  EXPECT_NEAR(share(40.0, 0.0), 1.0 - 0.05 / 0.75, 0.02);
  EXPECT_NEAR(share(80.0, 0.0), 1.0 - 0.35 / 0.75, 0.04);
  EXPECT_LT(share(120.0, 0.0), 0.01);
  // At 60 degrees the way is twice as long and half of the light comes back; the second ray sees half of the angles' axes.
  EXPECT_LT(share(40.0, core::kPi / 3.0), share(80.0, 0.0) - 0.1);
}

TEST(LidarEffects, AtEdgesAnEchoStandsBetweenNearSurfacesAndOnOneOfFarOnes) {
  // Slats of 1 mm, 5 mm apart, before a wall: each beam of 10 mm meets both.
  for (const double apart_m : {0.5, 3.0}) {
    WorldDescription d = empty();
    d.boxes = {{{10.0 + apart_m, -190.0, 0.0}, {12.0 + apart_m, 190.0, 100.0}}};
    for (int i = 0; i < 400; ++i) {
      const double y_m = -4.0 + 0.02 * i;
      d.boxes.push_back({{10.0, y_m, 0.0}, {10.001, y_m + 0.01, 100.0}});
    }
    const World world(d);
    const LidarEffects sut(kMid360, 0.0, 1, 0);
    core::CounterRng rng(5);
    int between = 0, front = 0, back = 0;
    for (int i = 0; i < 4000; ++i) {
      const Pose X_WL{Matrix3::Identity(), Vector3(0.0, -3.0 + 0.00137 * i, 30.0)};
      const Echo echo = sut.measure(world, X_WL, Vector3::UnitX(), 70.0, MonotonicTime{}, rng);
      if (!echo.there) continue;
      if (std::fabs(echo.range_m - 10.0) < 0.08)
        ++front;
      else if (std::fabs(echo.range_m - 10.0 - apart_m) < 0.08)
        ++back;
      else if (echo.range_m > 10.0 && echo.range_m < 10.0 + apart_m)
        ++between;
    }
    EXPECT_GT(front, 500);
    EXPECT_GT(back, 500);
    if (apart_m < kMid360.pulse_m) {
      EXPECT_GT(between, 500);
    } else {
      EXPECT_LT(between, 10);
    }
  }
}

TEST(LidarEffects, RainGivesSpecksNearbyAndTakesFarEchoes) {
  const World world = wall_at(60.0);
  const LidarEffects dry(kMid360, 0.0, 1, 0), wet(kMid360, 25.0, 1, 0);
  const auto count = [&](const LidarEffects& sut, double low_m, double high_m) {
    double n = 0.0;
    for (const double range_m : echoes(world, sut, 60000, 150.0))
      n += range_m > low_m && range_m < high_m ? 1.0 : 0.0;
    return n / 60000.0;
  };
  EXPECT_NEAR(count(dry, 0.0, 50.0), 1e-4, 1.5e-4);
  EXPECT_NEAR(count(wet, 0.0, 50.0), 25e-4 + 1e-4, 5e-4);
  EXPECT_NEAR(count(wet, 0.0, 4.0) / count(wet, 0.0, 50.0), 1.0 - std::exp(-1.0), 0.1);
  // 9.3 dB/km over 120 m are 23 % of the light.
  EXPECT_LT(count(wet, 59.0, 61.0), count(dry, 59.0, 61.0) - 0.03);
}

LidarSpec product(LidarModel model) {
  LidarSpec s;
  s.rings = 8;
  s.columns = 180;
  s.lowest_deg = -7.0;
  s.highest_deg = 52.0;
  s.range_min_m = 0.1;
  s.model = model;
  return s;
}

/// The last of some sweeps of a vehicle that flies along x.
std::vector<std::array<float, 3>> sweep_of(SimulatedLidar& sut, double speed_mps, double until_s,
                                           Pose& X_WB) {
  firmware_if::LidarSweep sweep;
  std::vector<std::array<float, 3>> points;
  for (MonotonicTime now{}; seconds(now.time_since_epoch()) < until_s; now += core::kMinorFrame) {
    const Pose at{Matrix3::Identity(),
                  kUp.p_RT + Vector3(speed_mps * seconds(now.time_since_epoch()), 0.0, 0.0)};
    sut.expose(now, at);
    const test::NoAllocScope scope;
    if (sut.read(sweep) != Status::kOk) continue;
    EXPECT_EQ(scope.count(), 0U);
    points.assign(sweep.points_L_m.begin(), sweep.points_L_m.end());
    X_WB.p_RT = kUp.p_RT + Vector3(speed_mps * 0.1 * (sweep.sequence - 1), 0.0, 0.0);
    X_WB.R_RT = Matrix3::Identity();
  }
  return points;
}

TEST(ProductLidar, ASweepHoldsWhatTheDriverLeavesOfTheMotion) {
  const World world = wall_at(30.0);
  const auto mean_error_m = [&](double speed_mps) {
    SimulatedLidar sut(world, product(LidarModel::kRing), {}, {}, 1, 0);
    Pose X_WB;
    double sum_m = 0.0, n = 0.0;
    for (const auto& p : sweep_of(sut, speed_mps, 1.06, X_WB)) {
      const double error_m = X_WB.p_RT.x() + static_cast<double>(p[0]) - 30.0;
      if (std::fabs(error_m) > 0.5 || p[1] > 15.0F || p[1] < -15.0F) continue;
      sum_m += error_m;
      n += 1.0;
    }
    EXPECT_GT(n, 100.0);
    return sum_m / n;
  };
  // The wall ahead is met at the begin and at the end of a turn: on average half a turn of 0.1 s before the stamp, where the
  // sensor was 0.4 m farther away at 8 m/s; 5 % of it is left.
  EXPECT_NEAR(mean_error_m(8.0) - mean_error_m(0.0), 0.05 * 0.4, 0.006);
}

TEST(ProductLidar, TheMid360LooksBetweenTheRaysOfTheSweepBefore) {
  const World world = wall_at(30.0);
  const auto nearest_deg = [&](LidarModel model) {
    SimulatedLidar sut(world, product(model), {}, {0.0, 0.0, 0.0}, 1, 0);
    Pose X_WB;
    const auto first = sweep_of(sut, 0.0, 0.15, X_WB);
    SimulatedLidar again(world, product(model), {}, {0.0, 0.0, 0.0}, 1, 0);
    const auto second = sweep_of(again, 0.0, 0.25, X_WB);
    double sum = 0.0;
    for (std::size_t i = 0; i < second.size(); i += 7) {
      const Vector3 b = Vector3(second[i][0], second[i][1], second[i][2]).normalized();
      double best = -1.0;
      for (const auto& p : first) best = std::max(best, b.dot(Vector3(p[0], p[1], p[2]).normalized()));
      sum += std::acos(std::min(best, 1.0));
    }
    return sum / static_cast<double>((second.size() + 6) / 7) * 180.0 / core::kPi;
  };
  EXPECT_LT(nearest_deg(LidarModel::kRing), 0.1);
  EXPECT_GT(nearest_deg(LidarModel::kMid360), 0.5);
}

TEST(ProductLidar, WhatIsReadDoesNotDependOnWhatWasReadBefore) {
  const World world = wall_at(30.0);
  SimulatedLidar every(world, product(LidarModel::kMid360), {}, {}, 4, 0),
      last(world, product(LidarModel::kMid360), {}, {}, 4, 0);
  Pose X_WB;
  const auto a = sweep_of(every, 5.0, 1.5, X_WB);
  firmware_if::LidarSweep sweep;
  for (MonotonicTime now{}; seconds(now.time_since_epoch()) < 1.5; now += core::kMinorFrame)
    last.expose(now,
                {Matrix3::Identity(), kUp.p_RT + Vector3(5.0 * seconds(now.time_since_epoch()), 0.0, 0.0)});
  ASSERT_EQ(last.read(sweep), Status::kOk);
  EXPECT_EQ(a, std::vector(sweep.points_L_m.begin(), sweep.points_L_m.end()));
  EXPECT_GT(a.size(), 100U);
}

}  // namespace
}  // namespace roborun::sitl
