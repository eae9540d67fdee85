#include "platform/app/mission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/geometry/math.hpp"
#include "core/record/state_hash.hpp"
#include "platform/app/camera_rig.hpp"
#include "platform/app/lockstep_flight.hpp"
#include "platform/app/recording.hpp"
#include "platform/app/simulated_aircraft.hpp"

namespace roborun::app {
namespace {

constexpr double kReached_m = 1.0;
constexpr double kReachedSpeed_mps = 0.5;
constexpr double kHover_mps = 0.3;

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(std::ceil(at))];
}

/// One mission: a flight in lockstep, and the judge of what it does.
class MissionRun {
 public:
  MissionRun(const sitl::World& world, const MissionConfig& config);
  report::MissionReport fly(const std::function<void(const Progress&)>& progress);

 private:
  void record_decision(const DecisionOutput& out);
  [[nodiscard]] const char* end_reason();
  void summarise(double wall_s);

  const sitl::World& world_;
  const MissionConfig& config_;
  CameraRig rig_;
  SimulatedAircraft aircraft_;
  std::unique_ptr<FlightRecorder> recorder_;  ///< Null: nothing is recorded.
  LockstepFlight flight_;
  FlightSystem& system_;

  const char* give_up_{nullptr};  ///< Why the vehicle stops where it is.
  double best_distance_m_{1e300};
  MonotonicTime best_at_{};
  core::StateHash hash_;
  report::MissionReport report_;
  std::vector<double> latencies_s_;
};

MissionRun::MissionRun(const sitl::World& world, const MissionConfig& config)
    : world_(world),
      config_(config),
      rig_(world, config.camera, config.seed),
      aircraft_(world, config, rig_),
      recorder_(config.record.empty() ? nullptr
                                      : std::make_unique<FlightRecorder>(config.record, world, config,
                                                                         aircraft_, rig_.cameras())),
      flight_(world, config, recorder_ ? recorder_->aircraft() : aircraft_,
              recorder_ ? recorder_->cameras() : rig_.cameras()),
      system_(flight_.system()) {}

void MissionRun::record_decision(const DecisionOutput& out) {
  if (recorder_) recorder_->decided(out);
  const OperatingPoint& point = out.decision.point;
  report::DecisionRecord r;
  r.time_s = seconds(flight_.now().time_since_epoch());
  r.p_WB = aircraft_.vehicle().state().p_WB;
  r.speed_mps = aircraft_.vehicle().state().v_WB.norm();
  r.p0_m = cell_size_m(point.p0_level);
  r.p1_m = cell_size_m(point.p1_level);
  r.v0_m3 = out.work[static_cast<std::size_t>(core::StageId::kMap)].volume_m3;
  r.v1_m3 = out.work[static_cast<std::size_t>(core::StageId::kExport)].volume_m3;
  r.v2_m3 = out.work[static_cast<std::size_t>(core::StageId::kPlanner)].volume_m3;
  r.time_budget_s = seconds(out.decision.time_budget);
  r.budget_source = governor::to_string(out.decision.source);
  r.deadline_s = seconds(point.deadline);
  r.latency_s = seconds(out.latency);
  for (std::size_t i = 0; i < core::kStageCount; ++i) r.stage_s[i] = seconds(out.cost[i]);
  r.predicted_s = out.decision.predicted_s;
  r.demand_m = out.decision.demand_m;
  const governor::SolverSolution& solution = out.decision.solution;
  r.solver = to_string(solution.status);
  const auto active = [&r](const char* name) {
    r.active += (r.active.empty() ? "" : "+") + std::string(name);
  };
  for (std::size_t i = 0; i < governor::kConstraintCount; ++i) {
    if (((solution.active >> i) & 1U) != 0) active(governor::to_string(static_cast<governor::Constraint>(i)));
  }
  for (const governor::Reason reason : governor::kReasons) {
    if ((solution.active & reason) != 0) active(governor::to_string(reason));
  }
  r.speed_limit_mps = point.speed_limit_mps;
  r.visible_m = out.profile.closest_unknown_m;
  r.closest_obstacle_m = out.profile.closest_obstacle_m;
  r.gap_average_m = out.profile.gap_average_m;
  r.sensor_volume_m3 = out.profile.sensor_volume_m3;
  r.map_volume_m3 = out.profile.map_volume_m3;
  r.planner_status = to_string(out.planner_status);
  r.smoother_status = to_string(out.smoother_status);
  r.missed = out.latency > point.deadline;
  hash_.add(r.latency_s);
  hash_.add(r.deadline_s);
  hash_.add(static_cast<std::uint64_t>(point.p0_level));
  hash_.add(static_cast<std::uint64_t>(point.p1_level));
  latencies_s_.push_back(r.latency_s);
  report_.decisions.push_back(std::move(r));
}

