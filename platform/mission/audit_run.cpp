#include "platform/mission/audit_run.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>

#include "core/executive/lane_meter.hpp"
#include "platform/can/motor_bus.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/flight/watchdog_program.hpp"
#include "platform/input/input_error.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/log/log_thread.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/mission/lane_logging.hpp"
#include "platform/mission/recorded_flight.hpp"
#include "platform/mission/scene.hpp"
#include "platform/report/build_identity.hpp"
#include "platform/report/sha256.hpp"
#include "platform/rt/host_identity.hpp"
#include "platform/rt/idle_latency.hpp"
#include "platform/rt/interference.hpp"
#include "platform/rt/lane_set.hpp"
#include "platform/rt/memory_lock.hpp"
#include "platform/rt/service_notifier.hpp"
#include "platform/sitl/aircraft/camera_rig.hpp"
#include "platform/sitl/aircraft/simulated_aircraft.hpp"

namespace roborun::mission {
namespace {

const char* to_string(core::OverrunPolicy policy) {
  switch (policy) {
    case core::OverrunPolicy::kSkip:
      return "skip";
    case core::OverrunPolicy::kDegrade:
      return "degrade";
    case core::OverrunPolicy::kBrake:
      return "brake";
    case core::OverrunPolicy::kStop:
      return "stop";
  }
  return "unknown";
}

/// Where the vehicle is by its own estimate, from lane to lane.
struct Place {
  std::atomic<double> x_m{0.0}, y_m{0.0}, z_m{0.0}, speed_mps{0.0};
};

/// The flight lane, and what it says to a log.
class LoggedFlight final : public core::LaneProgram {
 public:
  LoggedFlight(flight::FlightSystem& system, const sitl::SimulatedAircraft& aircraft, Place& place)
      : system_(system), aircraft_(aircraft), place_(place) {}
  void log_to(log::LogSink& sink, MonotonicTime start) noexcept { log_.log_to(sink, start); }
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override {
    system_.flight_program().run(slot, lane);
    if (slot != core::SlotId::kPublish) return;
    log_.frame_done(system_, lane.release(), true, &aircraft_.vehicle().state().p_WB);
    stages::EstimatedState state;
    if (system_.control().estimator().state(state) != Status::kOk) return;
    place_.x_m.store(state.p_WB.x(), std::memory_order_relaxed);
    place_.y_m.store(state.p_WB.y(), std::memory_order_relaxed);
    place_.z_m.store(state.p_WB.z(), std::memory_order_relaxed);
    place_.speed_mps.store(state.v_WB.norm(), std::memory_order_relaxed);
  }

 private:
  flight::FlightSystem& system_;
  const sitl::SimulatedAircraft& aircraft_;
  Place& place_;
  LaneLog log_;
};

/// The same of the decision lane.
class LoggedDecisions final : public core::LaneProgram {
 public:
  LoggedDecisions(flight::FlightSystem& system, const Place& place) : system_(system), place_(place) {}
  void log_to(log::LogSink& sink, MonotonicTime start, const PrecisionLattice& lattice) noexcept {
    log_.log_to(sink, start, lattice);
  }
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override {
    system_.decision_program().run(slot, lane);
    if (slot == core::SlotId::kHandOver)
      log_.handed_over(system_, lane.release(), {place_.x_m.load(), place_.y_m.load(), place_.z_m.load()},
                       place_.speed_mps.load());
  }

 private:
  flight::FlightSystem& system_;
  const Place& place_;
  DecisionLog log_;
};

/// Runs the program, and in one of its slots the fault.
class Injected final : public core::LaneProgram {
 public:
  Injected(core::LaneProgram& program, const std::optional<Injection>& fault, const std::atomic<bool>& over)
      : program_(program), fault_(fault), over_(over) {}
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override {
    program_.run(slot, lane);
    if (!fault_ || fault_->slot != slot || ++run_ <= fault_->from_run ||
        run_ - fault_->from_run > fault_->runs)
      return;
    const MonotonicTime until = lane.now() + fault_->spin;
    if (fault_->heap_call) {
      void* volatile block = std::malloc(32);
      std::free(block);
    }
    while (lane.now() < until && !over_.load(std::memory_order_relaxed)) {
    }
  }

