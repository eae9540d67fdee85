/// A camera and its depth image, prepared for the question which blocks of space it sees through.
#pragma once

#include <array>
#include <cstddef>

#include "core/precision.hpp"
#include "stages/perception/depth_pyramid.hpp"

namespace roborun::stages {

inline constexpr std::size_t kMaxCameras = 8;

/// What the kernels read of a camera. Single precision: positions are relative to the camera.
struct SightCamera {
  /// Of the margin, what is there whatever the errors are.
  static constexpr double kLeast_m = 0.035;
  /// A pixel is no ray: within it, ground at a grazing angle is nearer and farther.
  static constexpr double kLeastQuadratic_per_m = 0.0012;
  static constexpr double kSigmas = 3.0;
  static constexpr double kSigmasAside = 2.0;
  void prepare(const PosedDepthFrame& posed, const DepthPyramid& image) noexcept;

  Vector3 p_WC = Vector3::Zero();
  std::array<float, 9> R_CW{};  ///< Row-major.
  /// Centres of a block's children, for a quarter edge of 1.
  alignas(32) std::array<std::array<float, 8>, 3> child{};
  float extent{};  ///< Half extent of a cube of half-edge 1 along the optical axis.
  /// The same against the four sides of the field of view: left, right, up, down.
  std::array<float, 4> support{};
  float tan_half_width{}, tan_half_height{}, range_m{};
  float columns_per_tan{}, rows_per_tan{}, last_column{}, last_row{};
  /// A block is free only if pixels see margin_m + margin_quadratic_per_m * depth^2 past it.
  float margin_m{}, margin_quadratic_per_m{};
  /// So much farther to all sides: widening + widening_m / depth, as a tangent.
  float widening{}, widening_m{};
  const DepthPyramid* pyramid{};
};

/// The cameras of one scan.
struct SightCameras {
  std::array<SightCamera, kMaxCameras> camera{};
  std::size_t count{0};
  PrecisionLattice lattice{};  ///< Of the blocks.
  /// All cameras of the vehicle are there: what lies between two images is seen by them together.
  bool complete{false};
};

}  // namespace roborun::stages
