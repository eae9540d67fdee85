#include "platform/mission/audit_run.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

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
#include "platform/mission/flight_setup.hpp"
#include "platform/rt/host_identity.hpp"
#include "platform/rt/idle_latency.hpp"
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
  lanes.trace = config.trace;
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
  void start();
  void stop();
  void fill_lanes(report::AuditReport& report) const;
  void fill_slots(report::AuditReport& report) const;
  void fill_commands(report::AuditReport& report) const;
  void fill_kill_switch(report::AuditReport& report) const;
  void fill_flight(report::AuditReport& report);

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
  std::array<Injected, core::kLaneCount> program_;
  rt::LaneSet lanes_;
  std::vector<core::SlotEvent> trace_;
};

RealTimeRun::RealTimeRun(const sitl::World& world, const RealTimeConfig& config)
    : config_(config),
      flight_config_(flight_config_of(world, config.mission)),
      motor_bus_(motor_bus_of(config, clock_)),
      kill_lines_(config.kill ? std::make_unique<gpio::KernelKillLines>(*config.kill) : nullptr),
      cameras_(world, config.mission.simulator, config.mission.seed),
      aircraft_(flight_config_.vehicle, config.mission.simulator, ground_below(world), config.mission.seed,
                flight_config_.minor_frame, cameras_, outside(motor_bus_.get(), kill_lines_.get())),
      start_W_(aircraft_.vehicle().state().p_WB),
      setup_(flight_config_, config.mission.backends, image_limits(config.mission), config.mission.own),
      system_(flight_config_, meter_, aircraft_, cameras_.cameras(), setup_.parts(), setup_.arena(),
              cameras_.lidars()),
      program_{Injected{system_.flight_program(), config.inject, over_},
               Injected{system_.decision_program(), config.inject, over_},
               Injected{cameras_, config.inject, over_}, Injected{watchdog_, config.inject, over_}},
      lanes_(lane_config(config), clock_, reactions_,
             {&program_[0], &program_[1], &program_[2], &program_[3]}) {
  setup_.check();
  aircraft_.stand_in(world);
  meter_.attach(lanes_.lane(core::LaneId::kDecision));
  watchdog_.watch(lanes_.lane(core::LaneId::kFlight), lanes_.lane(core::LaneId::kDecision));
}

void RealTimeRun::start() {
  if (const std::string why = lanes_.prepare(); !why.empty())
    throw InputError(fmt::format("cannot run in real time: {} (--best-effort runs on without)", why));
  // Whole frames of simulated time from its own start, so that both clocks show the same.
  aircraft_.start(lanes_.choose_first_release() - flight_config_.minor_frame);
  const std::string error = lanes_.start();
  if (error.empty()) return;
  stop();
  throw InputError(error);
}

void RealTimeRun::stop() {
  over_.store(true, std::memory_order_relaxed);  // the lanes that run must end
  lanes_.stop();
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
    a.longest = s.longest;
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
  double told_s = 0.0;
  while (report.seconds < config_.seconds && !reactions_.stopping()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    report.seconds = passed_s();
    lanes_.drain_trace(trace_);
    if (!lanes_.lane(core::LaneId::kFlight).overdue(clock_.now())) (void)service.tell("WATCHDOG=1");
    if (progress && report.seconds >= told_s + 1.0) progress(told_s = report.seconds);
  }
  stop();
  report.seconds = passed_s();
  report.heap_calls_after_start = rt::sealed_heap_calls() - heap_before;
  lanes_.drain_trace(trace_);
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

report::AuditReport RealTimeRun::run(const std::function<void(double)>& progress) {
  report::AuditReport report;
  const rt::IdleLatencyHold idle;
  fly(progress, report);
  report.best_effort = !lanes_.missing().empty();
  report.missing = lanes_.missing();
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
  const rt::HostIdentity id = rt::identify_host();
  report.identity = {{"program", "roborun 0.1.0"},
                     {"build", id.build},
                     {"kernel", id.kernel},
                     {"preempt_rt", id.preempt_rt ? "yes" : "no"},
                     {"cpu", id.cpu},
                     {"cpus", fmt::format("{}", id.cpus)},
                     {"governor", id.governor},
                     {"isolated", id.isolated},
                     {"idle_latency", idle.describe()},
                     {"sched_rt_runtime_us", id.rt_runtime}};
  for (const core::SlotEvent& e : trace_) {
    report.trace.push_back({static_cast<std::size_t>(e.slot), e.frame,
                            1e-3 * static_cast<double>(e.begin.time_since_epoch().count()),
                            1e-3 * static_cast<double>(e.spent.count()), e.overrun});
  }
  return report;
}

}  // namespace

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
