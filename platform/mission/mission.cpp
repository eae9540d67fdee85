#include "platform/mission/mission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/record/state_hash.hpp"
#include "platform/board/plugin_loader.hpp"
#include "platform/flight/lockstep_flight.hpp"
#include "platform/input/input_error.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/mission/flight_records.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/mission/mission_faults.hpp"
#include "platform/mission/mission_judge.hpp"
#include "platform/mission/recorded_flight.hpp"
#include "platform/mission/recording.hpp"
#include "platform/mission/scene.hpp"
#include "platform/mission/work_check.hpp"
#include "platform/sitl/aircraft/camera_rig.hpp"
#include "platform/sitl/autopilot/autopilot_aircraft.hpp"

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

std::vector<report::RefusedRecord> records_of(const flight::RefusedCounts& refused) {
  std::vector<report::RefusedRecord> records;
  for (std::size_t sensor = 0; sensor < refused.size(); ++sensor)
    for (std::size_t fault = 0; fault < refused[sensor].size(); ++fault)
      if (refused[sensor][fault] > 0)
        records.push_back(
            {sensor_name(sensor), to_string(static_cast<stages::FrameFault>(fault)), refused[sensor][fault]});
  return records;
}

/// The same for traces and plots.
report::DecisionRecord record_of(const log::DecisionEntry& e) {
  report::DecisionRecord r;
  r.time_s = seconds(Nanos{e.time_ns});
  r.p_WB = {e.p_WB[0], e.p_WB[1], e.p_WB[2]};
  r.speed_mps = e.speed_mps;
  r.p0_m = e.p0_m;
  r.p1_m = e.p1_m;
  r.v0_m3 = e.v0_m3;
  r.v1_m3 = e.v1_m3;
  r.v2_m3 = e.v2_m3;
  r.time_budget_s = e.time_budget_s;
  r.budget_source = e.budget_source;
  r.speed_source = e.speed_source;
  r.deadline_s = e.deadline_s;
  r.latency_s = e.latency_s;
  r.stage_s = e.stage_s;
  r.predicted_s = e.predicted_s;
  r.solver = e.solver;
  r.active = e.active.view();
  r.demand_m = e.demand_m;
  r.speed_limit_mps = e.speed_limit_mps;
  r.visible_m = e.visible_m;
  r.closest_obstacle_m = e.closest_obstacle_m;
  r.gap_average_m = e.gap_average_m;
  r.sensor_volume_m3 = e.sensor_volume_m3;
  r.map_volume_m3 = e.map_volume_m3;
  r.ways_status = e.ways;
  r.way_m = e.way_m;
  r.planner_status = e.planner;
  r.smoother_status = e.smoother;
  r.refused = e.refused.view();
  r.missed = e.missed;
  return r;
}

constexpr const char* kCustom = "custom";  // what the caller brought, in reports

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(std::ceil(at))];
}

std::vector<core::CostProfile> prices_of(const MissionConfig& config, const flight::FlightConfig& flight) {
  std::vector<core::CostProfile> prices{core::slower(flight.costs, 1.0 / config.host_factor)};
  if (config.host_costs) prices.push_back(core::on_lattice(*config.host_costs, lattice_of(flight)));
  return prices;
}

/// Start and goal must be inside the fence, with room; so must goals that are there before the flight, and inside the
/// bounds.
const MissionConfig& checked(const sitl::World& world, const MissionConfig& config) {
  const double room_m = planned_radius_m(config.flight.vehicle);
  if (config.route) check_route(*config.route, world.bounds_W(), config.flight.fence, room_m);
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
  /// What the runtime flies.
  [[nodiscard]] flight::Aircraft& flown() {
    if (recorder_) return recorder_->aircraft();
    return autopilot_ ? static_cast<flight::Aircraft&>(*autopilot_) : aircraft_;
  }
  void begin_faults();
  /// Those that are due.
  void give_goals();
  void record_goals();
  /// Gives the goals of a route, and does what is done at them: as live::LiveRun.
  void follow_route(std::uint64_t frame);
  [[nodiscard]] std::uint64_t packages_released() const;
  /// Throws InputError for a planner of somebody else's that does not say what it does.
  void refuse_silence() const;
  void record_decision(const flight::DecisionOutput& out);
  /// What is due in this minor frame.
  void log_frame(MonotonicTime now);
  /// What the flight lane's own look did.
  void note_brake(MonotonicTime now);
  void log_decision(const log::DecisionEntry& entry, MonotonicTime now);
  void end_log(const char* reason);
  void record_failsafe();
  void summarise(double wall_s);

  const sitl::World& world_;
  const MissionConfig& config_;
  flight::FlightConfig flight_config_;
  MissionFaults faults_;
  sitl::CameraRig rig_;
  sitl::SimulatedAircraft aircraft_;
  std::unique_ptr<sitl::AutopilotAircraft> autopilot_;  ///< Null: the runtime commands the motors.
  std::vector<firmware_if::DepthCamera*> cameras_, watched_;
  std::unique_ptr<log::FlightLog> log_;                                   ///< Null: there is none.
  std::unique_ptr<FlightRecorder> recorder_;                              ///< Null: no inputs are recorded.
  std::atomic<double> cap_mps_{std::numeric_limits<double>::infinity()};  ///< As a route says.
  bool changed_{false};                                                   ///< The governor's settings.
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
  std::optional<RouteFlight> route_;
  Vector3 route_goal_W_ = Vector3::Zero();
  core::StateHash hash_;
  report::MissionReport report_;
  std::vector<double> latencies_s_;
  MonotonicTime next_state_{}, next_slice_{};  ///< Of the log.
  std::size_t told_events_{0};                 ///< Of the failsafe.
};

