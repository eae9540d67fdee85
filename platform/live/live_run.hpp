/// The runtime on real time, and at its far end a vehicle: sensors, bus and lines that other processes write.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/sensor_rig.hpp"
#include "firmware_if/mavlink/companion.hpp"
#include "platform/flight/flight_config.hpp"
#include "platform/live/bus_wire.hpp"
#include "platform/live/far_end.hpp"
#include "platform/live/ground.hpp"
#include "platform/live/link.hpp"
#include "platform/live/mission_route.hpp"
#include "platform/log/log_viewer.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::live {

struct LiveConfig {
  flight::FlightConfig flight{};  ///< Whole: vehicle, rig's numbers, bounds, goal, cruise height, prices.
  SensorRig rig{};
  Link link{};
  BusLines lines{};  ///< Of a vehicle on a CAN bus.
  std::optional<firmware_if::mavlink::Companion::Config>
      autopilot{};  ///< If and only if the link is a MAVLink one; `flight` is as it flies.
  std::optional<sensor_port::EarthPlace>
      origin{};           ///< Of the world; none: where the vehicle has its first fix.
  GroundConfig ground{};  ///< Who may give another goal in flight.
  std::optional<firmware_if::mavlink::SecretKey> key{};  ///< Of all links; none: nothing is signed.
  std::optional<Route> route{};                          ///< Of a mission; flight.goal_W is its first goal.
  double seconds{3600.0};                                ///< Then it lands where it is.
  double wait_s{5.0};                                    ///< For what is missing at the start.
  std::string log{};         ///< File for the log of the flight; empty: none. It does not replay.
  log::LogViewer* viewer{};  ///< Of that log; may be null, outlives the flight.
  bool best_effort{false};   ///< As rt::LaneSetConfig.
  std::function<std::string()> confine{};  ///< As rt::LaneSetConfig.
  std::function<bool()> stop{};  ///< Asked twenty times a second: true: it lands where it is. May be empty.
};

struct LiveProgress {
  double time_s{}, to_goal_m{}, speed_mps{};
  double height_m{};  ///< World frame.
  std::uint64_t decisions{};
  const char* doing{};   ///< Phase of the flight.
  const char* action{};  ///< Of the failsafe.
};

/// What there is to say about the autopilot at the end.
struct LiveAutopilot {
  std::string stage, reason, subject, text;  ///< `text`: what it said last.
  std::uint64_t set_points{}, not_sent{}, jumps{}, reboots{};
  /// Of set-points: from the validity of the newest state until they were written.
  double median_s{}, p99_s{}, max_s{};
  double clock_error_s{};  ///< At most: half of the shortest way there and back.
};

/// What became of a mission.
struct LiveRoute {
  std::size_t steps{}, done{};
  std::uint64_t released{};  ///< Packages, as the vehicle confirmed.
};

struct LiveReport {
  bool ready{};             ///< False: nothing was armed, and the rest is empty.
  std::vector<Need> needs;  ///< The readiness list as it was last.
  bool reached_goal{};      ///< By the vehicle's own estimate.
  /// "reached_goal", "no_way", "goal_blocked", "gave_up", "time_limit", "interrupted", "holding"; "landed", "terminated" and
  /// "killed" where the failsafe ended it; "stopped: SLOT" where an overrun did. With an autopilot: "pilot" (its mode was changed, or it
  /// was disarmed), "refused" (it does not do what is needed), "lost" (silent for 10 s): nothing was sent from then on.
  std::string reason;
  std::string
      ended;  ///< How: "on the ground", "landed", "motors off", "the pilot's", "the autopilot's", or "in the air" after an overrun.
  double time_s{};      ///< From the first release of the lanes to the goal, or to the end.
  double distance_m{};  ///< Flown, by the estimate.
  std::uint64_t decisions{};
  std::uint64_t near_brakes{};  ///< Between two decisions, for what was near in the way.
  std::uint64_t deadline_misses{}, heap_calls_after_start{}, page_faults{};
  std::vector<std::pair<std::string, std::uint64_t>> lane_misses;  ///< The deadline misses, by lane.
  std::vector<PortUse> ports;
  std::optional<LiveAutopilot> autopilot;
  std::optional<LiveRoute> route;
  std::uint64_t goals_given{}, goals_refused{};  ///< By somebody on the ground.
  std::vector<std::string> missing;              ///< What real time lacks here.
  std::string log_error;                         ///< Empty, or one line: what is missing in the log.
  /// What the failsafe did: seconds, action, and for which conditions.
  struct Event {
    double time_s{};
    std::string action, conditions;
  };
  std::vector<Event> events;
};

/// Looks until everything is there, at most wait_s long, then flies: up, to the goal, and down there. However it ends, it comes down
/// before the report, and the last that is sent are zeros. Throws InputError for a flight that cannot be made, and if this machine cannot
/// run it in real time and best_effort is off. Under systemd as mission::run_real_time().
[[nodiscard]] LiveReport run_live(const LiveConfig& config,
                                  const std::function<void(const std::vector<Need>&)>& waiting,
                                  const std::function<void(const LiveProgress&)>& progress);

}  // namespace roborun::live
