/// How far a pixel that met nothing says so.
#pragma once

#include <cmath>
#include <cstddef>

#include "stages/perception/occupancy_map.hpp"

namespace roborun::stages {

/// Depth up to which nothing is in pixel (u, v) if it says that it met nothing: the range of a camera, which is measured along the
/// optical axis; of a cloud the depth at which the longest ray of the pixel is as long as the range. Precondition: a good shape
/// (check_shape()), a pixel of it. RT-safe: O(1).
[[nodiscard]] inline float empty_reach_m(const PosedDepthFrame& posed, std::size_t u,
                                         std::size_t v) noexcept {
  const firmware_if::DepthFrame& f = posed.frame;
  if (!posed.is_cloud) return f.range_m;
  const auto aside = [](std::size_t at, std::size_t pixels) {
    const auto middle = static_cast<float>(pixels) * 0.5F, begin = static_cast<float>(at);
    return std::fmax(std::fabs(begin - middle), std::fabs(begin + 1.0F - middle)) / middle;
  };
  const float left = aside(u, f.width) * f.tan_half_width, up = aside(v, f.height) * f.tan_half_height;
  return f.range_m / std::sqrt(1.0F + left * left + up * up);
}

}  // namespace roborun::stages
