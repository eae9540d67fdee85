/// Depth in, OBSTACLE_DISTANCE out, and no command but a speed limit where that is asked for: the pilot flies, and the autopilot's own
/// avoidance sees what the cameras see.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/sensor_rig.hpp"
#include "core/stopping_model.hpp"
#include "platform/live/far_end.hpp"
#include "platform/live/link.hpp"

namespace roborun::live {

/// No faster than it can stop within what is known to be free where it flies: at most 45 degrees beside its velocity, and slower than
/// 0.5 m/s all around. Unknown is not free.
struct GuardSpeedLimit {
  StoppingModel stopping{};
  double radius_m{};
  double v_max_mps{};
  /// From a look to the brake: image, period of the messages, the autopilot's answer.
  static constexpr double kLatency_s = 0.5;
  static constexpr double kLeast_mps = 1.0;  ///< So that it can be flown where nobody looks.
  [[nodiscard]] double speed_mps(double clear_m) const noexcept;
};

struct GuardConfig {
  SensorRig rig{};
  Link link{};
  double band_m{};                         ///< Above and below the vehicle's middle: what it may hit.
  std::optional<GuardSpeedLimit> limit{};  ///< None: nothing is commanded.
  double seconds{};
  double wait_s{};
  std::function<bool()> stop{};  ///< May be empty.
};

struct GuardReport {
  bool ready{};             ///< False: nothing was sent, and the rest is empty.
  std::vector<Need> needs;  ///< Of the cameras.
  double time_s{};
  std::uint64_t messages{}, not_sent{};
  double nearest_m{};                 ///< Of all that was seen; +infinity: nothing.
  std::uint64_t limits{};             ///< Speed limits sent.
  std::optional<double> limit_mps{};  ///< The last one.
  std::vector<PortUse> ports;
};

/// At 10 Hz, heartbeat once a second by the same loop. `progress`: about four times a second, the nearest hit of now; may be empty.
/// Answers questions of the clock, so that the autopilot can place the stamps. Throws InputError for a rig without a camera.
[[nodiscard]] GuardReport run_guard(const GuardConfig& config,
                                    const std::function<void(double time_s, double nearest_m)>& progress);

}  // namespace roborun::live
