#include "platform/live/live_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "core/executive/lane_meter.hpp"
#include "platform/flight/watchdog_program.hpp"
#include "platform/input/input_error.hpp"
#include "platform/live/bus_aircraft.hpp"
#include "platform/live/flight_end.hpp"
#include "platform/live/mavlink_aircraft.hpp"
#include "platform/live/port_aircraft.hpp"
#include "platform/log/log_thread.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/mission/recorded_flight.hpp"
#include "platform/rt/idle_latency.hpp"
#include "platform/rt/lane_set.hpp"
#include "platform/rt/memory_lock.hpp"
#include "platform/rt/service_notifier.hpp"

namespace roborun::live {
namespace {

constexpr std::chrono::milliseconds kLook{5};
constexpr std::chrono::milliseconds kAsk{50};

bool is_ready(const std::vector<Need>& needs) {
  return std::all_of(needs.begin(), needs.end(), [](const Need& need) { return need.lacks.empty(); });
}

std::string words_of(governor::ConditionSet set) {
  std::string text;
  for (const governor::FailsafeRow& row : governor::kFailsafeTable)
    if ((set & governor::bit(row.condition)) != 0)
      text += (text.empty() ? "" : "+") + std::string(governor::to_string(row.condition));
  return text;
}

rt::LaneSetConfig lane_config(const LiveConfig& config) {
  rt::LaneSetConfig lanes;
  lanes.minor_frame = config.flight.minor_frame;
  lanes.best_effort = config.best_effort;
  lanes.confine = config.confine;
  return lanes;
}

board::ImageLimits images_of(const LiveConfig& config) {
  return board::image_limits(config.rig, config.flight.vehicle, flight::lattice_of(config.flight));
}

std::unique_ptr<FarEnd> far_end_of(const LiveConfig& config, const rt::MonotonicClock& clock) {
  const bool releases = config.route && config.route->releases();
  if (config.autopilot)
    return std::make_unique<MavlinkAircraft>(
        *config.link.mavlink, *config.autopilot, sensor_port::VehiclePorts(config.link.name), config.rig,
        clock, clock.epoch(), config.route ? config.origin : std::nullopt, config.key);
  if (config.link.dronecan) {
    const sensor_port::VehiclePorts ports(config.link.name);
    auto wire = config.link.dronecan->empty() ? port_wire(ports, clock.epoch())
                                              : kernel_wire(*config.link.dronecan, clock.epoch());
    return std::make_unique<BusAircraft>(std::move(wire), ports, config.rig, config.flight.minor_frame,
                                         clock.epoch(), config.origin, config.lines, releases);
  }
  return std::make_unique<PortAircraft>(config.link.name, config.rig, config.flight.minor_frame,
                                        clock.epoch(), config.origin, releases);
}

LiveAutopilot report_of(const MavlinkAircraft& vehicle) {
  const firmware_if::mavlink::Companion& companion = vehicle.companion();
  const firmware_if::AutopilotReport report = companion.report();
  const auto& counters = companion.counters();
  return {firmware_if::to_string(report.stage),
          report.reason,
          report.subject,
          std::string(companion.text()),
          counters.set_points,
          counters.not_sent,
          counters.jumps,
          counters.reboots,
          seconds(vehicle.latency().quantile(0.5)),
          seconds(vehicle.latency().quantile(0.99)),
          seconds(vehicle.latency().max()),
          companion.clock().matched() ? seconds(companion.clock().uncertainty()) : 0.0};
}

class LiveRun {
 public:
  explicit LiveRun(const LiveConfig& config);
  LiveReport run(const std::function<void(const std::vector<Need>&)>& waiting,
                 const std::function<void(const LiveProgress&)>& progress);

 private:
  [[nodiscard]] bool wait_until_ready(const std::function<void(const std::vector<Need>&)>& waiting);
  void tell_need();
  void start();
  void fly(const std::function<void(const LiveProgress&)>& progress);
  /// A goal from the ground; from then on there is no mission.
  void listen_to_ground();
  /// What has changed, to whoever is on the ground.
  void tell_ground();
  /// Gives the goals of a mission, and does what is done at them.
  void follow_route(double now_s);
  void send_zeros();
  void begin_log();
  void end_log();
  void fill();

