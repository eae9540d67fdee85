#include "platform/mission/mission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "core/record/state_hash.hpp"
#include "platform/board/plugin_loader.hpp"
#include "platform/flight/lockstep_flight.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/mission/mission_faults.hpp"
#include "platform/mission/mission_judge.hpp"
#include "platform/mission/recording.hpp"
#include "platform/mission/work_check.hpp"
#include "platform/sitl/aircraft/camera_rig.hpp"

namespace roborun::mission {
namespace {

/// Block by block, at the map's finest.
report::KnownSlice known_slice(const stages::MapView& view, const Aabb& bounds_W, double height_m) {
  using Cell = report::KnownSlice::Cell;
  using stages::kBlockCells;
  const double block_m = stages::block_m(view.finest_m());
  const auto block = [block_m](double at_m) { return static_cast<int>(std::floor(at_m / block_m)); };
  const int x0 = block(bounds_W.min_W.x());
  const int y0 = block(bounds_W.min_W.y());
  const int blocks_x = block(bounds_W.max_W.x()) - x0 + 1;
  const int blocks_y = block(bounds_W.max_W.y()) - y0 + 1;
  report::KnownSlice slice{
      height_m, view.finest_m(), x0 * block_m, y0 * block_m, blocks_x * kBlockCells, blocks_y * kBlockCells,
      {}};
  slice.cell.resize(static_cast<std::size_t>(slice.columns) * static_cast<std::size_t>(slice.rows));
  const int z =
      std::clamp(static_cast<int>(std::floor((height_m - block(height_m) * block_m) / slice.cell_m)), 0,
                 kBlockCells - 1);
  stages::CellBlock cells;
  std::uint64_t lookups = 0;
  for (int i = 0; i < blocks_x * blocks_y; ++i) {
    const int column = i % blocks_x;
    const int row = i / blocks_x;
    const Vector3 corner_W((x0 + column) * block_m, (y0 + row) * block_m, block(height_m) * block_m);
    const stages::BlockContent content = view.read(corner_W, slice.cell_m, cells, lookups);
    for (int k = 0; k < kBlockCells * kBlockCells; ++k) {
      const int x = k % kBlockCells;
      const int y = k / kBlockCells;
      const int layer_row = kBlockCells * z + y;
      const auto of = [&](const stages::CellRows& rows) {
        return (rows[static_cast<std::size_t>(layer_row)] >> x & 1) != 0;
      };
      Cell cell = content == stages::BlockContent::kFree ? Cell::kFree : Cell::kUnknown;
      if (content == stages::BlockContent::kMixed) {
        if (of(cells.free)) cell = Cell::kFree;
        if (of(cells.occupied)) cell = Cell::kOccupied;
      }
      const int at = (row * kBlockCells + y) * slice.columns + column * kBlockCells + x;
      slice.cell[static_cast<std::size_t>(at)] = cell;
    }
  }
  return slice;
}

/// "camera 1", "lidar 2".
std::string sensor_name(std::size_t sensor) {
  const bool is_camera = sensor < kMostCameras;
  return fmt::format("{} {}", is_camera ? "camera" : "lidar", sensor - (is_camera ? 0 : kMostCameras) + 1);
}

/// "camera 1: covered".
std::string sensor_of(const flight::FailsafeEvent& e) {
  return fmt::format("{}: {}", sensor_name(e.depth_sensor),
                     e.depth_fault == stages::FrameFault::kNone ? "silent" : to_string(e.depth_fault));
}

/// "camera 1 fog+camera 2 turned"; each once, though a LiDAR has six images.
std::string text_of(std::span<const flight::RefusedImage> refused) {
  std::string text;
  for (const flight::RefusedImage& image : refused) {
    const std::string one = fmt::format("{} {}", sensor_name(image.sensor), to_string(image.fault));
    if (text.find(one) == std::string::npos) text += (text.empty() ? "" : "+") + one;
  }
  return text;
}

std::vector<report::RefusedRecord> records_of(const flight::RefusedCounts& refused) {
  std::vector<report::RefusedRecord> records;
  for (std::size_t sensor = 0; sensor < refused.size(); ++sensor)
    for (std::size_t fault = 0; fault < refused[sensor].size(); ++fault)
      if (refused[sensor][fault] > 0)
        records.push_back(
            {sensor_name(sensor), to_string(static_cast<stages::FrameFault>(fault)), refused[sensor][fault]});
  return records;
}

constexpr const char* kCustom = "custom";  // what the caller brought, in reports

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(std::ceil(at))];
}

