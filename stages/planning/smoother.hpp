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

namespace roborun::stages {

struct MotionLimits {
  double speed_mps{VehicleModel{}.speed_mps};  ///< (0, 30]
  double acceleration_mps2{
      VehicleModel{}.acceleration_mps2};       ///< (0, 30]. |a| along the whole trajectory, braking included.
  double jerk_mps3{VehicleModel{}.jerk_mps3};  ///< (0, 1000]. Beyond it the vehicle overshoots the attitude.
  double climb_mps{30.0};                      ///< (0, 30]. Upwards ...
  double descent_mps{30.0};                    ///< (0, 30]. ... and downwards.
  double vertical_mps2{30.0};     ///< (0, 30]. Of the acceleration, what is up or down on legs and in turns.
  double speeding_up_mps2{30.0};  ///< (0, 30]. Of it, what the speed may rise with on straight pieces.
  [[nodiscard]] constexpr Status validate() const noexcept {
    const bool ok = core::above(speed_mps, 0.0, 30.0) && core::above(acceleration_mps2, 0.0, 30.0) &&
                    core::above(jerk_mps3, 0.0, 1000.0) && core::above(climb_mps, 0.0, 30.0) &&
                    core::above(descent_mps, 0.0, 30.0) && core::above(vertical_mps2, 0.0, 30.0) &&
                    core::above(speeding_up_mps2, 0.0, 30.0);
    return ok ? Status::kOk : Status::kInvalidArgument;
  }
};

struct SmoothRequest {
  std::span<const Vector3> path_W{};  ///< At least two points; the first one is start.p_W.
  TrajectoryPoint start{};            ///< State at the instant when the trajectory takes over.
  MonotonicTime start_time{};
  MotionLimits limits{};
  double radius_m{};  ///< A ball around every point of the curve that must be free.
};

struct SmoothResult {
  Trajectory trajectory{};
  core::Work work{};  ///< units: map lookups.
};

class Smoother {
 public:
  /// The path in straight pieces and turns, in closed form (speed_change.hpp): a turn begins as far before its corner as the
  /// room on both sides allows and keeps its speed at both ends, and between turns the speed goes up and down again as late
  /// as it can. The first change leads from the start state onto a straight line to the next point. What is not free in
  /// `view` is tried again, tighter at that corner, at last with a stop there; at the start slower, at last after a
  /// stop on the line of the present velocity. kOk: every point of the trajectory keeps its box free in `view`; speed,
  /// acceleration and jerk are within the limits (where the start state is beyond a limit, never more beyond than the
  /// jerk limit makes necessary); it ends at the last point of the path, or at one before where there are more
  /// points than a trajectory has segments for.
  /// kNoPath: no such curve was found; kBudgetSpent; kInvalidArgument (not finite, fewer than two distinct
  /// points): in all three cases `result.trajectory` is untouched. Polls the budget before each round and,
  /// while a curve is checked, every 1,024 lookups. RT-safe: at most kRounds curves.
  [[nodiscard]] Status smooth(const SmoothRequest& request, const MapView& view, core::StageBudget& budget,
                              SmoothResult& result) noexcept;

  /// The shortest stop along the present velocity within the limits of acceleration and jerk, or a
  /// hold at rest. Three segments, continuous up to acceleration: to the deceleration that is reached, which is below
  /// the limit where the speed is low, at it, to zero. A stop from the middle of a stop ends no later than that one (along a line; across,
  /// about then). kInvalidArgument: not finite or speed above 50 m/s; `out` untouched. RT-safe: O(1).
  [[nodiscard]] Status brake(const TrajectoryPoint& start, MonotonicTime start_time,
                             const MotionLimits& limits, Trajectory& out) const noexcept;

  static constexpr std::size_t kMaxPoints =
      16;  ///< Of a path, the start included; what is beyond is left out.
  static constexpr int kRounds = 40;
};

/// Adds a straight piece from rest at `from_W` to rest at `to_W` within the limits, and makes its second half
/// the braking tail. False if there is no room for another segment. RT-safe: O(1).
[[nodiscard]] bool append_rest_to_rest(const Vector3& from_W, const Vector3& to_W, const MotionLimits& limits,
                                       Trajectory& trajectory) noexcept;

/// Seconds after its start up to which the curve, from `from_s` on, keeps its box free; +infinity if to its
/// end. RT-safe: O(length / radius).
[[nodiscard]] double free_until_s(const MapView& view, const Trajectory& trajectory, double from_s,
                                  double radius_m, std::uint64_t& lookups) noexcept;
[[nodiscard]] inline bool is_trajectory_free(const MapView& view, const Trajectory& trajectory, double from_s,
                                             double radius_m, std::uint64_t& lookups) noexcept {
  return free_until_s(view, trajectory, from_s, radius_m, lookups) == std::numeric_limits<double>::infinity();
}

}  // namespace roborun::stages
