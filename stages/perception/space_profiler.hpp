/// The profiling variables of RoboRun, from one point cloud, the map and the committed trajectory.
#pragma once

#include <span>

#include "core/executive/stage_budget.hpp"
#include "core/geometry/vector.hpp"
#include "core/range.hpp"
#include "core/space_profile.hpp"
#include "core/trajectory.hpp"
#include "core/vehicle_model.hpp"
#include "stages/perception/map_view.hpp"
#include "stages/perception/point_cloud.hpp"

namespace roborun::stages {

struct SpaceProfilerConfig {
  double vehicle_width_m{2.0 * VehicleModel{}.radius_m};  ///< A gap narrower than this is no gap. (0, 20]
  double widest_gap_m{20.0};  ///< A gap wider than this does not ask for precision. (vehicle width, 1000]
  double gap_reach_m{15.0};   ///< Obstacles farther than this belong to a later decision. (0, 1000]
  /// Points this much above or below the vehicle can stand in its way. (0, 100]
  double height_band_m{1.5};
  /// Spacing of the samples along the trajectory (doubled until they fit). [0.001, 60]
  double outlook_step_s{0.25};
  double max_visible_m{25.0};  ///< The range of the cameras. (0, 1000]
  [[nodiscard]] constexpr Status validate() const noexcept {
    const bool ok = core::above(vehicle_width_m, 0.0, 20.0) &&
                    core::above(widest_gap_m, vehicle_width_m, 1000.0) &&
                    core::above(gap_reach_m, 0.0, 1000.0) && core::above(height_band_m, 0.0, 100.0) &&
                    core::within(outlook_step_s, 0.001, 60.0) && core::above(max_visible_m, 0.0, 1000.0);
    return ok ? Status::kOk : Status::kInvalidArgument;
  }
};

/// Of a cloud, what profile_space() asks for: without the rest its figures are the same.
[[nodiscard]] CloudNeed needed_points(const SpaceProfilerConfig& config, const Vector3& p_WB,
                                      const Aabb& relevant_W) noexcept;

/// Gaps: the points in the height band are sorted into 72 sectors of 5 degrees, the nearest point of each
/// kept. Neighbouring sectors whose ranges differ by less than 3 m show one obstacle; between all others
/// there is a gap: the distance of their points, counted if the vehicle fits through and it is not wider than
/// widest_gap_m. None: +infinity. Closest obstacle: nearest point within `relevant_W` (where the vehicle may
/// be, grown by its radius), +infinity if none; obstacle ahead: the same within 45 degrees of the way to
/// goal_W. Closest unknown: free distance in `view` ahead along v_WB, at rest towards goal_W; at most
/// max_visible_m. Outlook: up to 32 samples of the trajectory from `now` to its end, each with the free
/// distance along its motion there. `work.units` grows by the map cells visited. The budget is polled every
/// 1,024 points and lookups; once it is spent (kBudgetSpent, otherwise kOk) what has not been looked at
/// counts as near: distances 0, a gap as narrow as the vehicle.
/// Precondition, asserted: config.validate() is kOk. RT-safe: O(points + samples * range / cell).
[[nodiscard]] Status profile_space(const SpaceProfilerConfig& config, std::span<const CloudPoint> points,
                                   const MapView& view, const Trajectory& committed, MonotonicTime now,
                                   const Vector3& p_WB, const Vector3& v_WB, const Vector3& goal_W,
                                   const Aabb& relevant_W, double radius_m, SpaceProfile& profile,
                                   core::StageBudget& budget, core::Work& work) noexcept;

}  // namespace roborun::stages