std::vector<core::CostProfile> prices_of(const MissionConfig& config, const flight::FlightConfig& flight) {
  std::vector<core::CostProfile> prices{flight.costs};
  for (core::StageCost& cost : prices.front().stage) cost = core::slower(cost, 1.0 / config.host_factor);
  if (config.host_costs) prices.push_back(core::on_lattice(*config.host_costs, lattice_of(flight)));
  return prices;
}

/// Start and goal must be inside the fence, with room; so must goals that are there before the flight, and inside the
/// bounds.
const MissionConfig& checked(const sitl::World& world, const MissionConfig& config) {
  const double room_m = planned_radius_m(config.flight.vehicle);
  for (const auto& [name, p_W] : {std::pair{"start", world.start_W()}, std::pair{"goal", world.goal_W()}}) {
    if (!config.flight.fence.allows(Aabb::around(p_W, room_m)))
      throw InputError(
          fmt::format("fence: the {} ({:.2f}, {:.2f}, {:.2f}) must be inside, with {} m to spare", name,
                      p_W.x(), p_W.y(), p_W.z(), room_m));
  }
  for (const GivenGoals& given : config.goals) {
    if (given.goals_W.empty() || given.goals_W.size() > flight::GoalQueue::kMost)
      throw InputError(
          fmt::format("goal: {} at once: must be 1 to {}", given.goals_W.size(), flight::GoalQueue::kMost));
    if (given.at_s > 0.0) continue;
    for (const Vector3& p_W : given.goals_W) {
      const Aabb& bounds_W = world.bounds_W();
      if (!bounds_W.contains(p_W))
        throw InputError(
            fmt::format("goal: ({:.2f}, {:.2f}, {:.2f}): must be inside the bounds, ({:g}, {:g}, {:g}) to "
                        "({:g}, {:g}, {:g})",
                        p_W.x(), p_W.y(), p_W.z(), bounds_W.min_W.x(), bounds_W.min_W.y(), bounds_W.min_W.z(),
                        bounds_W.max_W.x(), bounds_W.max_W.y(), bounds_W.max_W.z()));
      if (!config.flight.fence.allows(Aabb::around(p_W, room_m)))
        throw InputError(
            fmt::format("goal: ({:.2f}, {:.2f}, {:.2f}): must be inside the fence, with {} m to spare",
                        p_W.x(), p_W.y(), p_W.z(), room_m));
    }
  }
  return config;
}

/// One mission: a flight in lockstep, and the judge of what it does.
class MissionRun {
 public:
  MissionRun(const sitl::World& world, const MissionConfig& config);
  report::MissionReport fly(const std::function<void(const Progress&)>& progress);

 private:
  [[nodiscard]] flight::FlightParts parts();
  void begin_faults();
  /// Those that are due.
  void give_goals();
  void record_goals();
  /// Throws InputError for a planner of somebody else's that does not say what it does.
  void refuse_silence() const;
  void record_decision(const flight::DecisionOutput& out);
  void record_failsafe();
  void summarise(double wall_s);

  const sitl::World& world_;
  const MissionConfig& config_;
  flight::FlightConfig flight_config_;
  MissionFaults faults_;
  sitl::CameraRig rig_;
  sitl::SimulatedAircraft aircraft_;
  std::vector<firmware_if::DepthCamera*> cameras_;
  std::unique_ptr<FlightRecorder> recorder_;  ///< Null: nothing is recorded.
  FlightSetup setup_;
  std::vector<core::CostProfile> prices_;  ///< Those flown, and those of this machine if they are known.
  TimedMap timed_map_;
  TimedPlanner timed_planner_;
  FaultyPlanner planner_;
  flight::LockstepFlight flight_;
  flight::FlightSystem& system_;
  MissionJudge judge_;
  std::size_t given_{0};  ///< Of config_.goals.
  std::vector<report::GoalRecord> refused_;
  core::StateHash hash_;
  report::MissionReport report_;
  std::vector<double> latencies_s_;
};

MissionRun::MissionRun(const sitl::World& world, const MissionConfig& config)
    : world_(world),
      config_(checked(world, config)),
      flight_config_(flight_config_of(world, config)),
      faults_(config),
      rig_(world, config.simulator, config.seed),
      aircraft_(flight_config_.vehicle, config.simulator, ground_below(world), config.seed,
                config.flight.minor_frame, rig_),
      cameras_(faults_.connect(rig_.cameras())),
      recorder_(config.record.empty()
                    ? nullptr
                    : std::make_unique<FlightRecorder>(config.record, flight_config_, config, aircraft_,
                                                       cameras_, rig_.lidars())),
      setup_(flight_config_, config.backends, image_limits(config), config.own),
      prices_(prices_of(config, flight_config_)),
      timed_map_(setup_.parts().map, prices_),
      timed_planner_(setup_.parts().planner, prices_),
      planner_(timed_planner_, faults_.line()),
      flight_(flight_config_, recorder_ ? recorder_->aircraft() : aircraft_,
              recorder_ ? recorder_->cameras() : std::span<firmware_if::DepthCamera* const>(cameras_),
              parts(), setup_.arena(), recorder_ ? recorder_->lidars() : rig_.lidars()),
      system_(flight_.system()),
      judge_(config.judge, flight_config_.fence, flight_config_.vehicle.radius_m, world, aircraft_, system_) {
  setup_.check();
  aircraft_.stand_in(world);
  if (!faults_.empty()) aircraft_.connect(faults_.line());
  if (!config.flight.answers) aircraft_.ignore_kill_switch();
}

