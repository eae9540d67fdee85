/// Depth in, OBSTACLE_DISTANCE out, and no command at all: the pilot flies, and the autopilot's own avoidance sees what the cameras see.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/sensor_rig.hpp"
#include "platform/live/far_end.hpp"
#include "platform/live/link.hpp"

namespace roborun::live {

struct GuardConfig {
  SensorRig rig{};
  Link link{};
  double band_m{};  ///< Above and below the vehicle's middle: what it may hit.
  double seconds{};
  double wait_s{};
  std::function<bool()> stop{};  ///< May be empty.
};

struct GuardReport {
  bool ready{};             ///< False: nothing was sent, and the rest is empty.
  std::vector<Need> needs;  ///< Of the cameras.
  double time_s{};
  std::uint64_t messages{}, not_sent{};
  double nearest_m{};  ///< Of all that was seen; +infinity: nothing.
  std::vector<PortUse> ports;
};

/// At 10 Hz, heartbeat once a second by the same loop. `progress`: about four times a second, the nearest hit of now; may be empty.
/// Answers questions of the clock, so that the autopilot can place the stamps. Throws InputError for a rig without a camera.
[[nodiscard]] GuardReport run_guard(const GuardConfig& config,
                                    const std::function<void(double time_s, double nearest_m)>& progress);

}  // namespace roborun::live
