/// A trajectory as a chain of polynomials that ends in a stop.
#pragma once

#include <array>
#include <cstddef>

#include "core/geometry/vector.hpp"
#include "firmware_if/time.hpp"

namespace roborun {

/// Position and its derivatives at one instant, world frame, SI.
struct TrajectoryPoint {
  Vector3 p_W = Vector3::Zero();
  Vector3 v_W = Vector3::Zero();
  Vector3 a_W = Vector3::Zero();
  Vector3 j_W = Vector3::Zero();
};

[[nodiscard]] inline bool is_finite(const TrajectoryPoint& point) noexcept {
  return is_finite(point.p_W) && is_finite(point.v_W) && is_finite(point.a_W) && is_finite(point.j_W);
}

/// One polynomial of degree 9 on [0, duration_s]; coefficient[k] multiplies t^k.
struct PolynomialSegment {
  static constexpr std::size_t kCoefficients = 10;
  double duration_s{};
  std::array<Vector3, kCoefficients> coefficient = zeros();

 private:
  /// Eigen leaves vectors unset; a trajectory never is.
  [[nodiscard]] static std::array<Vector3, kCoefficients> zeros() noexcept {
    std::array<Vector3, kCoefficients> all;
    all.fill(Vector3::Zero());
    return all;
  }
};

/// Piecewise polynomial, continuous up to acceleration, at rest at its end. Before start_time it stays at its first
/// point, after its end at its last point, in both cases with all derivatives zero. Empty (segment_count ==
/// 0): "hold" at hold_W.
class Trajectory {
 public:
  static constexpr std::size_t kMaxSegments = 48;

  MonotonicTime start_time{};
  /// From start_time: where the final braking tail begins; duration_s() if there is none.
  double brake_begin_s{};
  std::size_t segment_count{};
  std::array<PolynomialSegment, kMaxSegments> segment{};
  Vector3 hold_W = Vector3::Zero();

  /// A trajectory that stays at a point for ever.
  [[nodiscard]] static Trajectory hold(const Vector3& p_W, MonotonicTime start) noexcept;
  [[nodiscard]] double duration_s() const noexcept;
  [[nodiscard]] MonotonicTime ends() const noexcept { return start_time + from_seconds(duration_s()); }
  [[nodiscard]] Vector3 end_W() const noexcept;
  /// RT-safe: O(segment_count), no allocation.
  [[nodiscard]] TrajectoryPoint at(MonotonicTime time) const noexcept;
  /// Same, with the time counted from start_time in seconds. NaN is read as 0.
  [[nodiscard]] TrajectoryPoint at_s(double time_s) const noexcept;
};

}  // namespace roborun