flight::FlightParts MissionRun::parts() {
  const flight::FlightParts own = setup_.parts();
  stages::Planner& planner = faults_.empty() ? static_cast<stages::Planner&>(timed_planner_) : planner_;
  return {timed_map_, planner, own.policy, own.ways};
}

void MissionRun::refuse_silence() const {
  const bool shipped = !config_.own.planner && !board::is_plugin(config_.backends.planner);
  if (shipped || !timed_planner_.work().silent) return;
  throw InputError(fmt::format(
      "--planner: {}: planned a path, and said that it did no work for which the profile {} charges: "
      "must count work.units and work.volume_m3 (stages/planning/planner.hpp)",
      config_.own.planner ? kCustom : config_.backends.planner, config_.profile_name));
}

/// Those that begin with the next minor frame.
void MissionRun::begin_faults() {
  const MonotonicTime now = flight_.now() + config_.flight.minor_frame;
  if (faults_.advance(now, system_.pilot().phase()))
    judge_.safety().first_fault_s = seconds(now.time_since_epoch());
  if (faults_.empty()) return;
  aircraft_.set_mean_wind(faults_.mean_wind_W_mps());
  faults_.refuse_bricks(setup_.arena());
}

void MissionRun::give_goals() {
  const double now_s = seconds(flight_.now().time_since_epoch());
  for (; given_ < config_.goals.size() && config_.goals[given_].at_s <= now_s; ++given_) {
    const std::vector<Vector3>& goals_W = config_.goals[given_].goals_W;
    if (system_.decision_program().give_goals(goals_W) == Status::kOk) {
      if (recorder_) recorder_->gave_goals(goals_W);
      continue;
    }
    const Vector3& p_W = aircraft_.vehicle().state().p_WB;
    for (const Vector3& goal_W : goals_W)
      refused_.push_back({goal_W, "refused", now_s, (goal_W - p_W).norm()});
  }
}

void MissionRun::record_goals() {
  if (config_.goals.empty()) return;
  const double end_s = seconds(flight_.now().time_since_epoch());
  const Vector3& end_W = aircraft_.vehicle().state().p_WB;
  for (const flight::Goal& goal : system_.decision_program().goals().told()) {
    const bool answered = goal.answer != flight::GoalAnswer::kFlown;
    const std::string& why = report_.result.reason;
    report_.result.goals.push_back({goal.p_W,
                                    answered                      ? to_string(goal.answer)
                                    : report_.result.reached_goal ? "reached"
                                                                  : why,
                                    answered ? seconds(goal.at.time_since_epoch()) : end_s,
                                    answered ? goal.distance_m : (goal.p_W - end_W).norm()});
  }
  report_.result.goals.insert(report_.result.goals.end(), refused_.begin(), refused_.end());
}

void MissionRun::record_decision(const flight::DecisionOutput& out) {
  if (recorder_) recorder_->decided(out);
  const OperatingPoint& point = out.decision.point;
  report::DecisionRecord r;
  r.time_s = seconds(flight_.now().time_since_epoch());
  r.p_WB = aircraft_.vehicle().state().p_WB;
  r.speed_mps = aircraft_.vehicle().state().v_WB.norm();
  r.p0_m = lattice_of(flight_config_).cell_size_m(point.p0_level);
  r.p1_m = lattice_of(flight_config_).cell_size_m(point.p1_level);
  r.v0_m3 = out.work[core::StageId::kMap].volume_m3;
  r.v1_m3 = out.work[core::StageId::kExport].volume_m3;
  r.v2_m3 = out.work[core::StageId::kPlanner].volume_m3;
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
  r.ways_status = to_string(out.ways_status);
  r.way_m = out.way_m;
  r.planner_status = to_string(out.planner_status);
  r.smoother_status = to_string(out.smoother_status);
  r.refused = text_of(system_.decision_program().refused_now());
  r.missed = out.latency > point.deadline;
  hash_.add(r.latency_s);
  hash_.add(r.deadline_s);
  hash_.add(static_cast<std::uint64_t>(point.p0_level));
  hash_.add(static_cast<std::uint64_t>(point.p1_level));
  latencies_s_.push_back(r.latency_s);
  report_.decisions.push_back(std::move(r));
}

