/// A depth image as a min/max pyramid: how far is every pixel of a rectangle known to see, at least and at
/// most?
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::stages {

/// kOk if a frame may be used at all: 8..512 pixels a side, as many depths as pixels, finite positive range
/// and field of view, finite pose, and at least one pixel that is not NaN or <= 0. Otherwise
/// kInvalidArgument. O(pixels) at worst.
[[nodiscard]] Status check_frame(const PosedDepthFrame& posed) noexcept;

/// Visible depth of a pixel: its depth, or the range where nothing returned; 0 where there is no information.
[[nodiscard]] inline float visible_depth_m(float depth_m, float range_m) noexcept {
  if (!(depth_m > 0.0F)) return 0.0F;
  return depth_m < range_m ? depth_m : range_m;
}

/// A pixel without information (NaN or <= 0) whose neighbours above, below, left and right all have some
/// counts as the nearest of them: a camera loses one pixel in 200 at random, and near cells have thousands.
/// Larger holes see nothing. Entry (x, y) of level k covers 2^k x 2^k pixels. Memory from the arena: 8/3
/// bytes x 4 a pixel.
class DepthPyramid {
 public:
  static constexpr std::size_t kMaxLevels = 10;
  static constexpr std::size_t kMaxPixels = 512;

  struct Bound {
    float least_m;  ///< No pixel of the rectangle sees less far; 0 if one has no information.
    float most_m;   ///< No pixel of the rectangle sees farther.
  };

  /// Room for images of up to max_side x max_side pixels.
  DepthPyramid(core::Arena& arena, std::size_t max_side) noexcept;
  /// kCapacity if the image is larger than planned. O(pixels).
  [[nodiscard]] Status build(const firmware_if::DepthFrame& frame) noexcept;
  /// Pixels [u0, u1] x [v0, v1], inside the image. Conservative: reads at most 3 x 3 entries, which may cover
  /// more.
  [[nodiscard]] Bound bound(int u0, int v0, int u1, int v1) const noexcept;

 private:
  struct Level {
    std::span<Bound> entry{};
    int width{};
    int height{};
    [[nodiscard]] std::size_t index(int x, int y) const noexcept {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }
  };
  std::size_t max_side_;
  std::size_t level_count_{0};
  std::array<Level, kMaxLevels> level_{};
  std::span<Bound> memory_{};
};

}  // namespace roborun::stages