MissionRun::MissionRun(const sitl::World& world, const MissionConfig& config)
    : world_(world),
      config_(checked(world, config)),
      flight_config_(flight_config_of(world, config)),
      faults_(config),
      rig_(world, config.simulator, config.seed, sitl::Readers::kTwo),
      aircraft_(flight_config_.vehicle, config.simulator, ground_below(world), config.seed,
                config.flight.minor_frame, rig_),
      autopilot_(config.autopilot ? std::make_unique<sitl::AutopilotAircraft>(
                                        aircraft_, config.flight.vehicle, config.flight.minor_frame,
                                        companion_config(*config.autopilot, config.flight.vehicle))
                                  : nullptr),
      cameras_(faults_.connect(rig_.cameras())),
      watched_(faults_.connect(rig_.watched())),
      log_(config.log.empty() && config.viewer == nullptr
               ? nullptr
               : std::make_unique<log::FlightLog>(config.log, false)),
      recorder_(!config.log.empty() && why_not_replayed(config).empty()
                    ? std::make_unique<FlightRecorder>(*log_, aircraft_, cameras_, rig_.lidars())
                    : nullptr),
      setup_(flight_config_, config.backends, image_limits(config),
             parts_of(parts_of(config.own, config.route, cap_mps_), config.change, changed_), Pages::kHuge),
      prices_(prices_of(config, flight_config_)),
      timed_map_(setup_.parts().map, prices_),
      timed_planner_(setup_.parts().planner, prices_),
      planner_(timed_planner_, faults_.line()),
      flight_(flight_config_, flown(),
              recorder_ ? recorder_->cameras() : std::span<firmware_if::DepthCamera* const>(cameras_),
              parts(), setup_.arena(), recorder_ ? recorder_->lidars() : rig_.lidars()),
      system_(flight_.system()),
      judge_(config.judge, flight_config_.fence, flight_config_.vehicle.radius_m, world, aircraft_, system_) {
  if (config.route) route_.emplace(*config.route);
  setup_.check();
  aircraft_.stand_in(world);
  if (!faults_.empty()) aircraft_.connect(faults_.line());
  if (!config.flight.answers) aircraft_.ignore_kill_switch();
  if (!log_) return;
  if (config.viewer != nullptr) log_->show_to(*config.viewer);
  begin_log(*log_, recorded_flight_of(flight_config_, config_, cameras_, rig_.lidars()),
            why_not_replayed(config_), config_.profile_name, world_.start_W(), config_.source);
  log_->world(shapes_json(world_));
}

void MissionRun::log_frame(MonotonicTime now) {
  if (!log_) return;
  const std::span<const flight::FailsafeEvent> events = system_.pilot().events();
  for (; told_events_ < events.size(); ++told_events_) log_->write(failsafe_entry(events[told_events_], {}));
  if (now < next_state_) return;
  next_state_ = now + kStatePeriod;
  log::StateRecord record = state_record(system_, now, {}, autopilot_ == nullptr);
  record.has_truth = true;
  record.true_p_W = log::numbers_of(aircraft_.vehicle().state().p_WB);
  log_->write(record);
}

void MissionRun::note_brake(MonotonicTime now) {
  const std::uint64_t brakes = system_.flight_program().near_brakes();
  if (brakes == report_.result.near_brakes) return;
  report_.result.near_brakes = brakes;
  if (recorder_) recorder_->braked();
  if (log_)
    log_->event(now.time_since_epoch().count(), log::Level::kWarning, "flight", "braked for what is near");
}

void MissionRun::log_decision(const log::DecisionEntry& entry, MonotonicTime now) {
  if (!log_) return;
  log_->write(entry);
  if (now < next_slice_) return;
  next_slice_ = now + kSlicePeriod;
  const auto slice = std::make_unique<log::MapSlice>();
  slice->time_ns = entry.time_ns;
  fill_slice(system_.map().view(), aircraft_.vehicle().state().p_WB, *slice);
  log_->write(*slice);
}