void MissionRun::summarise(double wall_s) {
  report::MissionResult& r = report_.result;
  r.design = config_.own.policy ? kCustom : governor::to_string(config_.flight.design);
  r.profile = config_.profile_name;
  r.seed = config_.seed;
  r.map = config_.own.map ? kCustom : config_.backends.map;
  r.planner = config_.own.planner ? kCustom : config_.backends.planner;
  r.ways = config_.own.ways ? kCustom : config_.backends.ways;
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
  r.refused = records_of(system_.decision_program().refused());
  r.map_drops = system_.decision_program().map_drops();
  r.speed_limit_mps = system_.policy().v_max_mps();
  hash_.add(system_.map().digest());
  r.state_hash = fmt::format("{:016x}", hash_.value());
}

void MissionRun::record_failsafe() {
  report_.safety = judge_.safety();
  report_.safety.end_W = aircraft_.vehicle().state().p_WB;
  report_.safety.goal_error_m = (report_.safety.end_W - world_.goal_W()).norm();
  report_.safety.landing_site_was_known = system_.pilot().site_was_known();
  for (const flight::FailsafeEvent& e : system_.pilot().events()) {
    report::FailsafeRecord record{seconds(e.time.time_since_epoch()),
                                  governor::to_string(e.action),
                                  governor::to_string(e.phase),
                                  {},
                                  {}};
    for (const governor::FailsafeRow& row : governor::kFailsafeTable) {
      if ((e.conditions & governor::bit(row.condition)) != 0)
        record.conditions.emplace_back(governor::to_string(row.condition));
    }
    if ((e.conditions & governor::bit(governor::Condition::kDepth)) != 0) record.sensor = sensor_of(e);
    report_.safety.actions.push_back(std::move(record));
  }
}

report::MissionReport MissionRun::fly(const std::function<void(const Progress&)>& progress) {
  const auto wall_start = std::chrono::steady_clock::now();
  const double whole_m = (world_.goal_W() - world_.start_W()).norm();
  const char* reason = nullptr;
  for (std::uint64_t frame = 0; reason == nullptr; ++frame) {
    const Vector3 before_W = aircraft_.vehicle().state().p_WB;
    begin_faults();
    give_goals();
    const MonotonicTime now = flight_.now() + config_.flight.minor_frame;
    if (const flight::DecisionOutput* decision = flight_.step(faults_.computer(now))) {
      record_decision(*decision);
      if (recorder_) recorder_->check();
    }
    refuse_silence();
    const sitl::VehicleState& s = aircraft_.vehicle().state();
    report_.result.distance_m += (s.p_WB - before_W).norm();
    report_.result.max_velocity_mps = std::max(report_.result.max_velocity_mps, s.v_WB.norm());
    hash_.add(s.p_WB);
    hash_.add(s.v_WB);
    if (frame % 40 == 0) report_.path.push_back({seconds(now.time_since_epoch()), s.p_WB, s.v_WB.norm()});
    if (frame % 400 == 0 && progress) {
      progress({seconds(now.time_since_epoch()),
                std::clamp(1.0 - (world_.goal_W() - s.p_WB).norm() / whole_m, 0.0, 1.0), s.v_WB.norm()});
    }
    if (config_.each_frame)
      config_.each_frame({now, s, system_.control().committed(), system_.control().airborne()});
    const bool gave_up = judge_.given_up();
    reason = judge_.judge(now);
    if (recorder_ && judge_.given_up() && !gave_up) recorder_->gave_up();
  }
  if (recorder_) recorder_->finish(system_.map());
  report_.result.reason = reason;
  report_.result.reached_goal = report_.result.reason == "reached_goal";
  report_.result.collided = judge_.collided();
  record_goals();
  report_.pools = setup_.pools();
  report_.work = work_of(timed_map_, timed_planner_);
  if (config_.keep_known)
    report_.known = known_slice(system_.map().view(), world_.bounds_W(), world_.start_W().z());
  record_failsafe();
  summarise(std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count());
  return std::move(report_);
}

}  // namespace

report::MissionReport fly_mission(const sitl::World& world, const MissionConfig& config,
                                  const std::function<void(const Progress&)>& progress) {
  const auto run = std::make_unique<MissionRun>(world, config);
  return run->fly(progress);
}

}  // namespace roborun::mission
