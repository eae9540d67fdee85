#include "platform/app/lockstep_flight.hpp"

namespace roborun::app {
namespace {

constexpr double kSlowCpu = 4.0;

}  // namespace

LockstepFlight::LockstepFlight(const sitl::World& world, const MissionConfig& config, Aircraft& aircraft,
                               const std::array<firmware_if::DepthCamera*, kCameras>& cameras)
    : config_(config),
      aircraft_(aircraft),
      costs_(config.costs),
      meter_(costs_, decision_clock_),
      system_(world, config, meter_, aircraft, cameras),
      flight_lane_(core::LaneId::kFlight, flight_clock_, system_.flight_program(), reactions_, nullptr),
      decision_lane_(core::LaneId::kDecision, decision_clock_, system_.decision_program(), reactions_,
                     nullptr) {
  meter_.attach(decision_lane_);
  flight_lane_.start(MonotonicTime{config.minor_frame}, config.minor_frame);
  decision_lane_.start(MonotonicTime{config.minor_frame}, config.minor_frame);
}

const DecisionOutput* LockstepFlight::step(sitl::FaultKind cpu) {
  now_ += config_.minor_frame;
  flight_clock_.set(now_);
  if (cpu == sitl::FaultKind::kOff)
    aircraft_.begin_frame(now_);  // the world does not wait
  else
    while (flight_lane_.release() <= now_) flight_lane_.run_frame();  // more than one after a stall
  if (cpu == sitl::FaultKind::kOff || cpu == sitl::FaultKind::kStuck) return nullptr;
  if (decision_lane_.in_frame() && decision_clock_.now() <= now_) decision_lane_.step();
  if (decision_lane_.in_frame() || decision_lane_.release() > now_) return nullptr;
  decision_clock_.set(now_);
  const bool slow = seconds(now_.time_since_epoch()) >= config_.slow_down_at_s;
  const double slow_by =
      (slow ? config_.slow_down_factor : 1.0) * (cpu == sitl::FaultKind::kSlow ? kSlowCpu : 1.0);
  if (slow_by != slowed_by_) {
    costs_ = config_.costs;
    for (core::StageCost& cost : costs_.stage) cost = core::slower(cost, slow_by);
    slowed_by_ = slow_by;
  }
  const std::uint64_t before = system_.decision_program().decisions();
  do decision_lane_.step();
  while (decision_lane_.in_frame() && decision_lane_.next_slot() != core::SlotId::kHandOver);
  return system_.decision_program().decisions() > before ? &system_.decision_program().output() : nullptr;
}

}  // namespace roborun::app
