#include "platform/live/plant.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <memory>
#include <thread>
#include <utility>

#include "core/exchange/spsc_ring.hpp"
#include "platform/flight/goal_queue.hpp"
#include "platform/input/input_error.hpp"
#include "platform/live/pictures.hpp"
#include "platform/live/plant_faults.hpp"
#include "platform/live/plant_ports.hpp"
#include "platform/live/plant_side.hpp"
#include "platform/rt/lane_thread.hpp"
#include "platform/rt/monotonic_clock.hpp"
#include "platform/sitl/aircraft/simulated_aircraft.hpp"

namespace roborun::live {
namespace {

constexpr int kPriority = 70;  // below the flight lane of a runtime on the same machine, above its decisions
constexpr Nanos kStoodStill{100'000'000};
constexpr Nanos kListenAgain{500'000'000};
constexpr Nanos kSilent{500'000'000};
constexpr double kOffGround_m = 0.5;
constexpr double kUneven_m = 0.3;  // how much ground may rise around where it stands
constexpr double kHardTouchdown_mps = 2.0;
constexpr double kOwnApproach_mps = 0.3;
constexpr Nanos kDown{1'000'000'000};  // on the ground with its motors off, until a flight is over

/// Pictures on a thread of their own; none where another process makes them.
class PictureThread final : public sitl::ExposureSink {
 public:
  PictureThread(const sitl::World& world, const PlantConfig& config) {
    if (config.pictures) pictures_.emplace(world, config.mission, config.port);
  }
  ~PictureThread() override { stop(); }
  PictureThread(const PictureThread&) = delete;
  PictureThread& operator=(const PictureThread&) = delete;

  void start() {
    if (pictures_) thread_ = std::thread([this] { run(); });
  }
  void stop() {
    over_.store(true);
    if (thread_.joinable()) thread_.join();
  }
  void expose(MonotonicTime now, const Pose& X_WB) noexcept override {
    if (pictures_) (void)exposure_.push({now, X_WB});
  }
  /// From the plant's clock to CLOCK_MONOTONIC.
  void set_shift(Nanos shift) noexcept { shift_.store(shift.count(), std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t sent() const noexcept { return sent_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t lost() const noexcept { return exposure_.dropped(); }

 private:
  struct Look {
    MonotonicTime now{};
    Pose X_WB{};
  };
  void run() {
    while (!over_.load(std::memory_order_relaxed)) {
      Look look;
      while (exposure_.pop(look)) pictures_->expose(look.now, look.X_WB);
      sent_ += pictures_->send(Nanos{shift_.load(std::memory_order_relaxed)});
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  std::optional<Pictures> pictures_;
  core::SpscRing<Look, 2048> exposure_;
  std::atomic<std::int64_t> shift_{0};
  std::atomic<std::uint64_t> sent_{0};
  std::atomic<bool> over_{false};
  std::thread thread_;
};

class Plant {
 public:
  Plant(const sitl::World& world, const PlantConfig& config);
  PlantReport run(const std::function<void(const PlantProgress&)>& progress);

 private:
  /// One minor frame of the world, when it is due.
  void keep_pace();
  void step(MonotonicTime now);
  /// The same as a real autopilot steps it; less where it is silent.
  void follow();
  /// The world's clock beside ours: behind it by what we were late, and never ahead of it.
  void keep_time(MonotonicTime now);
  void judge();
  void judge_collision(const sitl::VehicleState& s);
  void wait_until(MonotonicTime due) const;
  [[nodiscard]] double time_s() const { return seconds(plant_.now() - first_word_.value_or(start_)); }

  const sitl::World& world_;
  const PlantConfig& config_;
  flight::FlightConfig flight_;
  rt::MonotonicClock clock_;
  sensor_port::VehiclePorts names_;
  // What may be refused, before any port is made.
  KernelEnds kernel_;                     ///< Null: the bus is made of ports, or there is none.
  std::unique_ptr<PhysicsLink> physics_;  ///< Null: this machine's clock steps the world.
  PictureThread pictures_;
  TruthPort truth_;
  PlantFaults faults_;
  sitl::SimulatedAircraft aircraft_;
  sitl::SimulatedPlant& plant_{aircraft_.plant()};
  std::unique_ptr<PlantSide> side_;  ///< Null: there is physics_.
  Nanos held_{0};                    ///< So much later is it than in the world, which stood still.
  MonotonicTime start_{}, listened_{}, heard_{};
  std::optional<MonotonicTime> first_word_;
  std::uint64_t frame_{0}, stalls_{0};
  bool left_ground_{false};
  double sink_mps_{0.0};
  double clearance_m_{kClearanceCap_m};
  MonotonicTime turning_{};  ///< When motors turned last, or it was in the air.
  std::optional<double> goal_s_;
  PlantReport report_;
};

Plant::Plant(const sitl::World& world, const PlantConfig& config)
    : world_(world),
      config_(config),
      flight_(mission::flight_config_of(world, config.mission)),
      names_(config.port),
      kernel_(kernel_ends(config.on_bus)),
      physics_(config.physics ? physics_link(*config.physics, config.origin) : nullptr),
      pictures_(world, config),
      truth_(names_),
      faults_(config.mission, world.start_W().z()),
      aircraft_(flight_.vehicle, config.mission.simulator, mission::ground_below(world), config.mission.seed,
                flight_.minor_frame, pictures_),
      side_(config.physics     ? nullptr
            : config.autopilot ? autopilot_side(aircraft_, flight_.vehicle, flight_.minor_frame,
                                                *config.autopilot, config.origin)
                               : port_side(aircraft_, sitl::rig_of(config.mission.simulator), names_,
                                           config.origin, config.on_bus, std::move(kernel_))) {
  plant_.stand_in(world);
  if (!faults_.empty()) plant_.connect(faults_.line());
}

void Plant::step(MonotonicTime now) {
  if (side_->hear(plant_.now() + held_)) {
    heard_ = now;
    if (!first_word_) first_word_ = plant_.now();
  }
  const Vector3 before_W = plant_.vehicle().state().p_WB;
  if (!faults_.empty()) {
    faults_.advance(plant_.now(), before_W.z());
    plant_.set_mean_wind(faults_.mean_wind_W_mps());
  }
  plant_.step();
  report_.distance_m += (plant_.vehicle().state().p_WB - before_W).norm();
  const Nanos shift = clock_.epoch() + held_;
  side_->tell(plant_.now() + held_, shift);
  truth_.write(plant_.now(), plant_.vehicle().state().p_WB, plant_.vehicle().state().q_WB, shift);
  judge();
}

void Plant::keep_pace() {
  const MonotonicTime due = plant_.now() + held_ + flight_.minor_frame;
  wait_until(due);
  const MonotonicTime now = clock_.now();
  if (now - due > kStoodStill) {
    held_ += now - due;
    report_.stood_still_s += seconds(now - due);
    ++stalls_;
  }
  pictures_.set_shift(clock_.epoch() + held_);
  step(now);
}

void Plant::keep_time(MonotonicTime now) {
  constexpr int kSlowly = 64;  // minor frames: packets come in bursts, and the earliest tells the time
  const Nanos late = now - plant_.now() - held_;
  if (report_.commands > 0 && late > kStoodStill) {
    report_.stood_still_s += seconds(late);
    ++stalls_;
  }
  held_ += late > Nanos{0} && late <= kStoodStill ? late / kSlowly : late;
  pictures_.set_shift(clock_.epoch() + held_);
}

void Plant::follow() {
  const MonotonicTime end = plant_.now() + flight_.minor_frame;
  for (bool is_over = false; !is_over;) {
    const auto next = physics_->wait();
    if (!next) return;
    const Vector3 before_W = plant_.vehicle().state().p_WB;
    plant_.move(next->dt, next->motors);
    report_.distance_m += (plant_.vehicle().state().p_WB - before_W).norm();
    is_over = plant_.now() + next->dt / 2 >= end;
    if (is_over) plant_.look();
    physics_->answer(plant_);
  }
  heard_ = clock_.now();
  keep_time(heard_);
  report_.commands = physics_->counters().steps;
  truth_.write(plant_.now(), plant_.vehicle().state().p_WB, plant_.vehicle().state().q_WB,
               clock_.epoch() + held_);
  judge();
}

void Plant::judge_collision(const sitl::VehicleState& s) {
  const double radius_m = flight_.vehicle.radius_m;
  clearance_m_ = std::min(clearance_m_, world_.clearance_m(s.p_WB, kClearanceCap_m));
  // The ground counts as a collision only where it is hit hard: what it stands on may be an obstacle of the world, a floor.
  Vector3 body_W = s.p_WB;
  body_W.z() = std::max(body_W.z(), plant_.vehicle().ground_m() + radius_m + kUneven_m);
  if (world_.clearance_m(body_W, radius_m) < radius_m) report_.collided = true;
  if (const auto body = world_.nearest_body(s.p_WB, radius_m, plant_.now())) {
    const Vector3 to_body = body->core_W - s.p_WB;
    if (s.v_WB.dot(to_body) > kOwnApproach_mps * to_body.norm()) report_.collided = true;
  }
}

void Plant::judge() {
  constexpr std::uint64_t kEvery = 4;  // 10 ms: 6 cm
  const sitl::VehicleState& s = plant_.vehicle().state();
  const auto& throttle = plant_.vehicle().commanded().thrust_ratio;
  const bool turns = std::any_of(throttle.begin(), throttle.end(), [](double ratio) { return ratio > 0.0; });
  left_ground_ = left_ground_ || s.p_WB.z() > plant_.vehicle().ground_m() + kOffGround_m;
  if (left_ground_ && side_) side_->left_ground(plant_.now() + held_);
  if (left_ground_ && physics_ && !first_word_) first_word_ = plant_.now();
  if (left_ground_ && s.on_ground && sink_mps_ > kHardTouchdown_mps) report_.collided = true;
  sink_mps_ = s.on_ground ? 0.0 : -s.v_WB.z();
  if (turns || !s.on_ground) turning_ = plant_.now();
  if (left_ground_ && !s.on_ground && frame_ % kEvery == 0) judge_collision(s);
  if (!goal_s_ && left_ground_ && flight::is_at_goal((world_.goal_W() - s.p_WB).norm(), s.v_WB.norm()))
    goal_s_ = time_s();
  if (report_.collided) report_.reason = "collision";
  if (report_.reason.empty() && left_ground_ && plant_.now() - turning_ > kDown) report_.reason = "landed";
}

void Plant::wait_until(MonotonicTime due) const {
  const timespec at = clock_.raw_time(due);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR &&
         !(config_.stop && config_.stop())) {
  }
}

PlantReport Plant::run(const std::function<void(const PlantProgress&)>& progress) {
  constexpr std::uint64_t kAskEvery = 10, kTellEvery = 100;  // minor frames
  pictures_.set_shift(clock_.epoch());
  pictures_.start();  // at the priority of ordinary work
  rt::take_priority(kPriority);
  start_ = turning_ = clock_.now();
  listened_ = start_ - kListenAgain;
  heard_ = start_ - kSilent;
  plant_.start(start_);
  while (report_.reason.empty()) {
    if (physics_)
      follow();
    else
      keep_pace();
    ++frame_;
    const MonotonicTime now = clock_.now();
    if (frame_ % kAskEvery == 0) {
      if (side_ && now - listened_ >= kListenAgain && now - heard_ >= kSilent) {
        listened_ = now;
        side_->listen();
      }
      if (report_.reason.empty() && config_.stop && config_.stop()) report_.reason = "interrupted";
      if (report_.reason.empty() && seconds(now - start_) >= config_.seconds) report_.reason = "time_limit";
    }
    if (frame_ % kTellEvery == 0 && progress) {
      const sitl::VehicleState& s = plant_.vehicle().state();
      progress(
          {seconds(plant_.now() - start_), first_word_ && now - heard_ < kSilent, s.p_WB, s.v_WB.norm()});
    }
  }
  pictures_.stop();
  report_.time_s = goal_s_.value_or(time_s());
  report_.reached_goal = goal_s_.has_value();
  if (left_ground_) report_.least_clearance_m = clearance_m_;
  report_.frames_sent = pictures_.sent();
  report_.faults = stalls_ + pictures_.lost() + (side_ ? side_->lost() : 0);
  report_.injected = faults_.begun();
  report_.speed_mps = plant_.vehicle().state().v_WB.norm();
  if (side_) {
    report_.commands = side_->commands();
    report_.autopilot = side_->autopilot();
    report_.package = side_->package();
  }
  if (physics_) report_.physics = physics_->counters();
  return std::move(report_);
}

}  // namespace

PlantReport run_plant(const sitl::World& world, const PlantConfig& config, const std::function<void()>& ready,
                      const std::function<void(const PlantProgress&)>& progress) {
  const auto plant = std::make_unique<Plant>(world, config);
  if (ready) ready();
  return plant->run(progress);
}

}  // namespace roborun::live