const char* MissionRun::end_reason() {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  const double to_goal_m = (world_.goal_W() - s.p_WB).norm();
  // The vehicle's body, a sphere of half its span; the ground counts once it has left it.
  const double radius_m = PipelineConfig{}.vehicle_radius_m;
  if (world_.clearance_m(s.p_WB, radius_m) < radius_m || (system_.flight().airborne() && s.p_WB.z() < 0.3)) {
    report_.result.collided = true;
    return "collision";
  }
  if (to_goal_m < kReached_m && s.v_WB.norm() < kReachedSpeed_mps) {
    report_.result.reached_goal = true;
    return "reached_goal";
  }
  if (to_goal_m < best_distance_m_ - 0.5) {
    best_distance_m_ = to_goal_m;
    best_at_ = flight_.now();
  }
  if (s.battery_ratio <= 0.0) return "battery_empty";
  if (give_up_ == nullptr) {
    if (seconds(flight_.now() - best_at_) > config_.no_progress_s) give_up_ = "no_path_to_goal";
    if (seconds(flight_.now().time_since_epoch()) > config_.time_limit_s) give_up_ = "time_limit";
    if (give_up_ == nullptr) return nullptr;
    system_.decision_program().give_up();
    if (recorder_) recorder_->gave_up();
    return nullptr;
  }
  // Given up: no more decisions; the committed trajectory ends in a stop, and the mission in a hover.
  const Trajectory& committed = system_.flight().committed();
  const bool stopped = flight_.now() > committed.start_time + from_seconds(committed.duration_s()) &&
                       s.v_WB.norm() < kHover_mps;
  return stopped ? give_up_ : nullptr;
}

void MissionRun::summarise(double wall_s) {
  report::MissionResult& r = report_.result;
  r.design = governor::to_string(config_.design);
  r.profile = config_.profile_name;
  r.seed = config_.seed;
  r.map = config_.map_backend;
  r.planner = config_.planner_backend;
  r.mission_time_s = seconds(flight_.now().time_since_epoch());
  r.mean_velocity_mps = r.mission_time_s > 0.0 ? r.distance_m / r.mission_time_s : 0.0;
  r.energy_kJ = 1e-3 * aircraft_.vehicle().state().energy_J;
  r.decisions = report_.decisions.size();
  std::vector<double> precision_m;
  for (const report::DecisionRecord& d : report_.decisions) {
    r.deadline_misses += d.missed ? 1U : 0U;
    r.cpu_s += d.latency_s;
    precision_m.push_back(d.p0_m);
  }
  r.latency_s = {quantile(latencies_s_, 0.5), quantile(latencies_s_, 0.99), quantile(latencies_s_, 1.0)};
  r.cpu_utilization_ratio = r.mission_time_s > 0.0 ? r.cpu_s / r.mission_time_s : 0.0;
  r.precision_m = {quantile(precision_m, 0.0), quantile(precision_m, 0.5), quantile(precision_m, 1.0)};
  r.real_time_factor = wall_s > 0.0 ? r.mission_time_s / wall_s : 0.0;
  r.map_bytes = system_.map().bytes();
  r.speed_limit_mps = system_.governor().v_max_mps();
  hash_.add(system_.map().digest());
  r.state_hash = fmt::format("{:016x}", hash_.value());
}

report::MissionReport MissionRun::fly(const std::function<void(const Progress&)>& progress) {
  const auto wall_start = std::chrono::steady_clock::now();
  const double whole_m = (world_.goal_W() - world_.start_W()).norm();
  const char* reason = nullptr;
  for (std::uint64_t frame = 0; reason == nullptr; ++frame) {
    const Vector3 before_W = aircraft_.vehicle().state().p_WB;
    if (const DecisionOutput* decision = flight_.step()) record_decision(*decision);
    const sitl::VehicleState& s = aircraft_.vehicle().state();
    report_.result.distance_m += (s.p_WB - before_W).norm();
    report_.result.max_velocity_mps = std::max(report_.result.max_velocity_mps, s.v_WB.norm());
    hash_.add(s.p_WB);
    hash_.add(s.v_WB);
    if (frame % 40 == 0)
      report_.path.push_back({seconds(flight_.now().time_since_epoch()), s.p_WB, s.v_WB.norm()});
    if (frame % 400 == 0 && progress) {
      progress({seconds(flight_.now().time_since_epoch()),
                std::clamp(1.0 - (world_.goal_W() - s.p_WB).norm() / whole_m, 0.0, 1.0), s.v_WB.norm()});
    }
    reason = end_reason();
  }
  if (recorder_) recorder_->finish(system_.map());
  report_.result.reason = reason;
  report_.pools = system_.pools();
  summarise(std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count());
  return std::move(report_);
}

}  // namespace

report::MissionReport fly_mission(const sitl::World& world, const MissionConfig& config,
                                  const std::function<void(const Progress&)>& progress) {
  const auto run = std::make_unique<MissionRun>(world, config);
  return run->fly(progress);
}

}  // namespace roborun::app
