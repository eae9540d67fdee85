/// The chain of polynomials through given points at given times whose integral of squared snap is least.
/// Source: Richter, Bry, Roy, "Polynomial trajectory planning for aggressive quadrotor flight" (2016): the
/// derivatives at the points are the unknowns, in closed form. Here the normal equations stay what they are,
/// symmetric, positive definite and block-tridiagonal: 4x4 Cholesky along the chain, O(points).
#pragma once

#include <array>
#include <span>

#include "core/trajectory.hpp"

namespace roborun::stages {

class MinimumSnap {
 public:
  static constexpr std::size_t kMaxKnots = Trajectory::kMaxSegments + 1;

  MinimumSnap() noexcept;

  /// From `start` (velocity, acceleration and jerk; snap zero) to rest at the last point, continuous up to
  /// snap. time_s[k] > 0 is the duration of the segment that ends at knot k; time_s[0] is not read. Fills the
  /// segments of `out` and nothing else. False, with `out` of no use, if the sizes differ or are not in [2,
  /// kMaxKnots], or if the result is not finite: a time of zero, points that are not finite. RT-safe:
  /// O(points).
  [[nodiscard]] bool solve(std::span<const Vector3> knot_W, std::span<const double> time_s,
                           const TrajectoryPoint& start, Trajectory& out) const noexcept;

 private:
  using Block = std::array<std::array<double, 4>, 4>;

  // The integral on [0, 1] as a quadratic form of velocity to snap at both ends (and of the way between
  // them).
  Block begin_begin_{}, begin_end_{}, end_end_{};
  std::array<double, 4> begin_way_{}, end_way_{};
  /// Coefficients 5 to 9 from what coefficients 0 to 4 leave open at the end.
  std::array<std::array<double, 5>, 5> high_of_rest_{};
};

}  // namespace roborun::stages
