#include "platform/app/real_time_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
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
#include "platform/app/camera_rig.hpp"
#include "platform/app/flight_system.hpp"
#include "platform/app/simulated_aircraft.hpp"
#include "platform/rt/host_identity.hpp"
#include "platform/rt/idle_latency.hpp"
#include "platform/rt/lane_thread.hpp"
#include "platform/rt/memory_lock.hpp"
#include "platform/rt/service_notifier.hpp"
#include "platform/sitl/world/input_error.hpp"

namespace roborun::app {
namespace {

constexpr Nanos kLeadTime{50'000'000};  // from the start of the threads to the first release

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
    if (error != 0) throw sitl::InputError("--load: stress-ng is not installed: apt-get install stress-ng");
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

std::unique_ptr<KernelMotorBus> motor_bus_of(const RealTimeConfig& config, const rt::MonotonicClock& clock) {
  if (!config.can) return nullptr;
  return std::make_unique<KernelMotorBus>((*config.can)[0], (*config.can)[1], clock,
                                          config.mission.minor_frame);
}

/// Everything of one run; its construction takes all memory.
class RealTimeRun {
 public:
  RealTimeRun(const sitl::World& world, const RealTimeConfig& config);
  report::AuditReport run(const std::function<void(double)>& progress);

 private:
  void start_threads();
  void collect_trace();
  void fill_lanes(report::AuditReport& report) const;
  void fill_slots(report::AuditReport& report) const;
  void fill_commands(report::AuditReport& report) const;
  void fill_kill_switch(report::AuditReport& report) const;

