/// How wrong an image of depths is.
#pragma once

namespace roborun {

/// One sigma each.
struct DepthError {
  /// Of a measured depth z: constant_m + quadratic_per_m z^2 (stereo's error grows with the square of the depth). Both 0: the
  /// camera has no noise, as only a simulated one.
  double constant_m{0.005};
  double quadratic_per_m{0.0004};
  /// Of where the camera is believed to be and to look: mount, estimate, time.
  double place_m{0.0};
  double angle_rad{0.0};
  /// Pixels at the edge of what is in front may lie anywhere between it and what is behind.
  bool mixes{false};
  /// Sky has no values: it is a hole like any other.
  bool dark_sky{false};

  [[nodiscard]] constexpr double at_m(double depth_m) const noexcept {
    return constant_m + quadratic_per_m * depth_m * depth_m;
  }
  /// Of a point, in any direction, from a place that is as wrong for all.
  [[nodiscard]] constexpr double of_point_m(double depth_m) const noexcept {
    return at_m(depth_m) + angle_rad * depth_m;
  }
};

}  // namespace roborun
