#include "platform/app/mission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/geometry/math.hpp"
#include "core/memory/arena.hpp"
#include "core/record/state_hash.hpp"
#include "platform/app/actuator_link.hpp"
#include "platform/app/backends.hpp"
#include "platform/app/decision_pipeline.hpp"
#include "platform/app/flight_lane.hpp"
#include "platform/sitl/world/input_error.hpp"

namespace roborun::app {
namespace {

constexpr Nanos kMinorFrame{2'500'000};
constexpr double kReached_m = 1.0;
constexpr double kReachedSpeed_mps = 0.5;
constexpr double kHover_mps = 0.3;
constexpr double kMapMargin_m = 3.0;
constexpr double kTakeOff_mps = 1.5;

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(std::ceil(at))];
}

/// Straight up from the ground to the cruise altitude.
Trajectory take_off(const Vector3& ground_W, const Vector3& top_W, MonotonicTime start) {
  Trajectory t;
  t.start_time = start;
  (void)stages::append_rest_to_rest(ground_W, top_W, {kTakeOff_mps, kTakeOff_mps}, t);
  return t;
}

/// The whole simulated system of one mission.
class MissionRun {
 public:
  MissionRun(const sitl::World& world, const MissionConfig& config);
  report::MissionReport fly(const std::function<void(const Progress&)>& progress);

 private:
  void step_world();
  void start_decision();
  void finish_decision();
  void record_decision(const DecisionOutput& out);
  [[nodiscard]] const char* end_reason();
  void summarise(double wall_s);

  const sitl::World& world_;
  const MissionConfig& config_;
  MonotonicTime now_{};
  sitl::Vehicle vehicle_;
  sitl::NavigationSensors sensors_;
  std::vector<sitl::SimulatedDepthCamera> cameras_;
  std::vector<std::byte> block_;
  std::optional<core::Arena> arena_;
  std::optional<stages::PointCloud> cloud_;
  MapAndPlanner backends_;
  stages::Smoother smoother_;
  std::optional<governor::Governor> governor_;
  std::optional<DecisionPipeline> pipeline_;
  FlightLane flight_;
  ActuatorLink actuators_;

  std::optional<DecisionOutput> pending_;  ///< Computed, not yet there in virtual time.
  MonotonicTime pending_at_{};
  MonotonicTime next_decision_{};
  const char* give_up_{nullptr};  ///< Why the vehicle stops where it is.
  double best_distance_m_{1e300};
  MonotonicTime best_at_{};
  std::uint64_t decision_count_{0};
  core::StateHash hash_;
  report::MissionReport report_;
  std::vector<double> latencies_s_;
};

MissionRun::MissionRun(const sitl::World& world, const MissionConfig& config)
    : world_(world),
      config_(config),
      vehicle_(config.vehicle, config.wind, Vector3(world.start_W().x(), world.start_W().y(), 0.0),
               config.seed),
      sensors_(config.sensors, config.seed),
      flight_({}, {}),
      actuators_(config.seed) {
  const auto mounts = sitl::six_camera_mounts();
  cameras_.reserve(mounts.size());
  for (std::size_t i = 0; i < mounts.size(); ++i) {
    cameras_.emplace_back(world, config.camera, mounts[i], config.seed, static_cast<std::uint32_t>(i));
  }
  PipelineConfig pipeline;
  pipeline.flight_bounds_W = world.bounds_W();
  pipeline.map_bounds_W = {world.bounds_W().min_W - Vector3::Constant(kMapMargin_m),
                           world.bounds_W().max_W + Vector3::Constant(kMapMargin_m)};
  pipeline.horizon_m = config.camera.range_m - 1.0;

  const std::size_t cloud_bytes = stages::PointCloud::arena_bytes({});
  block_.resize(cloud_bytes + backend_bytes(pipeline.map_bounds_W, config.camera) + 4096);
  arena_.emplace(block_);
  cloud_.emplace(stages::PointCloud::Config{}, *arena_);
  backends_ = make_backends(config.map_backend, config.planner_backend, pipeline.map_bounds_W, config.camera,
                            *arena_);
  if (arena_->exhausted()) throw sitl::InputError("memory plan: the arena is too small for this world");

  const auto cost_of = [&config](core::StageId id) { return seconds(config.costs.cost(id, {})); };
  governor::GovernorConfig g;
  g.design = config.design;
  g.model = config.model;
  g.point_cloud_s = cost_of(core::StageId::kPointCloud);
  g.governor_s = config.design == governor::Design::kAware ? cost_of(core::StageId::kGovernor) : 0.0;
  g.smoother_s = cost_of(core::StageId::kSmoother);
  g.v_max_mps = config.v_max_mps;
  const double height_m = pipeline.map_bounds_W.size().z();
  g.sensor_volume_max_m3 =
      4.0 * config.camera.range_m * config.camera.range_m * std::min(height_m, 2.0 * config.camera.range_m);
  g.coarsest_level = coarsest_level_within(world.bounds_W().size().z() / 3.0);
  g.minor_frame = kMinorFrame;
  governor_.emplace(g);
  pipeline_.emplace(pipeline, config.costs, *governor_, *cloud_, *backends_.map, *backends_.planner,
                    smoother_);
}

