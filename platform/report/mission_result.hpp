/// What a mission was: the fields of `roborun fly --json`, and the records behind them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/executive/stage_budget.hpp"
#include "core/geometry/vector.hpp"

namespace roborun::report {

struct LatencySummary {
  double median{}, p99{}, max{};
};
struct PrecisionSummary {
  double min{}, median{}, max{};
};

/// What a flight of a suite of worlds has besides.
struct SuiteFlight {
  bool possible{};      ///< The judge of ways finds one.
  double shortest_m{};  ///< Its length; NaN without a way.
  std::string command;  ///< That flies it again.
};

/// One goal of several, and what became of it.
struct GoalRecord {
  Vector3 goal_W = Vector3::Zero();
  std::string answer;  ///< reached, goal_blocked, no_way, replaced, refused, or why the mission ended before.
  double time_s{};     ///< Of the answer.
  double distance_m{};  ///< From the vehicle then.
};

/// Images of one sensor that were not believed, for one reason.
struct RefusedRecord {
  std::string sensor;  ///< camera 1, lidar 2, counted from 1.
  std::string reason;  ///< A stages::FrameFault's name.
  std::uint64_t images{};
};

/// Names and order are those of the JSON object.
struct MissionResult {
  std::string design;
  std::string profile;
  std::string env;
  std::uint64_t seed{};
  bool reached_goal{};
  bool collided{};
  double mission_time_s{};
  double distance_m{};
  double mean_velocity_mps{};
  double max_velocity_mps{};
  double energy_kJ{};
  std::uint64_t decisions{};
  std::uint64_t deadline_misses{};
  LatencySummary latency_s{};
  double cpu_s{};
  double cpu_utilization_ratio{};
  PrecisionSummary precision_m{};
  double real_time_factor{};
  std::uint64_t map_bytes{};
  std::string state_hash;  ///< 16 hexadecimal digits.
  std::string map;
  std::string planner;
  std::string ways;
  std::string mission;
  std::string reason;        ///< Why the mission ended.
  double speed_limit_mps{};  ///< v_max of the design.
  double
      flight_Jpm{};  ///< Of energy_kJ, what the rotors took, per metre of distance_m; +infinity without one.
  double computing_Jpm{};  ///< The rest: computer, sensors, autopilot (power.avionics_W), per metre.
  bool believed{true};     ///< False: a plugin took more time than the work that it counted is worth.
  /// Of a plan; another key, or none.
  struct RouteRecord {
    std::size_t steps{}, done{};
    std::uint64_t released{};  ///< Packages.
  };
  std::optional<RouteRecord> route;
  std::vector<GoalRecord> goals;  ///< One more key, or none: a mission with the world's goal alone.
  /// By sensor, then reason; in JSON {"camera 1": {"fog": 3}}.
  std::vector<RefusedRecord> refused;
  std::uint64_t near_brakes{};       ///< Braked between two decisions, for what was near in the way.
  std::uint64_t map_drops{};         ///< The map was dropped: what was seen lay elsewhere.
  std::optional<SuiteFlight> suite;  ///< Three more keys, or none.
};

/// One decision, for traces and plots.
struct DecisionRecord {
  double time_s{};
  Vector3 p_WB = Vector3::Zero();
  double speed_mps{};
  double p0_m{};
  double p1_m{};
  double v0_m3{};
  double v1_m3{};
  double v2_m3{};
  double time_budget_s{};
  std::string budget_source;
  std::string speed_source;
  double deadline_s{};
  double latency_s{};
  std::array<double, core::kStageCount> stage_s{};  ///< Spent.
  std::array<double, core::kStageCount> predicted_s{};
  std::string solver;  ///< Status of the solver.
  std::string active;  ///< Names of the active constraints and reasons, with + between.
  double demand_m{};   ///< Coarsest cell that the space allows.
  double speed_limit_mps{};
  double visible_m{};
  double closest_obstacle_m{};
  double gap_average_m{};
  double sensor_volume_m3{};
  double map_volume_m3{};
  std::string ways_status;  ///< DecisionOutput::ways_status.
  double way_m{};           ///< DecisionOutput::way_m.
  std::string planner_status;
  std::string smoother_status;
  std::string refused;  ///< Images of this decision: "camera 1 fog", with + between.
  bool missed{};
};

struct PathPoint {
  double time_s{};
  Vector3 p_WB = Vector3::Zero();
  double speed_mps{};
};

/// One pool of the memory plan, and how much of it was ever in use.
struct PoolUse {
  std::string name;
  std::size_t element_bytes{}, count{}, high_water{};
  bool tells_use{};  ///< Its owner says how much is in use.
};

/// What a map or a planner took on the machine that simulates, and what the work that it counted is worth: at
/// the lowest of the prices that it was compared with (mission/work_check.hpp).
struct WorkRecord {
  std::string stage;
  double measured_s{};  ///< Processor time of all its calls.
  double counted_s{};
};

/// One change of what the failsafe does.
struct FailsafeRecord {
  double time_s{};
  std::string action;
  std::string phase;                    ///< In which it was decided.
  std::vector<std::string> conditions;  ///< That held then.
  std::string sensor;  ///< Of the condition depth: which one is worst off, and why. Or empty.
};

/// What a flight with faults is judged by; all of it is the world's truth, not the vehicle's belief.
struct SafetyRecord {
  std::vector<FailsafeRecord> actions;
  double first_fault_s{-1.0};  ///< -1: none.
  double last_thrust_s{};      ///< When a motor was last given more than zero.
  double touchdown_mps{};      ///< Of the last time it came down.
  double touchdown_s{-1.0};    ///< When; -1: it did not.
  double left_fence_s{-1.0};   ///< When it first was outside the fence; -1: never.
  Vector3 left_fence_W = Vector3::Zero();
  std::string end;  ///< What the judge saw when it ended the mission, in one sentence; or empty.
  bool landing_site_was_known{};
  Vector3 end_W = Vector3::Zero();
  double goal_error_m{};  ///< From there to the goal.
};

/// What the vehicle's map knew at one height when the mission ended, from above.
struct KnownSlice {
  enum class Cell : std::uint8_t { kUnknown, kFree, kOccupied };
  double height_m{};
  double cell_m{};
  double x_m{}, y_m{};  ///< Lowest corner.
  int columns{}, rows{};
  std::vector<Cell> cell;  ///< [row * columns + column].
};

struct MissionReport {
  MissionResult result;
  std::vector<DecisionRecord> decisions;
  std::vector<PathPoint> path;  ///< At 10 Hz.
  std::vector<PoolUse> pools;
  std::vector<WorkRecord> work;
  SafetyRecord safety;
  KnownSlice known;       ///< Empty unless it was asked for.
  std::string log_error;  ///< Empty, or one line: what is missing in the flight's log.
};

/// What missions are compared by.
[[nodiscard]] inline double velocity(const MissionResult& r) { return r.mean_velocity_mps; }
[[nodiscard]] inline double mission_time(const MissionResult& r) { return r.mission_time_s; }
[[nodiscard]] inline double energy(const MissionResult& r) { return r.energy_kJ; }
[[nodiscard]] inline double latency(const MissionResult& r) { return r.latency_s.median; }

/// One line. Numbers that are not finite become null.
[[nodiscard]] std::string to_json(const MissionResult& result);

}  // namespace roborun::report
