/// A whole mission in lockstep virtual time: world, vehicle, sensors, flight lane and decision lane.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/executive/cost_profile.hpp"
#include "core/executive/frame_table.hpp"
#include "core/geometry/fence.hpp"
#include "core/trajectory.hpp"
#include "governor/failsafe/arbiter.hpp"
#include "governor/policy/governor.hpp"
#include "platform/report/mission_result.hpp"
#include "platform/sitl/fault/fault_line.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"
#include "platform/sitl/sensors/navigation_sensors.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::app {

/// What there is to see after one minor frame.
struct FrameRecord {
  MonotonicTime now{};
  const sitl::VehicleState& truth;
  const Trajectory& committed;
  bool airborne{};
};

/// A fault, and when it begins.
struct TimedFault {
  sitl::Fault fault{};
  std::optional<governor::Phase> phase{};  ///< Time counts from the first moment of this phase; none: from 0.
  double at_s{0.0};
  double for_s{1e6};
};

struct MissionConfig {
  governor::Design design{governor::Design::kAware};
  std::string profile_name{"paper"};
  core::CostProfile costs{};
  governor::KnobArray<governor::LatencyModel> model{};
  std::uint64_t seed{1};
  std::string map_backend{"own"};      ///< "own" or "octomap".
  std::string planner_backend{"own"};  ///< "own" or "ompl:NAME".
  double v_max_mps{6.0};
  Nanos minor_frame{core::kMinorFrame};  ///< core::minor_frame_of() a legal rate.
  sitl::DepthCameraConfig camera{};
  sitl::NavigationSensorsConfig sensors{};
  sitl::VehicleConfig vehicle{};
  sitl::WindConfig wind{};
  double slow_down_at_s{
      1e300};  ///< From then on computing takes slow_down_factor times as long: a throttled CPU.
  double slow_down_factor{1.0};
  double time_limit_s{7200.0};
  core::Fence fence{};               ///< Start and goal must be inside.
  std::vector<TimedFault> faults{};  ///< At most sitl::FaultLine::kMost.
  bool answers{true};  ///< False: the failsafe and the kill switch do nothing. To show that a fault matters.
  std::string record;  ///< File for the recording of the flight; empty: none.
  double no_progress_s{120.0};  ///< Not nearer to the goal for so long: the mission is given up, hovering.
  /// Called after every minor frame, may be empty: what a test measures.
  std::function<void(const FrameRecord&)> each_frame{};
};

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
/// profile are left to the caller. Throws sitl::InputError for an unknown backend, and for a recording that
/// cannot be written, or whose flight has faults that no recording holds (FlightRecorder).
[[nodiscard]] report::MissionReport fly_mission(const sitl::World& world, const MissionConfig& config,
                                                const std::function<void(const Progress&)>& progress);

}  // namespace roborun::app
