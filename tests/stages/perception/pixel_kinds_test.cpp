#include "stages/perception/pixel_kinds.hpp"

#include <gtest/gtest.h>

#include <bit>
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

}  // namespace
}  // namespace roborun::stages
