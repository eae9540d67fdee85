#include "platform/sitl/sensors/visual_odometry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/executive/frame_table.hpp"

namespace roborun::sitl {
namespace {

/// Straight to the east at 5 m/s; every sample that came.
std::vector<firmware_if::OdometrySample> fly(std::uint64_t seed, double for_s) {
  VisualOdometry sensor(OdometryModel::kVio, seed);
  std::vector<firmware_if::OdometrySample> all;
  VehicleState state;
  state.v_WB = Vector3(5.0, 0.0, 0.0);
  MonotonicTime now{};
  for (; seconds(now.time_since_epoch()) < for_s; now += core::kMinorFrame) {
    state.p_WB = Vector3(10.0 + 5.0 * seconds(now.time_since_epoch()), 3.0, 2.0);
    sensor.sample(now, state);
    firmware_if::OdometrySample s;
    while (sensor.read(s) == Status::kOk) all.push_back(s);
  }
  return all;
}

Vector3 truth_W(const firmware_if::OdometrySample& s) {
  return {10.0 + 5.0 * seconds(s.stamp.time_since_epoch()), 3.0, 2.0};
}
Vector3 place(const firmware_if::OdometrySample& s) { return {s.p_OB_m[0], s.p_OB_m[1], s.p_OB_m[2]}; }

TEST(VisualOdometry, DriftsByOnePercentOfTheWay) {
  constexpr double kWay_m = 400.0;
  double squares_m2 = 0.0;
  constexpr int kSeeds = 40;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const auto all = fly(seed, kWay_m / 5.0);
    ASSERT_EQ(all.back().reset_counter, 0) << "not before 90 s";
    EXPECT_LT((place(all.front()) - truth_W(all.front())).norm(), 0.05) << "it begins in the world's frame";
    squares_m2 += (place(all.back()) - truth_W(all.back())).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares_m2 / kSeeds) / kWay_m, 0.009, 0.0015);
}

TEST(VisualOdometry, BeginsAnewAtZeroAndSaysSo) {
  const auto all = fly(3, 300.0);
  int resets = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (all[i].reset_counter == all[i - 1].reset_counter) continue;
    ++resets;
    EXPECT_EQ(all[i].reset_counter, all[i - 1].reset_counter + 1);
    EXPECT_LT(place(all[i]).norm(), 0.3 * 5.0 + 0.5) << "what it flew since";
    EXPECT_GT(seconds(all[i].stamp - all[i - 1].stamp), 0.3) << "silent meanwhile";
  }
  EXPECT_GE(resets, 1);
  EXPECT_LE(resets, 3);
}

TEST(VisualOdometry, NoModelNoSamples) {
  VisualOdometry sensor(OdometryModel::kNone, 1);
  sensor.sample(MonotonicTime{} + core::kMinorFrame, {});
  sensor.sample(MonotonicTime{} + Nanos{100'000'000}, {});
  firmware_if::OdometrySample s;
  EXPECT_EQ(sensor.read(s), Status::kNotReady);
}

}  // namespace
}  // namespace roborun::sitl
