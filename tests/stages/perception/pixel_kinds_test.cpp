#include "stages/perception/pixel_kinds.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <vector>

namespace roborun::stages {
namespace {

constexpr std::uint16_t kSide = 64;
constexpr float kRange_m = 10.0F;

class PixelAtTheRange : public ::testing::Test {
 protected:
  PixelAtTheRange() : depth_m_(static_cast<std::size_t>(kSide) * kSide, kRange_m) {}
  /// How many pixels of the image stand out for certain.
  int surely_thin() {
    firmware_if::DepthFrame frame;
    frame.depth_m = depth_m_;
    frame.width = frame.height = kSide;
    frame.range_m = kRange_m;
    int count = 0;
    for (std::size_t v = 0; v < kSide; ++v) {
      PixelRow row;
      tell_pixels(frame, v, 0, kSide, {0.25F, 0.0F, false}, row);
      for (const std::uint64_t word : row.surely_thin) count += std::popcount(word);
    }
    return count;
  }
  float& at(std::size_t u, std::size_t v) { return depth_m_[v * kSide + u]; }

 private:
  std::vector<float> depth_m_;
};

TEST_F(PixelAtTheRange, OfAPoleBeforeNothingStandsOut) {
  for (std::size_t v = 0; v < kSide; ++v) at(30, v) = 6.0F;
  EXPECT_EQ(surely_thin(), kSide);
}

TEST_F(PixelAtTheRange, OfAPlaneThatEndsThereDoesNot) {
  // By noise every other of its last pixels has a value.
  for (std::size_t v = 40; v < kSide; ++v)
    for (std::size_t u = 0; u < kSide; ++u) at(u, v) = 9.9F;
  for (std::size_t u = 0; u < kSide; u += 2) at(u, 39) = 9.95F;
  for (std::size_t u = 0; u < kSide; u += 8) at(u, 37) = 9.98F;
  EXPECT_EQ(surely_thin(), 0);
}

/// A surface at 2 m that ends at column 32 before one at 9 m, of a camera whose pixels may lie between both.
class PixelsBetween : public ::testing::Test {
 protected:
  PixelsBetween() : depth_m_(static_cast<std::size_t>(kSide) * kSide, 9.0F) {
    for (std::size_t v = 0; v < kSide; ++v)
      for (std::size_t u = 0; u < 32; ++u) at(u, v) = 2.0F;
  }
  float& at(std::size_t u, std::size_t v) { return depth_m_[v * kSide + u]; }
  const PixelRow& row(std::size_t v) {
    firmware_if::DepthFrame frame;
    frame.depth_m = depth_m_;
    frame.width = frame.height = kSide;
    frame.range_m = kRange_m;
    tell_pixels(frame, v, 0, kSide, {0.25F, 0.005F, true, 0.0F, 0.02F}, row_);
    return row_;
  }

 private:
  std::vector<float> depth_m_;
  PixelRow row_{};
};

TEST_F(PixelsBetween, AreNothingThoughTheyAreNearWhatIsInFront) {
  at(32, 19) = 2.0F;
  at(32, 20) = 2.2F;
  EXPECT_EQ(row(20).depth_m[32], 0.0F);
  EXPECT_EQ(row(20).depth_m[31], 2.0F) << "the rim itself is there";
  EXPECT_EQ(row(20).depth_m[33], 9.0F);
  at(32, 20) = 2.05F;
  EXPECT_EQ(row(20).depth_m[32], 2.05F) << "so little is noise, or a slope";
}

TEST_F(PixelsBetween, AreNothingWhereWhatIsBehindHasNoDepth) {
  for (std::size_t v = 0; v < kSide; ++v)
    for (std::size_t u = 33; u < kSide; ++u) at(u, v) = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t v = 19; v < 22; ++v) at(32, v) = std::numeric_limits<float>::quiet_NaN();
  at(32, 20) = 2.3F;
  EXPECT_EQ(row(20).depth_m[32], 0.0F);
}

TEST_F(PixelsBetween, AreNothingWhereWhatIsInFrontIsAcrossAHole) {
  for (std::size_t v = 0; v < kSide; ++v)
    for (std::size_t u = 32; u < 36; ++u) at(u, v) = std::numeric_limits<float>::quiet_NaN();
  at(36, 20) = 4.0F;
  at(36, 40) = at(36, 41) = at(37, 40) = at(37, 41) = 4.0F;
  EXPECT_EQ(row(20).depth_m[36], 0.0F);
  EXPECT_EQ(row(20).depth_m[31], 2.0F) << "the rim itself is there";
  EXPECT_EQ(row(40).depth_m[36], 4.0F) << "three neighbours share its surface";
}

TEST_F(PixelsBetween, AreNoPoleBesideItsShadow) {
  for (std::size_t v = 0; v < kSide; ++v) {
    at(45, v) = at(46, v) = 4.0F;
    at(47, v) = std::numeric_limits<float>::quiet_NaN();
    at(55, v) = 4.0F;
    at(56, v) = std::numeric_limits<float>::quiet_NaN();
  }
  EXPECT_EQ(row(20).depth_m[45], 4.0F);
  EXPECT_EQ(row(20).depth_m[46], 4.0F) << "two pixels wide";
  EXPECT_EQ(row(20).depth_m[55], 4.0F) << "one pixel wide";
}

TEST_F(PixelsBetween, AreNothingAndNotThinWhereTwoOfThemAgree) {
  at(32, 20) = at(32, 21) = 4.0F;
  for (const std::size_t v : {20U, 21U}) {
    EXPECT_EQ(row(v).depth_m[32], 0.0F) << v;
    EXPECT_FALSE(row(v).any_thin) << v;
  }
  at(50, 40) = at(50, 41) = at(50, 42) = 4.0F;
  EXPECT_EQ(row(41).depth_m[50], 4.0F) << "what stands before all around it is there";
  EXPECT_TRUE(row(41).any_thin);
}

}  // namespace
}  // namespace roborun::stages