 private:
  core::LaneProgram& program_;
  const std::optional<Injection>& fault_;
  const std::atomic<bool>& over_;
  std::uint64_t run_{0};
};

/// Notes what goes into a lane's frames, and keeps it for the frame in which each slot took longest.
class Noted final : public core::LaneProgram {
 public:
  /// `decisions`: of the decision lane, which alone writes it.
  Noted(core::LaneProgram& program, std::atomic<std::uint64_t>& decisions,
        const flight::DecisionProgram* decides, const sitl::SimulatedAircraft* flies)
      : program_(program), decisions_(decisions), decides_(decides), flies_(flies) {}
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override {
    if (lane.frame() != frame_) keep(lane);
    frame_ = lane.frame();
    program_.run(slot, lane);
    if (slot == core::SlotId::kGather && decides_ != nullptr)
      decisions_.store(decides_->decisions(), std::memory_order_relaxed);
    if (slot == core::SlotId::kWorld && flies_ != nullptr) {
      p_WB_ = flies_->vehicle().state().p_WB;
      speed_mps_ = flies_->vehicle().state().v_WB.norm();
    }
    decision_ = decisions_.load(std::memory_order_relaxed);
  }
  /// What is known of the frame that has ended: also to be called after the last one.
  void keep(const core::LaneExecutive& lane) noexcept {
    for (const core::SlotSpec& spec : core::kFrameTable) {
      if (spec.lane != lane.id()) continue;
      const core::SlotStatistics& s = lane.statistics(spec.id);
      if (s.time.count() == 0 || s.longest.frame != frame_) continue;
      report::WorstFrame& worst = worst_[static_cast<std::size_t>(spec.id)];
      worst.known = true;
      worst.decision = decision_;
      worst.p_WB = {p_WB_.x(), p_WB_.y(), p_WB_.z()};
      worst.speed_mps = speed_mps_;
    }
  }
  [[nodiscard]] const report::WorstFrame& worst(core::SlotId slot) const noexcept {
    return worst_[static_cast<std::size_t>(slot)];
  }

 private:
  core::LaneProgram& program_;
  std::atomic<std::uint64_t>& decisions_;
  const flight::DecisionProgram* decides_;
  const sitl::SimulatedAircraft* flies_;
  std::uint64_t frame_{0};
  std::uint64_t decision_{0};
  Vector3 p_WB_ = Vector3::Zero();
  double speed_mps_{0.0};
  std::array<report::WorstFrame, core::kSlotCount> worst_{};
};

/// What the lanes traced: the worst of each stretch of time, and all of it where that is wanted. All memory is taken at
/// the construction.
class Evidence {
 public:
  explicit Evidence(const RealTimeConfig& config) : seconds_(config.seconds), keeps_(config.trace) {
    fresh_.reserve(core::kLaneCount * 8192);
    if (keeps_) all_.reserve(traced_bytes(config) / sizeof(core::TraceEvent));
    for (auto& lane : line_) lane.resize(report::kTimeColumns);
  }
  void take(rt::LaneSet& lanes, MonotonicTime begin) {
    fresh_.clear();
    lanes.drain_trace(fresh_);
    for (const core::TraceEvent& e : fresh_) {
      if (e.is_frame) add(e, begin);
      if (!keeps_) continue;
      if (all_.size() < all_.capacity())
        all_.push_back(e);
      else
        ++no_room_;
    }
  }
  [[nodiscard]] const std::vector<report::TimeColumn>& line(core::LaneId id) const {
    return line_[static_cast<std::size_t>(id)];
  }
  [[nodiscard]] std::uint64_t no_room() const noexcept { return no_room_; }
  [[nodiscard]] std::vector<core::TraceEvent> all() && { return std::move(all_); }

