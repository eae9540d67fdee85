/// What the governor grants the stages for one decision: the knobs of RoboRun Table "Knob values".
#pragma once

#include "core/precision.hpp"
#include "firmware_if/time.hpp"

namespace roborun {

struct OperatingPoint {
  int p0_level{0};    ///< Point cloud and map: cell_size_m(p0_level).
  int p1_level{0};    ///< Map export and planner (p1 = p2), >= p0_level.
  double v0_m3{0.0};  ///< Space integrated into the map.
  double v1_m3{0.0};  ///< Space exported to the planner.
  double v2_m3{0.0};  ///< Space the planner may explore.
  Nanos deadline{0};  ///< From the start of the decision to the instant the new trajectory takes over.
  double speed_limit_mps{0.0};  ///< |v_WB| of the next trajectory.
};

}  // namespace roborun
