/// What a simulated mission depends on besides its world, by who reads it.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/trajectory.hpp"
#include "governor/failsafe/arbiter.hpp"
#include "platform/board/backends.hpp"
#include "platform/flight/flight_config.hpp"
#include "platform/log/log_viewer.hpp"
#include "platform/mission/autopilot_choice.hpp"
#include "platform/mission/route.hpp"
#include "platform/mission/setting_change.hpp"
#include "platform/report/mission_result.hpp"
#include "platform/sitl/aircraft/simulated_aircraft.hpp"
#include "platform/sitl/fault/fault_line.hpp"
#include "platform/sitl/world/world.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::mission {

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
  double every_s{0.0};  ///< Begins again each so often; 0: once. Else more than for_s.
};

/// Goals that are given in flight, in the place of those that are not answered yet.
struct GivenGoals {
  double at_s{0.0};
  std::vector<Vector3> goals_W{};  ///< In order; flight::GoalQueue::kMost at most.
};

/// A processor that is throttled in flight.
struct SlowDown {
  /// From then on computing takes `factor` times as long; +infinity: never.
  double at_s{std::numeric_limits<double>::infinity()};
  double factor{1.0};
  [[nodiscard]] double slower(MonotonicTime now) const noexcept {
    return seconds(now.time_since_epoch()) >= at_s ? factor : 1.0;
  }
};

/// What a log says of a flight that was to fulfil something.
struct LogVerdict {
  bool passed{};
  std::string json;  ///< The message of `/verdict`.
  std::string text;  ///< The same for people, one line.
};

/// When the judge ends a mission.
struct JudgeConfig {
  /// How far from the goal it has arrived. More than the default: and where it believes to be within the default, because no
  /// navigation is better than its drift.
  double goal_within_m{1.0};
  double time_limit_s{7200.0};
  double no_progress_s{
      120.0};  ///< Neither nearer to the goal nor far from where it was for so long: it is given up, hovering.
};

struct MissionConfig {
  std::string profile_name{"paper"};  ///< A label, for reports.
  std::uint64_t seed{1};              ///< Of the planner, and of all noise, faults and gusts.
  flight::FlightConfig flight{};      ///< What the world gives (bounds, goal, height) is filled in from it.
  board::BackendNames backends{};
  board::OwnParts
      own{};  ///< In the place of backends and governor; the log of such a flight does not replay.
  sitl::SimulatorConfig simulator{};
  /// What the stages cost on the machine that simulates, if that is known: a second price, beside flight.costs,
  /// of the work that map and planner say they did (work_check.hpp).
  std::optional<core::CostProfile> host_costs{};
  double host_factor{1.0};  ///< flight.costs are so many times those of the machine that was measured.
  std::optional<AutopilotChoice> autopilot{};  ///< Who flies the vehicle; none: the runtime, to the motors.
  SlowDown slow_down{};
  SettingChange change{};  ///< Goes without `route` and own.policy.
  JudgeConfig judge{};
  std::optional<Route> route{};      ///< Flown in the place of the world's goal; goes without `goals`.
  std::vector<GivenGoals> goals{};   ///< Besides the world's, by time.
  std::vector<TimedFault> faults{};  ///< At most sitl::FaultLine::kMost.
  std::string log{};                 ///< File for the log of the flight; empty: none.
  /// Gets the messages of a log as they come, but no inputs, with a file or without; null: nobody.
  log::LogViewer* viewer{nullptr};
  std::string
      source{};  ///< For the log: the files and options it is flown by, a JSON object that its maker reads; or empty.
  /// For the log: what the one who judges the flight says of it when it has ended; empty: nobody does.
  std::function<LogVerdict(const report::MissionReport&)> judged{};
  bool keep_known{false};  ///< report.known, at the height of the world's start.
  /// Called after every minor frame, may be empty: what a test measures.
  std::function<void(const FrameRecord&)> each_frame{};
};

/// Where a flight may be, where to, and how high it begins.
struct FlightSpace {
  Aabb bounds_W{};
  Vector3 goal_W = Vector3::Zero();
  double cruise_m{};
};
/// As below, without a look at the world.
[[nodiscard]] flight::FlightConfig flight_config_in(const FlightSpace& space, const MissionConfig& config);
/// The flight through `world`: its bounds, its goal, the height of its start, and the rest from `config`.
/// Throws InputError for a rig that cannot be, and for a vehicle that has no room (sitl::why_no_room).
[[nodiscard]] flight::FlightConfig flight_config_of(const sitl::World& world, const MissionConfig& config);
/// This vehicle flies the mission.
void set_vehicle(MissionConfig& config, const vehicle::Vehicle& vehicle);
/// Where the vehicle stands before the flight: on the first surface below the start.
[[nodiscard]] Vector3 ground_below(const sitl::World& world);
/// One line for each goal that the battery cannot reach, however it is flown: straight on at the vehicle's full speed
/// more than what is left when the failsafe turns back is used.
[[nodiscard]] std::vector<std::string> beyond_reach(const sitl::World& world, const MissionConfig& config);
/// Of the images that the map will get.
[[nodiscard]] board::ImageLimits image_limits(const MissionConfig& config);
/// "time" or "energy"; anything else: none.
[[nodiscard]] std::optional<governor::Aim> aim_named(const std::string& name);
/// The same. Throws InputError that names the option.
[[nodiscard]] governor::Aim aim_of(const char* option, const std::string& name);
/// "aware", "static" or "static-fair". Throws InputError that names the option.
[[nodiscard]] governor::Design design_of(const char* option, const std::string& name);

}  // namespace roborun::mission
