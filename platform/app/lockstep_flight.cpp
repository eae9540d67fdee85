#include "platform/app/lockstep_flight.hpp"

namespace roborun::app {

LockstepFlight::LockstepFlight(const sitl::World& world, const MissionConfig& config, Aircraft& aircraft,
                               const std::array<firmware_if::DepthCamera*, kCameras>& cameras)
    : config_(config),
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

const DecisionOutput* LockstepFlight::step() {
  now_ += config_.minor_frame;
  flight_clock_.set(now_);
  flight_lane_.run_frame();
  if (decision_lane_.in_frame() && decision_clock_.now() <= now_) decision_lane_.step();
  if (decision_lane_.in_frame() || decision_lane_.release() > now_) return nullptr;
  decision_clock_.set(now_);
  if (!slowed_ && seconds(now_.time_since_epoch()) >= config_.slow_down_at_s) {
    for (core::StageCost& cost : costs_.stage) cost = core::slower(cost, config_.slow_down_factor);
    slowed_ = true;
  }
  const std::uint64_t before = system_.decision_program().decisions();
  do decision_lane_.step();
  while (decision_lane_.in_frame() && decision_lane_.next_slot() != core::SlotId::kHandOver);
  return system_.decision_program().decisions() > before ? &system_.decision_program().output() : nullptr;
}

}  // namespace roborun::app