 private:
  void add(const core::TraceEvent& e, MonotonicTime begin) {
    const double share = roborun::seconds(e.release - begin) / seconds_;
    const auto last = static_cast<double>(report::kTimeColumns - 1);
    const auto at =
        static_cast<std::size_t>(std::clamp(share * static_cast<double>(report::kTimeColumns), 0.0, last));
    report::TimeColumn& column = line_[static_cast<std::size_t>(e.lane)][at];
    column.worst_jitter_us = std::max(column.worst_jitter_us, 1e6 * roborun::seconds(e.begin - e.release));
    column.worst_response_us = std::max(column.worst_response_us, 1e6 * roborun::seconds(e.end - e.release));
    ++column.frames;
    column.misses += e.overrun ? 1U : 0U;
  }
  double seconds_;
  bool keeps_;
  std::vector<core::TraceEvent> fresh_, all_;
  std::uint64_t no_room_{0};
  std::array<std::vector<report::TimeColumn>, core::kLaneCount> line_;
};

/// stress-ng on all CPUs for as long as it lives.
class Load {
 public:
  explicit Load(bool wanted) {
    if (!wanted) return;
    const char* arguments[] = {"stress-ng", "--cpu", "0", "--vm",    "1",    "--vm-bytes",
                               "64M",       "--io",  "1", "--quiet", nullptr};
    // posix_spawn leaves the strings alone; its signature is older than const.
    const int error =
        posix_spawnp(&pid_, "stress-ng", nullptr, nullptr, const_cast<char**>(arguments), environ);
    if (error != 0) throw InputError("--load: stress-ng is not installed: apt-get install stress-ng");
    std::this_thread::sleep_for(std::chrono::seconds(1));
  }
  ~Load() {
    if (pid_ <= 0) return;
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

 private:
  pid_t pid_{-1};
};

std::unique_ptr<can::KernelMotorBus> motor_bus_of(const RealTimeConfig& config,
                                                  const rt::MonotonicClock& clock) {
  if (!config.can) return nullptr;
  return std::make_unique<can::KernelMotorBus>((*config.can)[0], (*config.can)[1], clock.epoch(),
                                               config.mission.flight.minor_frame);
}

sitl::OutsideActuators outside(can::KernelMotorBus* bus, gpio::KernelKillLines* kill) {
  sitl::OutsideActuators outside;
  if (bus != nullptr) {
    outside.node = &bus->node();
    for (std::size_t i = 0; i < outside.esc.size(); ++i) outside.esc[i] = &bus->esc(i);
  }
  if (kill != nullptr) {
    outside.kill_open = &kill->open();
    outside.kill_closed = &kill->closed();
  }
  return outside;
}

/// The baselines' libraries; a flight with the own map and planner never calls them.
constexpr std::array kBaselineLibraries{"libompl", "libode", "liboctomap", "libboost_"};

rt::LaneSetConfig lane_config(const RealTimeConfig& config) {
  rt::LaneSetConfig lanes;
  lanes.minor_frame = config.mission.flight.minor_frame;
  lanes.seal = config.seal;
  lanes.best_effort = config.best_effort;
  lanes.confine = config.confine;
  lanes.trace = true;
  if (config.mission.backends == board::BackendNames{} && config.mission.own.empty())
    lanes.unneeded_libraries = kBaselineLibraries;
  return lanes;
}

/// Everything of one run; its construction takes all memory.
class RealTimeRun {
 public:
  RealTimeRun(const sitl::World& world, const RealTimeConfig& config);
  report::AuditReport run(const std::function<void(double)>& progress);

 private:
  void fly(const std::function<void(double)>& progress, report::AuditReport& report);
  [[nodiscard]] std::vector<int> lane_cpus() const;
  void start();
  void stop();
  void begin_log();
  void end_log(report::AuditReport& report);
  void fill_lanes(report::AuditReport& report) const;
  void fill_slots(report::AuditReport& report) const;
  void fill_commands(report::AuditReport& report) const;
  void fill_kill_switch(report::AuditReport& report) const;
  void fill_flight(report::AuditReport& report);
  void fill_identity(report::AuditReport& report, const rt::IdleLatencyHold& idle) const;

