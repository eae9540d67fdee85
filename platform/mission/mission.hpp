/// A whole mission in lockstep virtual time: world, vehicle, sensors, flight lane and decision lane.
#pragma once

#include <functional>

#include "platform/mission/mission_config.hpp"
#include "platform/report/mission_result.hpp"

namespace roborun::mission {

struct Progress {
  double time_s{};
  double done_ratio{};
  double speed_mps{};
};

/// Flies from the world's start (on the ground) to its goal. Deterministic: the same config, world and build
/// give the same report, but for real_time_factor. `progress` (may be empty) is called about once a second of
/// virtual time. A failsafe ends a mission as "landed", "holding" (hovers for 5 s), "terminated" or "killed"
/// (motors off, on the ground); a touch-down of at most 2 m/s is no collision. A contact with a moving body
/// is a "collision" if the vehicle's own velocity towards its centre is above 0.3 m/s, and otherwise ends the
/// mission as "struck": the body ran into the vehicle. result.env, mission and
/// profile are left to the caller. Throws InputError for an unknown backend, and for a log that cannot be begun; one
/// that cannot be written on does not end the flight (MissionReport::log_error).
[[nodiscard]] report::MissionReport fly_mission(const sitl::World& world, const MissionConfig& config,
                                                const std::function<void(const Progress&)>& progress);

}  // namespace roborun::mission