void MissionRun::step_world() {
  // What was sent at the end of a minor frame reaches the motors in the middle of the next one: four
  // throttles are on the bus for 0.13 ms, and an ESC has a cycle of its own.
  vehicle_.step(kMinorFrame / 2);
  actuators_.advance(now_ + kMinorFrame / 2, vehicle_);
  vehicle_.step(kMinorFrame / 2);
  now_ += kMinorFrame;
  sensors_.sample(now_, vehicle_.state());
  const Pose X_WB = vehicle_.X_WB();
  for (sitl::SimulatedDepthCamera& camera : cameras_) camera.expose(now_, X_WB);
}

void MissionRun::start_decision() {
  stages::EstimatedState state;
  if (give_up_ != nullptr || now_ < next_decision_ || pending_ ||
      flight_.estimator().state(state) != Status::kOk || !flight_.airborne())
    return;
  core::StaticVector<stages::PosedDepthFrame, 8> frames;
  for (sitl::SimulatedDepthCamera& camera : cameras_) {
    stages::PosedDepthFrame posed;
    Pose X_WB;
    if (camera.read(posed.frame) != Status::kOk ||
        flight_.estimator().pose_at(posed.frame.stamp, X_WB) != Status::kOk)
      continue;
    const firmware_if::CameraMount& mount = camera.mount();
    Matrix3 R_BC;
    Vector3 p_BC;
    for (int i = 0; i < 9; ++i) R_BC(i / 3, i % 3) = mount.R_BC[static_cast<std::size_t>(i)];
    for (int i = 0; i < 3; ++i) p_BC[i] = mount.p_BC_m[static_cast<std::size_t>(i)];
    posed.X_WC = {X_WB.R_RT * R_BC, X_WB * p_BC};
    (void)frames.push_back(posed);
  }
  if (frames.empty()) {
    next_decision_ = now_ + 4 * kMinorFrame;
    return;
  }
  DecisionInput in;
  in.now = now_;
  in.frames = {frames.begin(), frames.size()};
  in.committed = &flight_.committed();
  in.p_WB = state.p_WB;
  in.v_WB = state.v_WB;
  in.goal_W = world_.goal_W();
  in.seed = core::mix64(config_.seed * 1000003ULL + ++decision_count_);
  pending_.emplace();
  pipeline_->decide(in, *pending_);
  pending_at_ = now_ + pending_->latency;
  // The frame of the decision lane is the granted deadline, or longer if the work was.
  next_decision_ = now_ + std::max(pending_->decision.point.deadline, pending_->latency);
  record_decision(*pending_);
}

void MissionRun::finish_decision() {
  if (!pending_ || now_ < pending_at_) return;
  if (pending_->kind == DecisionKind::kNew) {
    // Too late for its own start: the vehicle already flies its braking tail, and the result is of no use.
    if (pending_->trajectory.start_time >= now_) flight_.offer(pending_->trajectory);
  } else if (pending_->kind == DecisionKind::kBrake) {
    flight_.offer(pending_->trajectory);
  }
  pending_.reset();
}

