/// Changes of velocity in the least time under limits of acceleration and jerk, in closed form.
///
/// Acceleration goes to its peak at the jerk limit, stays there, and goes back to zero. From rest of
/// acceleration a change by d takes
///   d / a + a / j          where the limit a is reached (d >= a^2 / j),
///   2 sqrt(d / j)          where it is not,
/// and on a straight line, by symmetry, its way is the mean of both speeds times that time. The same holds for
/// turns: the velocity moves along the straight line from one to the other, is never beyond both, and the way
/// is half the time at each of them.
#pragma once

#include <array>

#include "core/trajectory.hpp"

namespace roborun::stages {

struct ChangeLimits {
  double acceleration_mps2{};  ///< > 0
  double jerk_mps3{};          ///< > 0
};

/// Seconds of a change by `delta_mps` >= 0, from and to no acceleration. RT-safe: O(1).
[[nodiscard]] double change_s(double delta_mps, const ChangeLimits& limits) noexcept;
/// Metres of a change between two speeds on a straight line. RT-safe: O(1).
[[nodiscard]] double change_m(double from_mps, double to_mps, const ChangeLimits& limits) noexcept;

/// Three pieces of constant jerk.
class VelocityChange {
 public:
  struct Piece {
    Vector3 jerk_W = Vector3::Zero();
    double duration_s{};
  };

  /// From velocity and acceleration of a state to `v_W` without acceleration. Where the state accelerates
  /// already, the peak is found by 8 halvings; an acceleration beyond its limit only falls.
  /// RT-safe: O(1).
  VelocityChange(const TrajectoryPoint& from, const Vector3& v_W, const ChangeLimits& limits) noexcept;

  [[nodiscard]] const std::array<Piece, 3>& pieces() const noexcept { return piece_; }
  [[nodiscard]] double duration_s() const noexcept;
  /// From the position of that state to where it ends.
  [[nodiscard]] Vector3 way_W() const noexcept { return way_W_; }

 private:
  /// Pieces for this peak. False, with no use in them, if the peak is too high for so small a change.
  [[nodiscard]] bool with_peak(double peak_mps2) noexcept;
  void sum_up() noexcept;

  Vector3 v_from_W_, a_from_W_, delta_W_;
  double jerk_mps3_;
  std::array<Piece, 3> piece_{};
  Vector3 way_W_ = Vector3::Zero();
};

/// The state after a time of constant jerk. RT-safe: O(1).
[[nodiscard]] TrajectoryPoint after(const TrajectoryPoint& at, const VelocityChange::Piece& piece) noexcept;

}  // namespace roborun::stages
