/// Which pixels of an image end in what a ball sweeps.
#pragma once

#include <array>
#include <cstddef>

#include "firmware_if/depth_camera.hpp"

namespace roborun::stages {

/// Where a ball goes: straight from point to point, frame C of the camera, metres.
struct SweptWay {
  static constexpr std::size_t kMost = 5;
  std::array<std::array<float, 3>, kMost> point_C{};
  std::size_t points{};  ///< [2, kMost]
  float radius_m{};
  /// Of a pixel at depth z the ball is smaller by constant_m + quadratic_per_m z^2.
  float constant_m{}, quadratic_per_m{};
};

/// How many pixels of the rows [v0, v1) end within it, ahead of where it begins by more than 12 degrees: what is only beside it, it
/// leaves behind. Preconditions: a good shape (check_shape()), v0 <= v1 <= height. RT-safe: O(pixels).
[[nodiscard]] std::size_t count_swept(const firmware_if::DepthFrame& frame, std::size_t v0, std::size_t v1,
                                      const SweptWay& way) noexcept;

}  // namespace roborun::stages
