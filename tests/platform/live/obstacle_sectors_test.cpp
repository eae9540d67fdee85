#include "platform/live/obstacle_sectors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/geometry/math.hpp"
#include "platform/live/guard.hpp"

namespace roborun::live {
namespace {

constexpr std::size_t kWidth = 160, kHeight = 120;
constexpr std::uint16_t kFree = 2501;

/// One camera of 90 x 73 degrees, 25 m, that looks ahead or to the right.
class ObstacleSectorsTest : public ::testing::Test {
 protected:
  void show(bool to_the_right, const Matrix3& R_LB = Matrix3::Identity()) {
    firmware_if::DepthFrame frame;
    frame.stamp = MonotonicTime{Nanos{1'000'000'000}};
    frame.width = kWidth;
    frame.height = kHeight;
    frame.tan_half_width = 1.0F;
    frame.tan_half_height = 0.75F;
    frame.range_m = 25.0F;
    frame.range_min_m = 0.3F;
    frame.depth_m = depth_m;
    firmware_if::CameraMount mount;
    if (to_the_right) mount.R_BC = {0, 1, 0, -1, 0, 0, 0, 0, 1};  // its x is the body's -y
    sut.see(0, frame, mount, R_LB);
  }
  [[nodiscard]] std::uint16_t at(std::size_t degrees, Nanos age = Nanos{0}) const {
    return sut.message(MonotonicTime{Nanos{1'000'000'000}} + age).distances.at(degrees / 5);
  }
  std::vector<float> depth_m = std::vector<float>(kWidth * kHeight, std::numeric_limits<float>::infinity());
  ObstacleSectors sut{1, 0.5};
};

TEST_F(ObstacleSectorsTest, AWallAheadIsAheadAndOneOnTheRightIsClockwise) {
  depth_m.assign(depth_m.size(), 4.0F);
  show(false);
  EXPECT_NEAR(at(0), 400, 2);
  EXPECT_NEAR(at(30), 400.0 / std::cos(27.5 * M_PI / 180.0), 8);
  EXPECT_EQ(at(90), ObstacleSectors::kUnknown);
  EXPECT_EQ(at(180), ObstacleSectors::kUnknown);
  show(true);
  EXPECT_NEAR(at(90), 400, 2);
  EXPECT_EQ(at(0), ObstacleSectors::kUnknown);
  EXPECT_EQ(at(270), ObstacleSectors::kUnknown);
}

TEST_F(ObstacleSectorsTest, NothingIsFreeAndSilenceIsNotKnown) {
  show(false);
  EXPECT_EQ(at(0), kFree);
  EXPECT_EQ(at(355), kFree);
  EXPECT_EQ(at(0, Nanos{600'000'000}), ObstacleSectors::kUnknown) << "an old image";
  depth_m[kHeight / 2 * kWidth + kWidth / 2] = std::numeric_limits<float>::quiet_NaN();
  show(false);
  EXPECT_EQ(at(0), kFree) << "one level ray of many said nothing";
  const auto silence = [this](std::size_t every) {  // one column of so many, from the middle on to the right
    depth_m.assign(depth_m.size(), std::numeric_limits<float>::infinity());
    for (std::size_t i = 0; i < depth_m.size(); ++i)
      if (i % kWidth >= kWidth / 2 && i % every == 0) depth_m[i] = std::numeric_limits<float>::quiet_NaN();
    show(false);
  };
  silence(3);
  EXPECT_EQ(at(10), kFree) << "most found nothing";
  silence(1);
  EXPECT_EQ(at(10), ObstacleSectors::kUnknown);
  EXPECT_EQ(at(350), kFree);
  silence(2);
  for (std::size_t i = 1; i < depth_m.size(); i += 4)
    if (i % kWidth >= kWidth / 2) depth_m[i] = std::numeric_limits<float>::quiet_NaN();
  show(false);
  EXPECT_EQ(at(10), ObstacleSectors::kUnknown) << "most said nothing";
}

TEST_F(ObstacleSectorsTest, OnlyTheBandCounts) {
  for (std::size_t v = kHeight * 3 / 4; v < kHeight; ++v)
    for (std::size_t u = 0; u < kWidth; ++u) depth_m[v * kWidth + u] = 5.0F;  // 1.9 m below and lower: ground
  show(false);
  EXPECT_EQ(at(0), kFree);
  depth_m[kHeight / 2 * kWidth + kWidth / 2] = 7.0F;  // one pixel of a pole
  show(false);
  EXPECT_NEAR(at(0), 700, 2);
  EXPECT_EQ(at(10), kFree);
  EXPECT_NEAR(sut.nearest_m(MonotonicTime{Nanos{1'000'000'000}}), 7.0, 0.02);
}

TEST_F(ObstacleSectorsTest, IsSentInTheBodysFrame) {
  show(false);
  const auto m = sut.message(MonotonicTime{Nanos{1'000'000'000}});
  EXPECT_EQ(m.frame, 12);
  EXPECT_EQ(m.increment, 5);
  EXPECT_EQ(m.min_distance, 31);  // 0.3F is a little more
  EXPECT_EQ(m.max_distance, 2500);
}

TEST_F(ObstacleSectorsTest, TheGroundBelowALeaningVehicleIsNoObstacle) {
  constexpr double kHeight_m = 2.0;
  // MAVLink's pitch of -20 degrees: the nose is down, and 5 degrees of roll: the right side is.
  const double roll_rad = 5.0 * M_PI / 180.0, pitch_rad = -20.0 * M_PI / 180.0;
  const Matrix3 R_LB = level_of(roll_rad, pitch_rad);
  EXPECT_LT((R_LB * Vector3::UnitX()).z(), -0.3) << "its nose points down";
  EXPECT_GT((R_LB * Vector3::UnitY()).z(), 0.05) << "its left side is up";
  // The same as a quaternion, and heading 70 degrees: that counts for nothing.
  const Quaternion q(Eigen::AngleAxisd(1.2, Vector3::UnitZ()) *
                     Eigen::AngleAxisd(pitch_rad, Vector3::UnitY()) *
                     Eigen::AngleAxisd(roll_rad, Vector3::UnitX()));
  EXPECT_LT((level_of(std::array{q.w(), q.x(), q.y(), q.z()}) - R_LB).norm(), 1e-6);
  for (std::size_t v = 0; v < kHeight; ++v)
    for (std::size_t u = 0; u < kWidth; ++u) {
      const double across = 1.0 - 2.0 * (static_cast<double>(u) + 0.5) / kWidth;
      const double up = 0.75 * (1.0 - 2.0 * (static_cast<double>(v) + 0.5) / kHeight);
      const double fall = -(R_LB * Vector3(1.0, across, up)).z();
      if (fall > 0.0) depth_m[v * kWidth + u] = static_cast<float>(kHeight_m / fall);
    }
  show(false);
  EXPECT_LT(at(0), 600) << "in the body's axes the ground is ahead";
  show(false, R_LB);
  EXPECT_EQ(at(0), kFree);
}

TEST_F(ObstacleSectorsTest, IsClearAsFarAsTheNearestInTheDirectionAndNotAtAllWhereManyAreUnknown) {
  depth_m[kHeight / 2 * kWidth + kWidth / 2] = 6.0F;  // straight ahead, a wire
  show(false);
  const auto clear_m = [&](double clockwise_deg, double half_deg) {
    return ObstacleSectors::clear_m(sut.message(MonotonicTime{Nanos{1'000'000'000}}),
                                    clockwise_deg * core::kDegree, half_deg * core::kDegree);
  };
  EXPECT_NEAR(clear_m(0.0, 30.0), 6.0, 0.05);
  EXPECT_NEAR(clear_m(20.0, 10.0), 25.01, 0.02) << "beside it: the range";
  EXPECT_NEAR(clear_m(-340.0, 10.0), 25.01, 0.02) << "angles wrap";
  EXPECT_EQ(clear_m(90.0, 30.0), 0.0) << "nobody looks there";
  EXPECT_EQ(clear_m(0.0, 180.0), 0.0);
}

TEST(GuardSpeedLimit, StopsWithinWhatIsClear) {
  const GuardSpeedLimit sut{kSitlQuadrotorStopping, 0.6, 6.0};
  for (const double clear_m : {3.0, 4.0, 6.0, 8.0}) {
    const double v = sut.speed_mps(clear_m);
    EXPECT_NEAR(0.6 + GuardSpeedLimit::kLatency_s * v + kSitlQuadrotorStopping.distance_m(v), clear_m, 1e-9);
  }
  EXPECT_EQ(sut.speed_mps(25.0), 6.0) << "the vehicle's own";
  for (const double clear_m : {0.0, 0.5, 1.0})
    EXPECT_EQ(sut.speed_mps(clear_m), GuardSpeedLimit::kLeast_mps) << clear_m;
  const GuardSpeedLimit linear{{0.0, 0.5, 0.0}, 0.0, 100.0};
  EXPECT_NEAR(linear.speed_mps(10.0), 10.0, 1e-9);
}

}  // namespace
}  // namespace roborun::live
