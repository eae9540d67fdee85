#include "stages/perception/swept_pixels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "core/geometry/vector.hpp"
#include "core/random/counter_rng.hpp"
#include "stages/perception/instruction_sets.hpp"

namespace roborun::stages {
namespace {

constexpr std::uint16_t kWidth = 45, kHeight = 21;  // no multiple of any vector

class SweptPixels : public ::testing::Test {
 protected:
  SweptPixels() : depth_m_(std::size_t{kWidth} * kHeight, std::numeric_limits<float>::infinity()) {
    frame_.width = kWidth;
    frame_.height = kHeight;
    frame_.tan_half_width = 1.2F;
    frame_.tan_half_height = 0.6F;
    frame_.range_m = 10.0F;
    frame_.depth_m = depth_m_;
    way_.point_C[0] = {0.0F, 0.0F, 0.0F};
    way_.point_C[1] = {1.5F, 0.0F, 0.0F};
    way_.points = 2;
    way_.radius_m = 0.7F;
  }
  ~SweptPixels() override { use_kernel_instruction_sets(~std::int64_t{0}); }

  [[nodiscard]] std::size_t count() const { return count_swept(frame_, 0, kHeight, way_); }
  void all(float depth_m) { std::fill(depth_m_.begin(), depth_m_.end(), depth_m); }
  [[nodiscard]] Vector3 p_C(std::size_t u, std::size_t v) const {
    const double z = static_cast<double>(depth_m_[v * kWidth + u]);
    return {z, -z * (2.0 * (static_cast<double>(u) + 0.5) / kWidth - 1.0) * 1.2,
            -z * (2.0 * (static_cast<double>(v) + 0.5) / kHeight - 1.0) * 0.6};
  }
  /// How far a place is from the way, in small steps along it.
  [[nodiscard]] double distance_m(const Vector3& p_C) const {
    constexpr int kSteps = 2000;
    double least_m = 1e9;
    for (std::size_t i = 0; i + 1 < way_.points; ++i)
      for (int k = 0; k <= kSteps; ++k)
        least_m = std::min(least_m, (p_C - (point(i) + (point(i + 1) - point(i)) * k / kSteps)).norm());
    return least_m;
  }
  [[nodiscard]] Vector3 point(std::size_t i) const {
    const auto& p = way_.point_C[i];
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }

  std::vector<float> depth_m_;
  firmware_if::DepthFrame frame_;
  SweptWay way_;
};

TEST_F(SweptPixels, AreThoseThatADenseWalkAlongTheWayFinds) {
  core::CounterRng rng(11, 4);
  std::size_t swept = 0;
  for (int n = 0; n < 60; ++n) {
    way_.points = 2 + static_cast<std::size_t>(n % 4);
    for (std::size_t i = 1; i < way_.points; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        way_.point_C[i][axis] =
            way_.point_C[i - 1][axis] + static_cast<float>(axis == 0 ? rng.uniform() : rng.uniform() - 0.5);
    way_.constant_m = static_cast<float>(0.05 * rng.uniform());
    way_.quadratic_per_m = static_cast<float>(0.01 * rng.uniform());
    for (float& depth_m : depth_m_) depth_m = static_cast<float>(0.2 + 4.0 * rng.uniform());
    // What is nearly as far as the limits may be on either side of them.
    std::size_t surely = 0, perhaps = 0;
    for (std::size_t v = 0; v < kHeight; ++v) {
      for (std::size_t u = 0; u < kWidth; ++u) {
        const Vector3 p = p_C(u, v);
        const double room_m = 0.7 - static_cast<double>(way_.constant_m) -
                              static_cast<double>(way_.quadratic_per_m) * p.x() * p.x();
        const double away_m = distance_m(p), ahead = away_m * away_m - 0.96 * p.squaredNorm();
        surely += away_m < room_m - 1e-3 && ahead < -1e-3 ? 1U : 0U;
        perhaps += away_m < room_m + 1e-3 && ahead < 1e-3 ? 1U : 0U;
      }
    }
    EXPECT_GE(count(), surely) << n;
    EXPECT_LE(count(), perhaps) << n;
    EXPECT_LE(perhaps - surely, 15U) << n;
    swept += count();
  }
  EXPECT_GT(swept, 1000U);
}

TEST_F(SweptPixels, AreAsManyOnEveryInstructionSetAndInTwoHalves) {
  core::CounterRng rng(12, 4);
  for (float& depth_m : depth_m_) depth_m = static_cast<float>(0.2 + 3.0 * rng.uniform());
  const std::size_t here = count();
  EXPECT_GT(here, 20U);
  EXPECT_EQ(count_swept(frame_, 0, 9, way_) + count_swept(frame_, 9, kHeight, way_), here);
  int sets = 0;
  for (unsigned bit = 0; bit < 63; ++bit) {
    const std::int64_t set = kernel_instruction_sets() & (std::int64_t{1} << bit);
    if (set == 0) continue;
    use_kernel_instruction_sets(set);
    EXPECT_EQ(count(), here) << bit;
    ++sets;
  }
  EXPECT_GE(sets, 1);
}

TEST_F(SweptPixels, AreNoneWhereThereIsNoSurface) {
  EXPECT_EQ(count(), 0U);
  all(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(count(), 0U);
  all(-1.0F);
  EXPECT_EQ(count(), 0U);
  all(1.0F);
  EXPECT_GT(count(), 100U);
  frame_.range_min_m = 1.0F;
  EXPECT_EQ(count(), 0U) << "what is too near to be measured says nothing";
}

TEST_F(SweptPixels, AreNotBesideTheBeginningAlone) {
  // A wall that is flown along, 0.6 m to the left: nearer than the radius, all along.
  frame_.tan_half_width = 8.0F;
  way_.point_C[1] = {0.5F, 0.0F, 0.0F};
  for (std::size_t v = 0; v < kHeight; ++v) depth_m_[v * kWidth] = 0.6F / 8.0F;
  EXPECT_EQ(count(), 0U) << "83 degrees to the left";
  for (std::size_t v = 0; v < kHeight; ++v) depth_m_[v * kWidth] = 0.0F;
  depth_m_[kWidth / 2] = 1.1F;
  EXPECT_EQ(count(), 0U) << "0.63 m above, 0.87 m from where the way ends";
  depth_m_[kWidth / 2 + 10 * kWidth] = 1.1F;
  EXPECT_EQ(count(), 1U);
}

}  // namespace
}  // namespace roborun::stages
