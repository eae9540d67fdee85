/// Straight pieces and turns along given points: one round of the smoother.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/memory/static_vector.hpp"
#include "core/trajectory.hpp"
#include "stages/planning/smoother.hpp"
#include "stages/planning/speed_change.hpp"

namespace roborun::stages {

/// A path, and how it is to be flown.
struct Course {
  static constexpr std::size_t kMaxPoints = Smoother::kMaxPoints;
  core::StaticVector<Vector3, kMaxPoints> point_W;
  /// Of the room of each corner, what its turn may take. 0: a stop.
  std::array<double, kMaxPoints> share{};
  /// Of the speed limit, what the first change may lead to. 0: a stop at first, and the path begins there.
  double start_share{1.0};
};

/// Which part of the course a segment belongs to. 0: the change out of the start state; 2 i - 1: the straight piece to
/// point i; 2 i: the turn at it.
using SegmentParts = std::array<std::uint8_t, Trajectory::kMaxSegments>;

enum class CurveFit : std::uint8_t {
  kOk,
  kTooFast,       ///< The start state leaves no room for the first corner or the end.
  kTooManyPoints  ///< More segments than a trajectory has.
};

/// Makes the trajectory of this course: its segments and where the final braking begins. Whether it is free is not checked.
/// RT-safe: O(points), each with a bounded number of halvings.
[[nodiscard]] CurveFit fit_curve(const Course& course, const TrajectoryPoint& start,
                                 const MotionLimits& limits, Trajectory& out, SegmentParts& part) noexcept;

}  // namespace roborun::stages
