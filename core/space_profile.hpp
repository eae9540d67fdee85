/// What the stages observed of the space around the vehicle. Source: RoboRun Table "Profiling variables".
#pragma once

#include <array>
#include <cstddef>

namespace roborun {

/// One point of the committed trajectory, for Algorithm 1.
struct TrajectoryOutlook {
  double time_s{};     ///< From now, >= 0, ascending.
  double speed_mps{};  ///< |v_WB| there.
  double visible_m{};  ///< Free distance ahead of it along its motion before the first cell not known free.
};

struct SpaceProfile {
  static constexpr std::size_t kMaxOutlook = 32;

  double gap_average_m{};  ///< Mean gap between neighbouring obstacles in view; +inf if fewer than two.
  /// Distance from the vehicle's centre to the nearest surface; +inf if none in view.
  double closest_obstacle_m{};
  /// Visibility d: free distance ahead along the motion (or towards the goal at rest).
  double closest_unknown_m{};
  double sensor_volume_m3{};  ///< Space that the depth images of this decision see.
  double map_volume_m3{};     ///< Known space (free or occupied) in the map.
  double speed_mps{};         ///< |v_WB| of the vehicle now.
  std::array<TrajectoryOutlook, kMaxOutlook> outlook{};
  std::size_t outlook_count{};
};

}  // namespace roborun
