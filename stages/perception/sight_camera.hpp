/// A camera and its depth image, prepared for the question which blocks of space it sees through.
#pragma once

#include <array>
#include <cstddef>

#include "stages/perception/depth_pyramid.hpp"

namespace roborun::stages {

inline constexpr std::size_t kMaxCameras = 8;

/// What the kernels read of a camera. Single precision: positions are relative to the camera.
struct SightCamera {
  /// A block is free only if every pixel sees constant_m + quadratic_per_m * depth^2 past it: stereo's error
  /// grows with the square of the depth.
  struct Margin {
    double constant_m{};
    double quadratic_per_m{};
  };
  void prepare(const PosedDepthFrame& posed, const DepthPyramid& image, const Margin& depth_margin) noexcept;

  Vector3 p_WC = Vector3::Zero();
  std::array<float, 9> R_CW{};  ///< Row-major.
  /// Centres of a block's children, for a quarter edge of 1.
  alignas(32) std::array<std::array<float, 8>, 3> child{};
  float extent{};  ///< Half extent of a cube of half-edge 1 along the optical axis.
  /// The same against the four sides of the field of view: left, right, up, down.
  std::array<float, 4> support{};
  float tan_half_width{}, tan_half_height{}, range_m{};
  float columns_per_tan{}, rows_per_tan{}, last_column{}, last_row{};
  float margin_m{}, margin_quadratic_per_m{};
  const DepthPyramid* pyramid{};
};

/// The cameras of one scan.
struct SightCameras {
  std::array<SightCamera, kMaxCameras> camera{};
  std::size_t count{0};
  /// All cameras of the vehicle are there: what lies between two images is seen by them together.
  bool complete{false};
};

}  // namespace roborun::stages
