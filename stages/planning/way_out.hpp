/// How a vehicle leaves a place where plans have no room: beside a surface that was noted after it had stopped there.
#pragma once

#include "core/executive/stage_budget.hpp"
#include "core/geometry/vector.hpp"
#include "core/trajectory.hpp"
#include "stages/perception/map_view.hpp"
#include "stages/planning/smoother.hpp"

namespace roborun::stages {

/// A view in which the box where a vehicle stands is free: nothing else is there. What a surface has in common with it
/// does not hold the vehicle, and no more of any surface becomes free: from there a box can only move away from it, or
/// along it. The contract of MapView holds if it does for `view`, which must outlive it.
class StandingView final : public MapView {
 public:
  StandingView(const MapView& view, const Aabb& standing_W) noexcept : view_(view), standing_W_(standing_W) {}

  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return view_.is_free(box_W, lookups) || is_rest_free(box_W, lookups);
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return is_free(box_W, lookups);
  }
  [[nodiscard]] CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    return view_.at(p_W, lookups);
  }
  [[nodiscard]] double cell_m() const noexcept override { return view_.cell_m(); }
  [[nodiscard]] double finest_m() const noexcept override { return view_.finest_m(); }

 private:
  /// What of the box is not where the vehicle stands.
  [[nodiscard]] bool is_rest_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept;

  const MapView& view_;
  Aabb standing_W_;
};

struct WayOutRequest {
  Vector3 start_W = Vector3::Zero();  ///< At rest.
  MonotonicTime start_time{};
  Aabb bounds_W{};        ///< The end is inside.
  MotionLimits limits{};  ///< Of the trajectory.
  double
      body_m{};  ///< Radius of the vehicle: nothing that is not free comes nearer to it than this, or than it is.
  double room_m{};  ///< Radius that is free at a place with room.
};

/// A straight line to the nearest place with room, at most 2 m away, from rest to rest; if none can be reached, but the vehicle's
/// box touches something, to the nearest place where the vehicle's own radius is free. `known` is the map at its finest,
/// `view` what plans are made in. On the way the vehicle's box leaves what it touches (StandingView), and of what is
/// inside the vehicle's radius everything comes no nearer. False, and `out` untouched, if there is none, or if the budget
/// is spent. RT-safe: at most 2 * 20 * 26 lines.
[[nodiscard]] bool find_way_out(const WayOutRequest& request, const MapView& view, const MapView& known,
                                core::StageBudget& budget, core::Work& work, Trajectory& out) noexcept;

}  // namespace roborun::stages
