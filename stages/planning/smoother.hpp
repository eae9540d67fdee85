/// From a piecewise-straight path to a trajectory that the vehicle can fly and that ends in a stop.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "core/executive/stage_budget.hpp"
#include "core/memory/static_vector.hpp"
#include "core/range.hpp"
#include "core/trajectory.hpp"
#include "core/vehicle_model.hpp"
#include "firmware_if/status.hpp"
#include "stages/perception/polled_view.hpp"
#include "stages/planning/minimum_snap.hpp"

namespace roborun::stages {

struct MotionLimits {
  double speed_mps{VehicleModel{}.speed_mps};  ///< (0, 30]
  double acceleration_mps2{
      VehicleModel{}.acceleration_mps2};       ///< (0, 30]. |a| along the whole trajectory, braking included.
  double jerk_mps3{VehicleModel{}.jerk_mps3};  ///< (0, 1000]. Beyond it the vehicle overshoots the attitude.
  double climb_mps{30.0};                      ///< (0, 30]. Upwards ...
  double descent_mps{30.0};                    ///< (0, 30]. ... and downwards.
  [[nodiscard]] constexpr Status validate() const noexcept {
    const bool ok = core::above(speed_mps, 0.0, 30.0) && core::above(acceleration_mps2, 0.0, 30.0) &&
                    core::above(jerk_mps3, 0.0, 1000.0) && core::above(climb_mps, 0.0, 30.0) &&
                    core::above(descent_mps, 0.0, 30.0);
    return ok ? Status::kOk : Status::kInvalidArgument;
  }
};

struct SmoothRequest {
  std::span<const Vector3> path_W{};  ///< At least two points; the first one is start.p_W.
  TrajectoryPoint start{};            ///< State at the instant when the trajectory takes over.
  MonotonicTime start_time{};
  MotionLimits limits{};
  double radius_m{};  ///< This box around every point of the curve must be free.
};

struct SmoothResult {
  Trajectory trajectory{};
  core::Work work{};  ///< units: map lookups.
};

class Smoother {
 public:
  /// Time is given by a trapezoidal speed profile along the path under the limits (corners slower), with a
  /// way-point where the final braking begins; the curve is then checked: too fast, and the segment gets more
  /// time; not free, and the straight piece below it gets one more way-point; still not, and the speed limit
  /// is lowered; from rest, the last resort is to fly the pieces straight and stop at each corner. kOk: every
  /// point of the trajectory keeps its box free in `view`, and speed, acceleration and jerk are
  /// within the limits (5 %; where the start state itself is beyond a limit, never more beyond than there).
  /// kNoPath: no such curve was found; kBudgetSpent; kInvalidArgument (not finite, fewer than two distinct
  /// points): in all three cases `result.trajectory` is untouched. Polls the budget before each solution and,
  /// while a curve is checked, every 1,024 lookups. RT-safe: at most 280 solutions of at most 47 segments.
  [[nodiscard]] Status smooth(const SmoothRequest& request, const MapView& view, core::StageBudget& budget,
                              SmoothResult& result) noexcept;

  /// The shortest stop along the present velocity within the limits of acceleration and jerk, or a
  /// hold at rest. Three segments, continuous up to acceleration: to the limit, at the limit, to zero.
  /// kInvalidArgument: not finite or speed above 50 m/s; `out` untouched. RT-safe: O(1).
  [[nodiscard]] Status brake(const TrajectoryPoint& start, MonotonicTime start_time,
                             const MotionLimits& limits, Trajectory& out) const noexcept;

 private:
  static constexpr std::size_t kMaxKnots = MinimumSnap::kMaxKnots;
  struct SpeedProfile;
  struct Plan {
    std::size_t count{};  ///< Knots.
    std::array<Vector3, kMaxKnots> knot_W;
    std::array<double, kMaxKnots> time_s;  ///< Of the segment that ends at the knot.
    std::size_t brake_knot{};              ///< Where the final braking begins.

    /// False if there is no room for another knot.
    [[nodiscard]] bool add(const Vector3& p_W, double duration_s) noexcept;
    [[nodiscard]] bool add_piece(const Vector3& from_W, const Vector3& to_W, const SpeedProfile& profile,
                                 bool last) noexcept;
  };

  /// What one call of smooth() works on.
  struct Task {
    const SmoothRequest& request;
    const PolledView& view;
    core::StageBudget& budget;
    core::Work& work;
  };
  using Path = core::StaticVector<Vector3, kMaxKnots>;

  [[nodiscard]] static bool allocate(std::span<const Vector3> path_W, const TrajectoryPoint& start,
                                     const MotionLimits& limits, Plan& plan) noexcept;
  [[nodiscard]] bool solve(const Plan& plan, const TrajectoryPoint& start, Trajectory& out) const noexcept;
  /// False if the limits cannot be met, or the budget is spent.
  [[nodiscard]] bool stretch_to_limits(const Task& task, const MotionLimits& limits, Plan& plan,
                                       Trajectory& out) const noexcept;
  /// One more way-point in the middle of the straight piece that a segment of the curve belongs to. False if
  /// there is no room for it.
  [[nodiscard]] static bool split(const Plan& plan, std::size_t segment, Path& path_W) noexcept;
  /// A free curve under these limits. kOk, kBudgetSpent, or kNoPath: slower, perhaps.
  [[nodiscard]] Status curve(const Task& task, const Path& path_W, const MotionLimits& limits,
                             Trajectory& out) const noexcept;
  /// The last resort from rest: straight pieces with a stop at each corner.
  [[nodiscard]] static Status straight_pieces(const Task& task, const Path& path_W, Trajectory& out) noexcept;

  MinimumSnap minimum_snap_;
};

/// Adds a straight piece from rest at `from_W` to rest at `to_W` within the limits, and makes its second half
/// the braking tail. False if there is no room for another segment. RT-safe: O(1).
[[nodiscard]] bool append_rest_to_rest(const Vector3& from_W, const Vector3& to_W, const MotionLimits& limits,
                                       Trajectory& trajectory) noexcept;

/// Seconds after its start up to which the curve, from `from_s` on, keeps its box free; +infinity if to its
/// end. `segment` (may be null) is set to the segment in which it does not. RT-safe: O(length / radius).
[[nodiscard]] double free_until_s(const MapView& view, const Trajectory& trajectory, double from_s,
                                  double radius_m, std::uint64_t& lookups,
                                  std::size_t* segment = nullptr) noexcept;
[[nodiscard]] inline bool is_trajectory_free(const MapView& view, const Trajectory& trajectory, double from_s,
                                             double radius_m, std::uint64_t& lookups,
                                             std::size_t* segment = nullptr) noexcept {
  return free_until_s(view, trajectory, from_s, radius_m, lookups, segment) ==
         std::numeric_limits<double>::infinity();
}

}  // namespace roborun::stages