void MissionRun::end_log(const char* reason) {
  if (!log_) return;
  const std::int64_t time_ns = flight_.now().time_since_epoch().count();
  if (recorder_) recorder_->finish(system_.map());
  log_->event(time_ns, log::Level::kInfo, "flight", reason);
  log_->result(time_ns, report::to_json(report_.result));
  if (config_.judged) {
    const LogVerdict verdict = config_.judged(report_);
    log_->event(time_ns, verdict.passed ? log::Level::kInfo : log::Level::kError, "verdict", verdict.text);
    log_->verdict(time_ns, verdict.json);
  }
  log_->finish();
  report_.log_error = log_->error();
}

flight::FlightParts MissionRun::parts() {
  const flight::FlightParts own = setup_.parts(watched_);
  stages::Planner& planner = faults_.empty() ? static_cast<stages::Planner&>(timed_planner_) : planner_;
  return {timed_map_, planner, own.policy, own.ways, own.watched};
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

void MissionRun::follow_route(std::uint64_t frame) {
  constexpr std::uint64_t kEvery = 20;  // 50 ms
  if (!route_ || frame % kEvery != 0) return;
  const MonotonicTime now = flight_.now();
  judge_.on_route(route_->is_done(), route_->holds(), now);
  stages::EstimatedState state;
  if (system_.pilot().phase() != governor::Phase::kMission ||
      system_.control().estimator().state(state) != Status::kOk)
    return;
  const double now_s = seconds(now.time_since_epoch());
  const Vector3 p_W = state.p_WB + state.shift_W;
  const bool is_there = flight::is_at_goal((p_W - route_goal_W_).norm(), state.v_WB.norm());
  const std::size_t at = route_->done();
  const RouteFlight::Order order = route_->step(now_s, p_W, is_there, packages_released());
  if (order.speed_mps) cap_mps_.store(*order.speed_mps, std::memory_order_relaxed);
  if (order.releases && autopilot_) autopilot_->companion().release_package();
  if (order.goal_W) {
    route_goal_W_ = *order.goal_W;
    (void)system_.decision_program().give_goals({&*order.goal_W, 1});  // refused: it does not come nearer
  }
  if (route_->done() > at && config_.route->steps[at].goal_W)
    report_.result.goals.push_back({route_goal_W_, "reached", now_s, (route_goal_W_ - p_W).norm()});
  judge_.on_route(route_->is_done(), route_->holds(), now);
}

std::uint64_t MissionRun::packages_released() const {
  return autopilot_ ? autopilot_->companion().counters().releases : 0;
}

void MissionRun::record_goals() {
  if (route_) {
    report_.result.route = {config_.route->steps.size(), route_->done(), packages_released()};
    if (route_->is_done()) return;
    const Vector3& p_W = aircraft_.vehicle().state().p_WB;
    report_.result.goals.push_back({route_goal_W_, report_.result.reason,
                                    seconds(flight_.now().time_since_epoch()), (route_goal_W_ - p_W).norm()});
    return;
  }
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
  const sitl::VehicleState& state = aircraft_.vehicle().state();
  log::DecisionEntry e = decision_entry(system_, out, lattice_of(flight_config_),
                                        report_.decisions.size() + 1, flight_.now(), {});
  e.p_WB = log::numbers_of(state.p_WB);
  e.speed_mps = state.v_WB.norm();
  log_decision(e, flight_.now());
  report::DecisionRecord r = record_of(e);
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
  const double energy_J = aircraft_.vehicle().state().energy_J;
  const double computing_J = config_.flight.vehicle.avionics_W * r.mission_time_s;
  r.energy_kJ = 1e-3 * energy_J;
  r.flight_Jpm = (energy_J - computing_J) / r.distance_m;
  r.computing_Jpm = computing_J / r.distance_m;
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
    const log::FailsafeEntry entry = failsafe_entry(e, {});
    report::FailsafeRecord record{
        seconds(e.time.time_since_epoch()), entry.action, entry.phase, {}, std::string(entry.sensor.view())};
    for (const governor::FailsafeRow& row : governor::kFailsafeTable) {
      if ((e.conditions & governor::bit(row.condition)) != 0)
        record.conditions.emplace_back(governor::to_string(row.condition));
    }
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
    follow_route(frame);
    const MonotonicTime now = flight_.now() + config_.flight.minor_frame;
    changed_ = config_.change.is_due(now);
    if (const flight::DecisionOutput* decision = flight_.step(faults_.computer(now))) {
      record_decision(*decision);
    }
    note_brake(now);
    log_frame(now);
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
  end_log(reason);
  return std::move(report_);
}

}  // namespace

report::MissionReport fly_mission(const sitl::World& world, const MissionConfig& config,
                                  const std::function<void(const Progress&)>& progress) {
  const auto run = std::make_unique<MissionRun>(world, config);
  return run->fly(progress);
}

}  // namespace roborun::mission
