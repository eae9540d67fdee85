/// Notices what moves near the vehicle: surfaces where the map knew free space.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "core/depth_error.hpp"
#include "core/executive/stage_budget.hpp"
#include "core/geometry/vector.hpp"
#include "core/memory/static_vector.hpp"
#include "firmware_if/time.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/perception/point_cloud.hpp"

namespace roborun::flight {

/// Of points that such images were made into: the worst of all. A cloud's stand in the middle of their pixels, which are wide.
[[nodiscard]] DepthError point_error(std::span<const stages::PosedDepthFrame> frames) noexcept;

/// RT-safe: O(points of the cloud), no allocation.
class MotionWatch {
 public:
  static constexpr double kReach_m = 15.0;  ///< Farther away depth noise looks like motion.
  static constexpr std::size_t kTraces = 64;
  using Places = core::StaticVector<Vector3, kTraces>;

  struct Input {
    MonotonicTime now{};
    Vector3 p_WB = Vector3::Zero();
    Vector3 v_WB = Vector3::Zero();
    double stop_m{0.0};  ///< Way to a stop from there.
    Aabb relevant_W{};   ///< What moves outside of it does not matter.
    DepthError error{};  ///< Of the depths; where the vehicle is believed to be was as wrong a moment ago.
  };

  /// Compares the cloud of this decision with the map before it gets the same images, and with the images that it was given a
  /// moment ago. What is behind the vehicle is no motion: who is followed must not slow down. `work.units` counts map lookups.
  void sense(const Input& in, std::span<const stages::CloudPoint> points, const stages::OccupancyMap& map,
             core::StageBudget& budget, core::Work& work) noexcept;
  /// Centres of what appeared in space known to be free, in the last decision that was sensed.
  [[nodiscard]] std::span<const Vector3> appeared_W() const noexcept {
    return {appeared_W_.begin(), appeared_W_.size()};
  }
  /// Something appeared near ahead within the last seconds: too near to wait until it is known whether it moves, and how.
  [[nodiscard]] bool startled(MonotonicTime now) const noexcept { return now < startled_until_; }
  /// Where something was seen to move, for as long as the map may remember what has gone.
  [[nodiscard]] Places places_W(MonotonicTime now) const noexcept;

 private:
  static constexpr double kNear_m = 6.0;
  struct Trace {
    Vector3 p_W = Vector3::Zero();
    MonotonicTime until{};
  };
  MonotonicTime startled_until_{};
  std::array<Trace, kTraces> trace_{};  ///< A ring.
  std::size_t next_trace_{0};
  core::StaticVector<Vector3, kTraces / 4> appeared_W_;
};

}  // namespace roborun::flight