  const LiveConfig& config_;
  rt::MonotonicClock clock_;
  std::unique_ptr<FarEnd> far_;
  std::atomic<double> cap_mps_{std::numeric_limits<double>::infinity()};  ///< As the mission says.
  core::ClockMeter meter_;
  mission::FlightSetup setup_;
  flight::FlightSystem system_;
  core::Reactions reactions_;
  flight::WatchdogProgram watchdog_;
  Seen seen_;
  // Before the lanes, which write into it until they have ended.
  std::unique_ptr<log::FlightLog> log_;  ///< Null: there is none.
  std::unique_ptr<log::LogThread> log_thread_;
  SeenFlight flight_;
  SeenDecisions decisions_;
  Idle idle_;
  rt::LaneSet lanes_;
  MonotonicTime first_release_{};
  LiveReport report_;
  FlightEnd end_;
  std::optional<RouteFlight> route_;
  bool follows_route_{false};
  Ground ground_;
  std::string told_need_;
  governor::Phase told_phase_{governor::Phase::kGround};
  governor::Action told_action_{governor::Action::kGoOn};
  bool told_reason_{false};
};

LiveRun::LiveRun(const LiveConfig& config)
    : config_(config),
      far_(far_end_of(config, clock_)),
      setup_(config.flight, {}, images_of(config), mission::parts_of({}, config.route, cap_mps_)),
      system_(config.flight, meter_, *far_, far_->cameras(), setup_.parts(far_->watched()), setup_.arena(),
              far_->lidars()),
      flight_(system_, *far_, seen_),
      decisions_(system_, seen_),
      lanes_(lane_config(config), clock_, reactions_, {&flight_, &decisions_, &idle_, &watchdog_}),
      end_(seen_, config.stop, config.seconds, config.autopilot.has_value(), config.flight.goal_W),
      ground_(config.ground, config.key, *far_) {
  setup_.check();
  if (config.route) {
    route_.emplace(*config.route);
    follows_route_ = true;
    end_.set_goal(config.flight.goal_W, false);
  }
  meter_.attach(lanes_.lane(core::LaneId::kDecision));
  watchdog_.watch(lanes_.lane(core::LaneId::kFlight), lanes_.lane(core::LaneId::kDecision));
}

bool LiveRun::wait_until_ready(const std::function<void(const std::vector<Need>&)>& waiting) {
  // The motors' controllers speak ten times a second, and cameras no more seldom.
  constexpr double kLeast_s = 0.3;
  const MonotonicTime begin = clock_.now();
  int looks = 0;
  for (;;) {
    report_.needs = far_->look(clock_.now());
    const double passed_s = seconds(clock_.now() - begin);
    const bool ready = is_ready(report_.needs);
    if (ready) {  // an autopilot's frame begins where it says, whatever we were told
      const auto told = far_->origin();
      ground_.begins_at(told ? told : config_.origin);
    }
    if (ground_.step(clock_.now())) ground_.answer("it does not fly yet");
    tell_need();
    if (ready) return true;
    if (config_.stop && config_.stop()) return false;
    if (passed_s > std::max(config_.wait_s, kLeast_s)) return false;
    if (waiting && ++looks % 100 == 0) waiting(report_.needs);
    std::this_thread::sleep_for(kLook);
  }
}

void LiveRun::start() {
  first_release_ = lanes_.choose_first_release();
  if (log_thread_) {
    flight_.log_to(*log_thread_, first_release_);
    decisions_.log_to(*log_thread_, first_release_, flight::lattice_of(config_.flight));
  }
  const std::string error = lanes_.start();
  if (error.empty()) return;
  lanes_.stop();
  throw InputError(error);
}

void LiveRun::tell_need() {
  const auto lacking = std::find_if(report_.needs.begin(), report_.needs.end(),
                                    [](const Need& need) { return !need.lacks.empty(); });
  const std::string need = lacking == report_.needs.end()
                               ? "roborun: ready"
                               : fmt::format("roborun: {}: {}", lacking->device, lacking->lacks);
  if (need == told_need_) return;
  told_need_ = need;
  ground_.say(6, need);
}

void LiveRun::tell_ground() {
  const governor::Phase phase = seen_.phase.load(std::memory_order_relaxed);
  if (phase != std::exchange(told_phase_, phase))
    ground_.say(6, fmt::format("roborun: {}", governor::to_string(phase)));
  const governor::Action action = seen_.action.load(std::memory_order_relaxed);
  if (action != std::exchange(told_action_, action))
    ground_.say(4, fmt::format("roborun: {}", governor::to_string(action)));
  if (!end_.reason().empty() && !std::exchange(told_reason_, true))
    ground_.say(end_.reason() == "reached_goal" ? 6 : 4, fmt::format("roborun: {}", end_.reason()));
}

void LiveRun::listen_to_ground() {
  if (!seen_.flying.load(std::memory_order_relaxed) && end_.reason().empty())
    ground_.stands_at(end_.p_W().z());
  const auto goal_W = ground_.step(clock_.now());
  if (!goal_W) return;
  if (!end_.reason().empty()) return ground_.answer("it lands");
  if (system_.decision_program().give_goals({&*goal_W, 1}) != Status::kOk)
    return ground_.answer("outside of the bounds or the fence");
  follows_route_ = false;
  cap_mps_.store(std::numeric_limits<double>::infinity(), std::memory_order_relaxed);  // it was the mission's
  end_.set_goal(*goal_W, true);
  ground_.answer(nullptr);
}

void LiveRun::follow_route(double now_s) {
  if (!follows_route_ || seen_.phase.load(std::memory_order_relaxed) != governor::Phase::kMission) return;
  const RouteFlight::Order order =
      route_->step(now_s, end_.p_W(), end_.is_there(), far_->packages_released());
  if (order.speed_mps) cap_mps_.store(*order.speed_mps, std::memory_order_relaxed);
  if (order.releases) far_->release_package();
  if (order.goal_W) {
    (void)system_.decision_program().give_goals(
        {&*order.goal_W, 1});  // refused: it does not come nearer, and is given up
    end_.set_goal(*order.goal_W, false);
  }
  if (route_->holds()) end_.holds(now_s);
  if (route_->is_done()) end_.is_last();
}

void LiveRun::fly(const std::function<void(const LiveProgress&)>& progress) {
  const std::uint64_t heap_before = rt::sealed_heap_calls();
  start();
  rt::ServiceNotifier service;
  (void)service.tell("READY=1");
  double told_s = 0.0;
  while (!reactions_.stopping()) {
    std::this_thread::sleep_for(kAsk);
    const double now_s = seconds(clock_.now() - first_release_);
    if (!lanes_.lane(core::LaneId::kFlight).overdue(clock_.now())) (void)service.tell("WATCHDOG=1");
    listen_to_ground();
    if (end_.reason().empty()) follow_route(now_s);
    tell_ground();
    const FlightEnd::Order order = end_.step(now_s);
    if (order == FlightEnd::Order::kEnd) break;
    if (order == FlightEnd::Order::kLand) system_.flight_program().ask_to_land();
    if (progress && now_s > told_s + 0.25) {
      told_s = now_s;
      progress({now_s, end_.to_goal_m(), seen_.speed_mps.load(std::memory_order_relaxed),
                seen_.z_m.load(std::memory_order_relaxed), seen_.decisions.load(std::memory_order_relaxed),
                governor::to_string(seen_.phase.load(std::memory_order_relaxed)),
                governor::to_string(seen_.action.load(std::memory_order_relaxed))});
    }
  }
  lanes_.stop();
  send_zeros();
  report_.heap_calls_after_start = rt::sealed_heap_calls() - heap_before;
}

/// The lanes have ended: what the motors hear last are zeros, whatever it was that ended them.
void LiveRun::send_zeros() {
  // An autopilot does what it does when set-points end.
  if (firmware_if::Autopilot* const autopilot = far_->autopilot()) return autopilot->let_go();
  far_->disarm();
  for (int i = 0; i < 20; ++i) {
    far_->begin_frame(clock_.now());
    far_->end_frame(clock_.now());
    std::this_thread::sleep_for(config_.flight.minor_frame);
  }
}

void LiveRun::begin_log() {
  if (config_.log.empty()) return;
  log_ = std::make_unique<log::FlightLog>(config_.log, true);
  if (config_.viewer != nullptr) log_->show_to(*config_.viewer);
  mission::RecordedFlight flown;
  flown.flight = config_.flight;
  flown.sensors = config_.rig;
  for (const firmware_if::DepthCamera* camera : far_->cameras()) flown.mounts.push_back(camera->mount());
  for (const firmware_if::Lidar* lidar : far_->lidars()) flown.lidar_mounts.push_back(lidar->mount());
  mission::begin_log(*log_, flown, "it was flown in real time, where the clock ends stages");
  log_thread_ = std::make_unique<log::LogThread>(*log_);
}

void LiveRun::end_log() {
  if (!log_) return;
  log_thread_->stop();
  const std::int64_t time_ns = (clock_.now() - first_release_).count();
  log_->event(time_ns, log::Level::kInfo, "flight", fmt::format("{}; {}", report_.reason, report_.ended));
  log_->finish();
  report_.log_error = log_->error();
}

void LiveRun::fill() {
  report_.reason = end_.reason();
  report_.time_s = end_.reason_s();
  if (reactions_.stopping()) {
    report_.reason = fmt::format("stopped: {}", core::slot(reactions_.stopped_by()).name);
    report_.time_s = seconds(clock_.now() - first_release_);
  }
  report_.ended = end_.ended();
  if (report_.ended.empty()) report_.ended = seen_.flying.load() ? "in the air" : "on the ground";
  report_.reached_goal = report_.reason == "reached_goal";
  report_.distance_m = seen_.distance_m.load();
  report_.decisions = system_.decision_program().decisions();
  report_.near_brakes = system_.flight_program().near_brakes();
  for (const core::LaneSpec& spec : core::kLanes) {
    const std::uint64_t misses = lanes_.lane(spec.id).statistics().deadline_misses;
    // The lane without a priority renders nothing here: nobody waits for it.
    if (spec.priority > 0) report_.deadline_misses += misses;
    report_.lane_misses.emplace_back(spec.name, misses);
    const rt::KernelCounters& counters = lanes_.thread(spec.id).counters();
    report_.page_faults += counters.minor_faults + counters.major_faults;
  }
  report_.ports = far_->use(seen_.frame.load());
  if (const auto* const vehicle = dynamic_cast<const MavlinkAircraft*>(far_.get()))
    report_.autopilot = report_of(*vehicle);
  if (route_)
    report_.route = LiveRoute{config_.route->steps.size(), route_->done(), far_->packages_released()};
  report_.goals_given = ground_.given();
  report_.goals_refused = ground_.refused();
  report_.missing = lanes_.missing();
  for (const flight::FailsafeEvent& e : system_.pilot().events())
    report_.events.push_back(
        {seconds(e.time - first_release_), governor::to_string(e.action), words_of(e.conditions)});
}

LiveReport LiveRun::run(const std::function<void(const std::vector<Need>&)>& waiting,
                        const std::function<void(const LiveProgress&)>& progress) {
  const rt::IdleLatencyHold idle;
  if (const std::string why = lanes_.prepare(); !why.empty())
    throw InputError(fmt::format("cannot run in real time: {} (--best-effort runs on without)", why));
  report_.ready = wait_until_ready(waiting);
  if (report_.ready) {
    begin_log();
    fly(progress);
    fill();
    end_log();
  }
  return std::move(report_);
}

}  // namespace

LiveReport run_live(const LiveConfig& config, const std::function<void(const std::vector<Need>&)>& waiting,
                    const std::function<void(const LiveProgress&)>& progress) {
  rt::prepare_heap();
  if (config.flight.validate() != Status::kOk) throw InputError("vehicle: its numbers make no flight");
  const auto run = std::make_unique<LiveRun>(config);
  return run->run(waiting, progress);
}

}  // namespace roborun::live
