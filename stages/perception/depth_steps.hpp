/// Depths in whole steps: the entries that a depth pyramid is made of, and the vector kernels that make them
/// from pixels and from each other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace roborun::stages {

inline constexpr float kMaxRange_m = 300.0F;
inline constexpr float kMaxTanHalfFov = 2.0F;
inline constexpr std::size_t kMaxImageSide = 1280;  ///< Pixels.

/// Visible depth of a pixel: its depth, or the range where nothing returned; 0 where there is no information:
/// NaN, or not beyond range_min_m.
[[nodiscard]] inline float visible_depth_m(float depth_m, float range_m, float range_min_m) noexcept {
  if (!(depth_m > range_min_m)) return 0.0F;
  return depth_m < range_m ? depth_m : range_m;
}

/// Two bounds of some pixels in one word, so that both combine by the same minimum. A step is range / 32766.
struct DepthEntry {
  static constexpr std::int32_t kMaxSteps = 32767;  ///< "Nothing within the range".

  std::int16_t least_steps;     ///< No pixel with information sees less far.
  std::int16_t not_most_steps;  ///< kMaxSteps minus what no pixel sees beyond.
};

inline constexpr std::size_t kMaxTile = 8;  ///< Pixels on a side.

/// Some rows of an image.
struct DepthStrip {
  const float* depth_m{};
  std::size_t width{}, rows{};  ///< Pixels; at most kMaxImageSide and kMaxTile.
  float range_m{}, range_min_m{}, steps_per_m{};
};

/// What a strip holds besides bounds.
struct StripSeen {
  static constexpr std::size_t kWords = (kMaxImageSide / 8 + 63) / 64;
  /// Bit i of all words: one of the columns 8 i .. 8 i + 7 has a pixel without information.
  std::array<std::uint64_t, kWords> incomplete{};
  bool surface{};  ///< A pixel shows a surface.
};

/// Sets entry[i] to the bounds of the i-th tile: 2^shift columns and all rows of the strip. A pixel without
/// information has no part in them. RT-safe: O(pixels).
[[nodiscard]] StripSeen tile_steps(const DepthStrip& strip, int shift, DepthEntry* entry) noexcept;

/// Sets to[x] to the least of stride x and stride x + stride of both rows, for x < count. RT-safe: O(count).
void least_of_four(const DepthEntry* above, const DepthEntry* below, std::size_t stride, std::size_t count,
                   DepthEntry* to) noexcept;

}  // namespace roborun::stages