void MissionRun::record_decision(const DecisionOutput& out) {
  const OperatingPoint& point = out.decision.point;
  report::DecisionRecord r;
  r.time_s = seconds(now_.time_since_epoch());
  r.p_WB = vehicle_.state().p_WB;
  r.speed_mps = vehicle_.state().v_WB.norm();
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
  const sitl::VehicleState& s = vehicle_.state();
  const double to_goal_m = (world_.goal_W() - s.p_WB).norm();
  // The vehicle's body, a sphere of half its span; the ground counts once it has left it.
  const double radius_m = PipelineConfig{}.vehicle_radius_m;
  if (world_.clearance_m(s.p_WB, radius_m) < radius_m || (flight_.airborne() && s.p_WB.z() < 0.3)) {
    report_.result.collided = true;
    return "collision";
  }
  if (to_goal_m < kReached_m && s.v_WB.norm() < kReachedSpeed_mps) {
    report_.result.reached_goal = true;
    return "reached_goal";
  }
  if (to_goal_m < best_distance_m_ - 0.5) {
    best_distance_m_ = to_goal_m;
    best_at_ = now_;
  }
  if (s.battery_ratio <= 0.0) return "battery_empty";
  if (give_up_ == nullptr) {
    if (seconds(now_ - best_at_) > config_.no_progress_s) give_up_ = "no_path_to_goal";
    if (seconds(now_.time_since_epoch()) > config_.time_limit_s) give_up_ = "time_limit";
    return nullptr;
  }
  // Given up: no more decisions; the committed trajectory ends in a stop, and the mission in a hover.
  const Trajectory& committed = flight_.committed();
  const bool stopped =
      now_ > committed.start_time + from_seconds(committed.duration_s()) && s.v_WB.norm() < kHover_mps;
  return stopped ? give_up_ : nullptr;
}

void MissionRun::summarise(double wall_s) {
  report::MissionResult& r = report_.result;
  r.design = governor::to_string(config_.design);
  r.profile = config_.profile_name;
  r.seed = config_.seed;
  r.map = config_.map_backend;
  r.planner = config_.planner_backend;
  r.mission_time_s = seconds(now_.time_since_epoch());
  r.mean_velocity_mps = r.mission_time_s > 0.0 ? r.distance_m / r.mission_time_s : 0.0;
  r.energy_kJ = 1e-3 * vehicle_.state().energy_J;
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
  r.map_bytes = backends_.map->bytes();
  r.speed_limit_mps = governor_->v_max_mps();
  hash_.add(backends_.map->digest());
  r.state_hash = fmt::format("{:016x}", hash_.value());
}

report::MissionReport MissionRun::fly(const std::function<void(const Progress&)>& progress) {
  const auto wall_start = std::chrono::steady_clock::now();
  const double whole_m = (world_.goal_W() - world_.start_W()).norm();
  flight_.set_take_off([this](const Vector3& ground_W, MonotonicTime start) {
    return take_off(ground_W, Vector3(ground_W.x(), ground_W.y(), world_.start_W().z()), start);
  });
  const char* reason = nullptr;
  for (std::uint64_t frame = 0; reason == nullptr; ++frame) {
    const Vector3 before_W = vehicle_.state().p_WB;
    step_world();
    flight_.step(now_, sensors_, actuators_);
    actuators_.step(now_);
    finish_decision();
    start_decision();
    const sitl::VehicleState& s = vehicle_.state();
    report_.result.distance_m += (s.p_WB - before_W).norm();
    report_.result.max_velocity_mps = std::max(report_.result.max_velocity_mps, s.v_WB.norm());
    hash_.add(s.p_WB);
    hash_.add(s.v_WB);
    if (frame % 40 == 0) report_.path.push_back({seconds(now_.time_since_epoch()), s.p_WB, s.v_WB.norm()});
    if (frame % 400 == 0 && progress) {
      progress({seconds(now_.time_since_epoch()),
                std::clamp(1.0 - (world_.goal_W() - s.p_WB).norm() / whole_m, 0.0, 1.0), s.v_WB.norm()});
    }
    reason = end_reason();
  }
  report_.result.reason = reason;
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