  const sitl::World& world_;
  const RealTimeConfig& config_;
  flight::FlightConfig flight_config_;
  rt::MonotonicClock clock_;
  std::unique_ptr<can::KernelMotorBus> motor_bus_;
  std::unique_ptr<gpio::KernelKillLines> kill_lines_;
  sitl::CameraServer cameras_;
  sitl::SimulatedAircraft aircraft_;
  Vector3 start_W_;
  core::ClockMeter meter_;
  FlightSetup setup_;
  flight::FlightSystem system_;
  core::Reactions reactions_;
  flight::WatchdogProgram watchdog_;
  std::atomic<bool> over_{false};  ///< Whatever was measured is measured.
  std::atomic<std::uint64_t> decisions_{0};
  // Before the lanes, which write into it until they have ended.
  std::unique_ptr<log::FlightLog> log_;  ///< Null: there is none.
  std::unique_ptr<log::LogThread> log_thread_;
  Place place_;
  LoggedFlight flight_;
  LoggedDecisions logged_decisions_;
  std::array<Injected, core::kLaneCount> program_;
  std::array<Noted, core::kLaneCount> noted_;
  rt::LaneSet lanes_;
  Evidence evidence_;
  MonotonicTime first_release_{};
};

RealTimeRun::RealTimeRun(const sitl::World& world, const RealTimeConfig& config)
    : world_(world),
      config_(config),
      flight_config_(flight_config_of(world, config.mission)),
      motor_bus_(motor_bus_of(config, clock_)),
      kill_lines_(config.kill ? std::make_unique<gpio::KernelKillLines>(*config.kill) : nullptr),
      cameras_(world, config.mission.simulator, config.mission.seed),
      aircraft_(flight_config_.vehicle, config.mission.simulator, ground_below(world), config.mission.seed,
                flight_config_.minor_frame, cameras_, outside(motor_bus_.get(), kill_lines_.get())),
      start_W_(aircraft_.vehicle().state().p_WB),
      setup_(flight_config_, config.mission.backends, image_limits(config.mission), config.mission.own),
      system_(flight_config_, meter_, aircraft_, cameras_.cameras(), setup_.parts(cameras_.watched()),
              setup_.arena(), cameras_.lidars()),
      flight_(system_, aircraft_, place_),
      logged_decisions_(system_, place_),
      program_{Injected{flight_, config.inject, over_}, Injected{logged_decisions_, config.inject, over_},
               Injected{cameras_, config.inject, over_}, Injected{watchdog_, config.inject, over_}},
      noted_{Noted{program_[0], decisions_, nullptr, &aircraft_},
             Noted{program_[1], decisions_, &system_.decision_program(), nullptr},
             Noted{program_[2], decisions_, nullptr, nullptr},
             Noted{program_[3], decisions_, nullptr, nullptr}},
      lanes_(lane_config(config), clock_, reactions_, {&noted_[0], &noted_[1], &noted_[2], &noted_[3]}),
      evidence_(config) {
  setup_.check();
  aircraft_.stand_in(world);
  meter_.attach(lanes_.lane(core::LaneId::kDecision));
  watchdog_.watch(lanes_.lane(core::LaneId::kFlight), lanes_.lane(core::LaneId::kDecision));
}

void RealTimeRun::start() {
  if (const std::string why = lanes_.prepare(); !why.empty())
    throw InputError(fmt::format("cannot run in real time: {} (--best-effort runs on without)", why));
  // Whole frames of simulated time from its own start, so that both clocks show the same.
  first_release_ = lanes_.choose_first_release();
  aircraft_.start(first_release_ - flight_config_.minor_frame);
  begin_log();
  const std::string error = lanes_.start();
  if (error.empty()) return;
  stop();
  throw InputError(error);
}

std::vector<int> RealTimeRun::lane_cpus() const {
  std::vector<int> cpus;
  cpus.reserve(core::kLaneCount);
  for (const core::LaneSpec& spec : core::kLanes) cpus.push_back(lanes_.placement(spec.id).cpu);
  return cpus;
}

void RealTimeRun::stop() {
  over_.store(true, std::memory_order_relaxed);  // the lanes that run must end
  lanes_.stop();
}

void RealTimeRun::begin_log() {
  if (config_.mission.log.empty()) return;
  log_ = std::make_unique<log::FlightLog>(config_.mission.log, true);
  mission::begin_log(
      *log_, recorded_flight_of(flight_config_, config_.mission, cameras_.cameras(), cameras_.lidars()),
      "it was flown in real time, where the clock ends stages", config_.mission.profile_name,
      world_.start_W());
  log_->world(shapes_json(world_));
  log_thread_ = std::make_unique<log::LogThread>(*log_);
  flight_.log_to(*log_thread_, first_release_);
  logged_decisions_.log_to(*log_thread_, first_release_, flight::lattice_of(flight_config_));
}

void RealTimeRun::end_log(report::AuditReport& report) {
  if (!log_) return;
  log_thread_->stop();
  log_->event(static_cast<std::int64_t>(1e9 * report.seconds), log::Level::kInfo, "flight",
              report.interrupted ? "interrupted" : "the audit ended");
  log_->finish();
  const log::RingDrops drops = log_thread_->drops();
  report.identity.emplace_back("log", fmt::format("{}; {} states, {} decisions, {} slices dropped",
                                                  log_->error().empty() ? "whole" : log_->error(),
                                                  drops.states, drops.decisions, drops.slices));
}

void RealTimeRun::fill_lanes(report::AuditReport& report) const {
  for (const core::LaneSpec& spec : core::kLanes) {
    const core::LaneStatistics& s = lanes_.lane(spec.id).statistics();
    const rt::LaneThread& thread = lanes_.thread(spec.id);
    const rt::KernelCounters& k = thread.counters();
    report::AuditLane l;
    l.name = spec.name;
    l.cpu = lanes_.placement(spec.id).cpu;
    l.priority = lanes_.placement(spec.id).priority;
    l.frames = s.frames;
    l.slips = s.slips;
    l.deadline_misses = s.deadline_misses;
    l.period_us = 1e6 * seconds(spec.period == core::kMinorFrame ? flight_config_.minor_frame : spec.period);
    l.time_line = evidence_.line(spec.id);
    l.jitter = report::summarise(s.jitter);
    l.overhead = report::summarise(s.overhead);
    l.response = report::summarise(s.response);
    l.minor_faults = k.minor_faults;
    l.major_faults = k.major_faults;
    l.voluntary_switches = k.voluntary_switches;
    l.involuntary_switches = k.involuntary_switches;
    l.migrations = k.migrations;
    l.migrations_known = k.migrations_known;
    l.stack_bytes = thread.stack_bytes();
    l.stack_high_water_bytes = thread.stack_high_water_bytes();
    report.lanes.push_back(std::move(l));
  }
}

void RealTimeRun::fill_slots(report::AuditReport& report) const {
  for (const core::SlotSpec& spec : core::kFrameTable) {
    const core::SlotStatistics& s = lanes_.lane(spec.lane).statistics(spec.id);
    report::AuditSlot a;
    a.name = spec.name;
    a.lane = core::lane(spec.lane).name;
    a.policy = to_string(spec.on_overrun);
    a.time = report::summarise(s.time);
    a.budget_us = 1e-3 * static_cast<double>((s.time.count() > 0 ? s.budget : spec.budget).count());
    a.margin_ratio = s.margin_ratio;
    a.overruns = s.overruns;
    a.reactions = s.reactions;
    a.skipped = s.skipped;
    a.longest = noted_[static_cast<std::size_t>(spec.lane)].worst(spec.id);
    a.longest.cause = s.longest;
    a.longest.seed = config_.mission.seed;
    a.block_frames = s.maxima.block_length();
    std::vector<double> maxima_us;
    for (std::size_t i = 0; i < s.maxima.count(); ++i)
      maxima_us.push_back(1e-3 * static_cast<double>(s.maxima[i].count()));
    a.pwcet = report::fit_pwcet(maxima_us);
    report.slots.push_back(std::move(a));
  }
}

void RealTimeRun::fill_commands(report::AuditReport& report) const {
  const can::CommandMeter& meter = motor_bus_->meter();
  report::CommandPath& path = report.commands.emplace();
  path.interfaces = *config_.can;
  path.sent = meter.sent();
  path.refused = aircraft_.actuators().node().counters().commands_refused;
  path.heard = meter.heard();
  path.lost = meter.lost();
  path.late = meter.late();
  path.age = report::summarise(meter.age());
  path.gap = report::summarise(meter.gap());
}

void RealTimeRun::fill_kill_switch(report::AuditReport& report) const {
  const firmware_if::KillSwitch& kill = aircraft_.actuators().kill_switch();
  const firmware_if::KillSwitch::Counters& c = kill.counters();
  report.kill_switch = {{(*config_.kill)[0].name, (*config_.kill)[1].name},
                        c.samples,
                        c.pressed,
                        c.faults,
                        c.glitches,
                        kill.killed()};
}

void RealTimeRun::fly(const std::function<void(double)>& progress, report::AuditReport& report) {
  const Load load(config_.load);
  const std::uint64_t heap_before = rt::sealed_heap_calls();
  const auto begin = std::chrono::steady_clock::now();
  const auto passed_s = [begin] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  start();
  rt::ServiceNotifier service;
  (void)service.tell("READY=1");
  report.locked_bytes = rt::locked_bytes();
  rt::InterferenceWatch others(lane_cpus());
  double told_s = 0.0;
  while (report.seconds < config_.seconds && !reactions_.stopping()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    report.seconds = passed_s();
    evidence_.take(lanes_, first_release_);
    if (config_.stop && config_.stop()) {
      report.interrupted = true;
      break;
    }
    if (!lanes_.lane(core::LaneId::kFlight).overdue(clock_.now())) (void)service.tell("WATCHDOG=1");
    if (report.seconds < told_s + 1.0) continue;
    told_s = report.seconds;
    others.sample();
    if (progress) progress(told_s);
  }
  for (rt::Disturbance& d : others.finish())
    report.interference.push_back({std::move(d.name), std::move(d.unit), d.total, d.worst_second});
  stop();
  report.seconds = passed_s();
  report.heap_calls_after_start = rt::sealed_heap_calls() - heap_before;
  evidence_.take(lanes_, first_release_);
  report.events_lost = lanes_.events_lost() + evidence_.no_room();
  for (std::size_t i = 0; i < core::kLaneCount; ++i) noted_[i].keep(lanes_.lane(core::kLanes[i].id));
}

void RealTimeRun::fill_flight(report::AuditReport& report) {
  report.decisions = system_.decision_program().decisions();
  report.decisions_too_late = system_.decision_program().too_late();
  report.offers_refused = system_.flight_program().offers_refused();
  report.decision_stalls = watchdog_.stalls();
  if (watchdog_.stalled()) report.stalled_in = core::slot(*watchdog_.stalled()).name;
  report.exposures_dropped = cameras_.exposures_dropped();
  report.least_clearance_m = cameras_.least_clearance_m();
  report.speed_mps = aircraft_.vehicle().state().v_WB.norm();
  report.flown_m = (aircraft_.vehicle().state().p_WB - start_W_).norm();
  if (reactions_.stopping()) report.stopped_by = core::slot(reactions_.stopped_by()).name;
}

void RealTimeRun::fill_identity(report::AuditReport& report, const rt::IdleLatencyHold& idle) const {
  const rt::HostIdentity id = rt::identify_host();
  const report::BuildIdentity build = report::build_identity();
  std::string real_time = report.missing.empty() ? "yes" : "no";
  for (const std::string& why : report.missing) real_time += "; " + why;
  report.identity = {
      {"program", fmt::format("roborun {}", build.version)},
      {"commit", std::string(build.commit)},
      {"program_digest", "sha256 " + report::sha256_of_file("/proc/self/exe")},
      {"compiler", std::string(build.compiler)},
      {"flags", std::string(build.flags)},
      {"rate_Hz", fmt::format("{:g}", report.rate_Hz)},
      {"asked_seconds", fmt::format("{:g}", config_.seconds)},
      {"seed", fmt::format("{}", config_.mission.seed)},
      {"load", config_.load ? "stress-ng on all CPUs" : "none"},
      {"bus", config_.can ? (*config_.can)[0] + " to " + (*config_.can)[1] : "simulated"},
      {"kill_lines",
       config_.kill ? (*config_.kill)[0].name + " and " + (*config_.kill)[1].name : "simulated"},
      {"injected", config_.inject ? fmt::format("{} for {:g} ms", core::slot(config_.inject->slot).name,
                                                1e3 * seconds(config_.inject->spin))
                                  : "nothing"},
      {"real_time", real_time},
      {"host", id.host},
      {"kernel", id.kernel},
      {"preempt_rt", id.preempt_rt ? "yes" : "no"},
      {"cpu", id.cpu},
      {"cpus", fmt::format("{}", id.cpus)},
      {"microcode", id.microcode},
      {"firmware", id.firmware},
      {"governor", id.governor},
      {"frequency", id.frequency},
      {"isolated", id.isolated},
      {"nohz_full", id.nohz_full},
      {"idle_latency", idle.describe()},
      {"sched_rt_runtime_us", id.rt_runtime}};
  if (report.interrupted)
    report.identity.emplace_back("interrupted", fmt::format("after {:.1f} s", report.seconds));
}

report::AuditReport RealTimeRun::run(const std::function<void(double)>& progress) {
  report::AuditReport report;
  const rt::IdleLatencyHold idle;
  fly(progress, report);
  report.missing = lanes_.missing();
  report.best_effort = !report.missing.empty();
  report.load = config_.load;
  report.rate_Hz = 1.0 / seconds(flight_config_.minor_frame);
  report.heap_sealed = rt::heap_seal_works();
  if (report.heap_calls_after_start > 0) {
    for (const rt::HeapCallSite& site : rt::heap_call_sites())
      report.heap_sites.emplace_back(site.name, site.count);
  }
  fill_flight(report);
  fill_lanes(report);
  fill_slots(report);
  if (motor_bus_) fill_commands(report);
  if (kill_lines_) fill_kill_switch(report);
  report.pools = setup_.pools();
  fill_identity(report, idle);
  end_log(report);
  report.trace = std::move(evidence_).all();
  return report;
}

}  // namespace

std::size_t traced_bytes(const RealTimeConfig& config) {
  // Events a second: a frame and six slots of the flight lane, two and a half of the decision lane's frame, which
  // mostly has one slot, and those of background and watchdog. What does not fit is counted as lost.
  const double rate_Hz = 1.0 / seconds(config.mission.flight.minor_frame);
  return static_cast<std::size_t>((config.seconds + 2.0) * (10.0 * rate_Hz + 500.0)) *
         sizeof(core::TraceEvent);
}

report::AuditReport run_real_time(const sitl::World& world, const RealTimeConfig& config,
                                  const std::function<void(double)>& progress) {
  rt::prepare_heap();
  const auto run = std::make_unique<RealTimeRun>(world, config);
  return run->run(progress);
}

std::vector<report::PoolUse> memory_plan_of(const sitl::World& world, const MissionConfig& config) {
  const flight::FlightConfig flight = flight_config_of(world, config);
  FlightSetup setup(flight, config.backends, image_limits(config), config.own);
  sitl::CameraRig rig(world, config.simulator, config.seed);
  sitl::SimulatedAircraft aircraft(flight.vehicle, config.simulator, ground_below(world), config.seed,
                                   flight.minor_frame, rig);
  core::ClockMeter meter;
  const auto system = std::make_unique<flight::FlightSystem>(flight, meter, aircraft, rig.cameras(),
                                                             setup.parts(), setup.arena(), rig.lidars());
  setup.check();
  return setup.pools();
}

}  // namespace roborun::mission
