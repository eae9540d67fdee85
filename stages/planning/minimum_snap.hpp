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
  /// Right-hand sides and unknowns of one knot: derivative 1 to 4 by axis.
  using Rows = std::array<std::array<double, 3>, 4>;
  struct Chain;
  struct Link;
  struct Knot;
  struct Ends;

  // The steps of solve(); the equations stand in the source.
  void begin_knot(const Link& link, Knot& knot) const noexcept;
  void subtract_start(const Link& link, const Rows& x0, Knot& knot) const noexcept;
  static void subtract_before(const Block& coupling, const Rows& z, Knot& knot) noexcept;
  void complete_knot(const Link& link, Knot& knot, std::size_t k, Chain& chain) const noexcept;
  static void substitute_back(std::size_t segments, Chain& chain) noexcept;
  [[nodiscard]] bool fill_axis(const Ends& ends, std::size_t c, PolynomialSegment& segment) const noexcept;

  // The integral on [0, 1] as a quadratic form of velocity to snap at both ends, and of the way between them.
  Block begin_begin_{}, begin_end_{}, end_end_{};
  std::array<double, 4> begin_way_{}, end_way_{};
  /// Coefficients 5 to 9 from what coefficients 0 to 4 leave open at the end.
  std::array<std::array<double, 5>, 5> high_of_rest_{};
};

}  // namespace roborun::stages
