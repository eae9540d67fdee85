/// How far nothing is in the holes of an image, of a camera that has no values where there is no texture and on sky.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "stages/perception/depth_steps.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::stages {

/// A hole is a surface without texture, or sky. Of a hole that is bounded to all four sides (of the image), it is taken that
/// nothing in it is nearer than the nearest of the four values. Above the last value of a column there is sky, or something that
/// stands on the ground and hides the ground behind its foot: nothing is nearer than that value, as long as this one lies below
/// the horizon. These columns are upright in the world and as wide as a pixel; the nearest of three neighbours counts. Above a
/// value over the horizon (a wall, a ceiling) nothing is known, nor above all values of an image that looks steeply up or down.
///
/// The limit: what has no values, not even at its rim, and hangs in front of what has some, is not seen.
class HoleReach {
 public:
  /// Sets `filled` to the image with such holes as deep as nothing is in them, which may be more than the range. False:
  /// there is nothing to fill, and `filled` holds anything. Preconditions: a good shape (check_shape()); as many pixels in
  /// both. RT-safe: O(pixels).
  [[nodiscard]] bool fill(const PosedDepthFrame& posed, std::span<float> filled) noexcept;

 private:
  /// The highest value of a column: the tangent of its elevation, and how far ahead of the camera it is.
  struct Top {
    float tangent, ahead_m;
  };
  /// Where a pixel looks.
  struct Place {
    std::size_t column;
    float tangent, ahead;
  };
  static constexpr std::size_t kColumns = 2048;

  [[nodiscard]] bool fill_bounded(const firmware_if::DepthFrame& frame, std::span<float> filled) noexcept;
  [[nodiscard]] bool fill_sky(const PosedDepthFrame& posed, std::span<float> filled) noexcept;
  void begin(const PosedDepthFrame& posed) noexcept;
  /// False: to no column.
  [[nodiscard]] bool place_of(const std::array<float, 3>& row, std::size_t u, Place& place) const noexcept;
  [[nodiscard]] std::array<float, 3> row_of(std::size_t v) const noexcept;
  void find_tops(const firmware_if::DepthFrame& frame) noexcept;
  /// What holds for holes of a column above its top, by its neighbours' tops, too; ahead_m 0: nothing.
  [[nodiscard]] Top limit_of(std::size_t column) const noexcept;

  /// Directions of pixels, ahead, to the left and up in a level frame that is turned with the camera: of the first pixel, and
  /// from one to the next in a row and in a column of the image.
  std::array<float, 3> first_{}, right_{}, down_{};
  float columns_per_tan_{};
  std::array<Top, kColumns> top_{};
  std::array<float, kMaxImageSide> above_m_{},
      below_m_{};  ///< The last value of each column of the image; 0: none yet.
};

}  // namespace roborun::stages
