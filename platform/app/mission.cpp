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
#include "platform/sitl/fault/faulty_sensors.hpp"

namespace roborun::app {
namespace {

constexpr double kReached_m = 1.0;
constexpr double kReachedSpeed_mps = 0.5;
constexpr double kHover_mps = 0.3;
constexpr double kOwnApproach_mps = 0.3;  // less is swaying on the spot
constexpr double kHolding_s = 5.0;        // of hovering, until a hold counts as the end
constexpr double kHardTouchdown_mps = 2.0;
constexpr double kStorm_mps = 18.0;
constexpr double kGiveUpAfter_s = 60.0;  // what cannot even stop

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
  [[nodiscard]] std::array<firmware_if::DepthCamera*, kCameras> connect_faults();
  void begin_faults();
  void watch();
  [[nodiscard]] const char* failsafe_reason();
  void record_decision(const DecisionOutput& out);
  [[nodiscard]] const char* end_reason();
  void summarise(double wall_s);

  const sitl::World& world_;
  const MissionConfig& config_;
  sitl::FaultLine faults_;
  std::vector<bool> begun_;  ///< By config_.faults.
  std::array<std::optional<MonotonicTime>, governor::kPhaseCount> phase_begin_{};
  CameraRig rig_;
  std::vector<sitl::FaultyDepthCamera> faulty_camera_;
  SimulatedAircraft aircraft_;
  std::array<firmware_if::DepthCamera*, kCameras> cameras_;
  std::unique_ptr<FlightRecorder> recorder_;  ///< Null: nothing is recorded.
  LockstepFlight flight_;
  FlightSystem& system_;

