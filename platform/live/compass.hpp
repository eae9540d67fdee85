/// The heading of a vehicle from its magnetometer, and whether what it measures is the earth's field.
#pragma once

#include "core/geometry/vector.hpp"

namespace roborun::live {

/// RT-safe: O(1), no allocation.
class Compass {
 public:
  struct Heading {
    double rad{};  ///< Of the body's forward axis, counter-clockwise from east.
    double sigma_rad{};
  };

  /// The earth's field where it is: east, north, up, gauss.
  void stand_in(const Vector3& earth_W_gauss) noexcept;
  /// Null, and the heading; else why there is none. `field_B_gauss`: forward, left, up; `up_B`: the vertical in the same axes, a
  /// unit vector. What a turn about the vertical cannot explain is a disturbance: it widens the error, and from half
  /// of the level field on it refuses.
  [[nodiscard]] const char* read(const Vector3& field_B_gauss, const Vector3& up_B,
                                 Heading& heading) const noexcept;

 private:
  double north_rad_{};  ///< Of the level part of the earth's field.
  double level_gauss_{}, up_gauss_{};
};

}  // namespace roborun::live