  const RealTimeConfig& config_;
  std::vector<std::string> missing_;
  rt::MonotonicClock clock_;
  std::unique_ptr<KernelMotorBus> motor_bus_;
  std::unique_ptr<KernelKillLines> kill_lines_;
  CameraServer cameras_;
  SimulatedAircraft aircraft_;
  core::ClockMeter meter_;
  FlightSystem system_;
  core::Reactions reactions_;
  WatchdogProgram watchdog_;
  std::atomic<bool> over_{false};  ///< Whatever was measured is measured.
  std::array<core::TraceRing, core::kLaneCount> ring_;
  std::array<Injected, core::kLaneCount> program_;
  std::array<core::LaneExecutive, core::kLaneCount> lane_;
  std::array<rt::LaneThread, core::kLaneCount> thread_;
  std::array<rt::Placement, core::kLaneCount> placement_{};
  std::vector<report::AuditTraceEvent> trace_;
};

RealTimeRun::RealTimeRun(const sitl::World& world, const RealTimeConfig& config)
    : config_(config),
      motor_bus_(motor_bus_of(config, clock_)),
      kill_lines_(config.kill ? std::make_unique<KernelKillLines>(*config.kill) : nullptr),
      cameras_(world, config.mission.camera, config.mission.seed),
      aircraft_(world, config.mission, cameras_, {motor_bus_.get(), kill_lines_.get()}),
      system_(world, config.mission, meter_, aircraft_, cameras_.cameras()),
      program_{Injected{system_.flight_program(), config.inject, over_},
               Injected{system_.decision_program(), config.inject, over_},
               Injected{cameras_, config.inject, over_}, Injected{watchdog_, config.inject, over_}},
      lane_{core::LaneExecutive(core::LaneId::kFlight, clock_, program_[0], reactions_,
                                config.trace ? &ring_[0] : nullptr),
            core::LaneExecutive(core::LaneId::kDecision, clock_, program_[1], reactions_,
                                config.trace ? &ring_[1] : nullptr),
            core::LaneExecutive(core::LaneId::kBackground, clock_, program_[2], reactions_,
                                config.trace ? &ring_[2] : nullptr),
            core::LaneExecutive(core::LaneId::kWatchdog, clock_, program_[3], reactions_,
                                config.trace ? &ring_[3] : nullptr)},
      thread_{rt::LaneThread(lane_[0], clock_), rt::LaneThread(lane_[1], clock_),
              rt::LaneThread(lane_[2], clock_), rt::LaneThread(lane_[3], clock_)} {
  meter_.attach(lane_[1]);
  watchdog_.watch(lane_[0], lane_[1]);
}

void RealTimeRun::start_threads() {
  missing_ = rt::why_not_real_time();
  // Lanes that have to share a CPU share it by priority.
  const bool fifo = rt::why_no_priority().empty();
  if (const std::string error = rt::lock_memory(); !error.empty()) missing_.push_back(error);
  // The baselines' libraries; a flight with the own map and planner never calls them.
  if (config_.mission.map_backend == "own" && config_.mission.planner_backend == "own")
    rt::unlock_libraries(std::array{"libompl", "libode", "liboctomap", "libboost_"});
  if (!missing_.empty() && !config_.best_effort)
    throw sitl::InputError(fmt::format("cannot run in real time: {} (--best-effort runs on without)",
                                       fmt::join(missing_, "; ")));
  // Whole frames of simulated time from its own start, so that both clocks show the same.
  const Nanos minor_frame = config_.mission.minor_frame;
  const std::int64_t frames = (clock_.now().time_since_epoch() + kLeadTime) / minor_frame + 1;
  const MonotonicTime first{frames * minor_frame};
  aircraft_.start(first - minor_frame);
  rt::seal_heap(config_.seal);
  for (std::size_t i = 0; i < core::kLaneCount; ++i) {
    placement_[i] = rt::placement_of(core::kLanes[i]);
    if (!fifo) placement_[i].priority = 0;
    // Timers that expire together are served together, each wake-up before the next: the others come between
    // the flight lane's releases, so that it waits for nobody's where CPUs are shared.
    const bool is_flight = core::kLanes[i].id == core::LaneId::kFlight;
    lane_[i].start(is_flight ? first : first + minor_frame / 2, minor_frame);
    const std::string error = thread_[i].start(placement_[i], true);
    over_.store(!error.empty(), std::memory_order_relaxed);  // the lanes that run must end
    if (!error.empty()) throw sitl::InputError(error);
  }
}

void RealTimeRun::collect_trace() {
  core::SlotEvent e;
  for (core::TraceRing& ring : ring_) {
    while (ring.pop(e))
      trace_.push_back({static_cast<std::size_t>(e.slot), e.frame,
                        1e-3 * static_cast<double>(e.begin.time_since_epoch().count()),
                        1e-3 * static_cast<double>(e.spent.count()), e.overrun});
  }
}

void RealTimeRun::fill_lanes(report::AuditReport& report) const {
  for (std::size_t i = 0; i < core::kLaneCount; ++i) {
    const core::LaneStatistics& s = lane_[i].statistics();
    const rt::KernelCounters& k = thread_[i].counters();
    report::AuditLane l;
    l.name = core::kLanes[i].name;
    l.cpu = placement_[i].cpu;
    l.priority = placement_[i].priority;
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
    l.stack_bytes = thread_[i].stack_bytes();
    l.stack_high_water_bytes = thread_[i].stack_high_water_bytes();
    report.lanes.push_back(std::move(l));
  }
}

void RealTimeRun::fill_slots(report::AuditReport& report) const {
  for (const core::SlotSpec& spec : core::kFrameTable) {
    const core::SlotStatistics& s = lane_[static_cast<std::size_t>(spec.lane)].statistics(spec.id);
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
  const sitl::CommandMeter& meter = motor_bus_->meter();
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

report::AuditReport RealTimeRun::run(const std::function<void(double)>& progress) {
  report::AuditReport report;
  const rt::IdleLatencyHold idle;
  const Vector3 start_W = aircraft_.vehicle().state().p_WB;
  {
    const Load load(config_.load);
    const std::uint64_t heap_before = rt::sealed_heap_calls();
    const auto begin = std::chrono::steady_clock::now();
    const auto passed_s = [begin] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    start_threads();
    rt::ServiceNotifier service;
    (void)service.tell("READY=1");
    report.locked_bytes = rt::locked_bytes();
    double told_s = 0.0;
    while (report.seconds < config_.seconds && !reactions_.stopping()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      report.seconds = passed_s();
      collect_trace();
      if (!lane_[0].overdue(clock_.now())) (void)service.tell("WATCHDOG=1");
      if (progress && report.seconds >= told_s + 1.0) progress(told_s = report.seconds);
    }
    for (rt::LaneThread& thread : thread_) thread.request_stop();
    over_.store(true, std::memory_order_relaxed);
    for (rt::LaneThread& thread : thread_) thread.join();
    report.seconds = passed_s();
    rt::seal_heap(rt::HeapSeal::kOpen);
    report.heap_calls_after_start = rt::sealed_heap_calls() - heap_before;
  }
  rt::unlock_memory();
  collect_trace();
  report.best_effort = !missing_.empty();
  report.missing = missing_;
  report.load = config_.load;
  report.rate_Hz = 1.0 / seconds(config_.mission.minor_frame);
  report.heap_sealed = rt::heap_seal_works();
  if (report.heap_calls_after_start > 0) {
    for (const rt::HeapCallSite& site : rt::heap_call_sites())
      report.heap_sites.emplace_back(site.name, site.count);
  }
  report.decisions = system_.decision_program().decisions();
  report.decisions_too_late = system_.decision_program().too_late();
  report.offers_refused = system_.flight_program().offers_refused();
  report.decision_stalls = watchdog_.stalls();
  if (watchdog_.stalled()) report.stalled_in = core::slot(*watchdog_.stalled()).name;
  report.exposures_dropped = cameras_.exposures_dropped();
  report.least_clearance_m = cameras_.least_clearance_m();
  report.speed_mps = aircraft_.vehicle().state().v_WB.norm();
  report.flown_m = (aircraft_.vehicle().state().p_WB - start_W).norm();
  if (reactions_.stopping()) report.stopped_by = core::slot(reactions_.stopped_by()).name;
  fill_lanes(report);
  fill_slots(report);
  if (motor_bus_) fill_commands(report);
  if (kill_lines_) fill_kill_switch(report);
  report.pools = system_.pools();
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
  report.trace = std::move(trace_);
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
  CameraRig rig(world, config.camera, config.seed);
  SimulatedAircraft aircraft(world, config, rig);
  core::ClockMeter meter;
  const auto system = std::make_unique<FlightSystem>(world, config, meter, aircraft, rig.cameras());
  return system->pools();
}

}  // namespace roborun::app