  const char* give_up_{nullptr};  ///< Why the vehicle stops where it is.
  bool left_ground_{false};
  double sink_mps_{0.0};
  double best_distance_m_{1e300};
  MonotonicTime best_at_{};
  core::StateHash hash_;
  report::MissionReport report_;
  std::vector<double> latencies_s_;
};

MissionRun::MissionRun(const sitl::World& world, const MissionConfig& config)
    : world_(world),
      config_(config),
      begun_(config.faults.size(), false),
      rig_(world, config.camera, config.seed),
      aircraft_(world, config, rig_),
      cameras_(connect_faults()),
      recorder_(config.record.empty()
                    ? nullptr
                    : std::make_unique<FlightRecorder>(config.record, world, config, aircraft_, cameras_)),
      flight_(world, config, recorder_ ? recorder_->aircraft() : aircraft_,
              recorder_ ? recorder_->cameras() : cameras_),
      system_(flight_.system()) {}

std::array<firmware_if::DepthCamera*, kCameras> MissionRun::connect_faults() {
  std::array<firmware_if::DepthCamera*, kCameras> all = rig_.cameras();
  if (config_.faults.empty()) return all;
  aircraft_.connect(faults_);
  faulty_camera_.reserve(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    faulty_camera_.emplace_back(*all[i], static_cast<int>(i), faults_);
    all[i] = &faulty_camera_[i];
  }
  return all;
}

/// Those that begin with the next minor frame.
void MissionRun::begin_faults() {
  const MonotonicTime now = flight_.now() + config_.minor_frame;
  faults_.advance(now);
  const auto phase = static_cast<std::size_t>(system_.flight_program().phase());
  if (!phase_begin_[phase]) phase_begin_[phase] = now;
  for (std::size_t i = 0; i < begun_.size(); ++i) {
    const TimedFault& f = config_.faults[i];
    const auto from = f.phase ? phase_begin_[static_cast<std::size_t>(*f.phase)] : MonotonicTime{};
    if (begun_[i] || !from || seconds(now - *from) < f.at_s) continue;
    begun_[i] = true;
    faults_.inject(f.fault, from_seconds(f.for_s));
    if (report_.safety.first_fault_s < 0.0) report_.safety.first_fault_s = seconds(now.time_since_epoch());
  }
  if (begun_.empty()) return;
  const bool storm = faults_.of(sitl::Component::kWind) == sitl::FaultKind::kOn;
  aircraft_.set_mean_wind(storm ? Vector3(0.0, kStorm_mps, 0.0) : config_.wind.mean_W_mps);
  system_.refuse_bricks(faults_.of(sitl::Component::kMap) == sitl::FaultKind::kOff);
  system_.fail_planner(faults_.of(sitl::Component::kPlanner));
}

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
  if (out.decision.open) active("open");
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

/// What the safety of the flight is judged by.
void MissionRun::watch() {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  report::SafetyRecord& safety = report_.safety;
  for (const double ratio : aircraft_.actuators().throttle()) {
    if (ratio > 0.0) safety.last_thrust_s = seconds(flight_.now().time_since_epoch());
  }
  if (!config_.fence.allows_over_ground({s.p_WB, s.p_WB})) safety.left_fence = true;
  left_ground_ = left_ground_ || (system_.flight().airborne() && s.p_WB.z() > 0.5);
  if (s.on_ground && sink_mps_ > 0.0) safety.touchdown_mps = sink_mps_;
  sink_mps_ = s.on_ground ? 0.0 : -s.v_WB.z();
}

/// Null: the failsafe has not ended the mission.
const char* MissionRun::failsafe_reason() {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  const FlightProgram& flight = system_.flight_program();
  const bool turning =
      std::any_of(s.thrust_ratio.begin(), s.thrust_ratio.end(), [](double ratio) { return ratio > 0.02; });
  switch (flight.action()) {
    case governor::Action::kHold:
      return s.v_WB.norm() < kHover_mps && seconds(flight_.now() - flight.action_since()) > kHolding_s
                 ? "holding"
                 : nullptr;
    case governor::Action::kLand:
      return system_.flight().landed() && !turning ? "landed" : nullptr;
    case governor::Action::kTerminate:
      return s.on_ground && !turning ? "terminated" : nullptr;
    case governor::Action::kKill:
      return s.on_ground && !turning ? "killed" : nullptr;
    default:
      return nullptr;
  }
}

const char* MissionRun::end_reason() {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  const double to_goal_m = (world_.goal_W() - s.p_WB).norm();
  const governor::Action action = system_.flight_program().action();
  watch();
  // The vehicle's body, a sphere of half its span; the ground counts once it has left it, unless it lands.
  const double radius_m = PipelineConfig{}.vehicle_radius_m;
  const bool down = left_ground_ && s.p_WB.z() < 0.3 && !system_.flight().descending();
  const bool hard = system_.flight().descending() && report_.safety.touchdown_mps > kHardTouchdown_mps;
  const bool motors_off = action >= governor::Action::kTerminate;
  if (!motors_off && (world_.clearance_m(s.p_WB, radius_m) < radius_m || down || hard)) {
    report_.result.collided = true;
    return "collision";
  }
  if (const auto body = world_.nearest_body(s.p_WB, radius_m, flight_.now())) {
    const Vector3 to_body = body->core_W - s.p_WB;
    report_.result.collided = s.v_WB.dot(to_body) > kOwnApproach_mps * to_body.norm();
    return report_.result.collided ? "collision" : "struck";
  }
  if (action != governor::Action::kGoOn) {
    if (const char* reason = failsafe_reason()) return reason;
    if (s.battery_ratio <= 0.0 && s.on_ground) return "battery_empty";
    return seconds(flight_.now().time_since_epoch()) > config_.time_limit_s ? "time_limit" : nullptr;
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
  const bool helpless = seconds(flight_.now().time_since_epoch()) > config_.time_limit_s + kGiveUpAfter_s;
  return stopped || helpless ? give_up_ : nullptr;
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
    begin_faults();
    if (const DecisionOutput* decision = flight_.step(faults_.of(sitl::Component::kCpu)))
      record_decision(*decision);
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
    if (config_.each_frame)
      config_.each_frame({flight_.now(), s, system_.flight().committed(), system_.flight().airborne()});
    reason = end_reason();
  }
  if (recorder_) recorder_->finish(system_.map());
  report_.result.reason = reason;
  report_.pools = system_.pools();
  report_.safety.end_W = aircraft_.vehicle().state().p_WB;
  report_.safety.landing_site_was_known = system_.flight_program().site_was_known();
  for (const FailsafeEvent& e : system_.flight_program().events()) {
    report::FailsafeRecord record{
        seconds(e.time.time_since_epoch()), governor::to_string(e.action), governor::to_string(e.phase), {}};
    for (const governor::FailsafeRow& row : governor::kFailsafeTable) {
      if ((e.conditions & governor::bit(row.condition)) != 0)
        record.conditions.emplace_back(governor::to_string(row.condition));
    }
    report_.safety.actions.push_back(std::move(record));
  }
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
