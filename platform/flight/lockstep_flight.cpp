#include "platform/flight/lockstep_flight.hpp"

namespace roborun::flight {

LockstepFlight::LockstepFlight(const FlightConfig& config, Aircraft& aircraft,
                               std::span<firmware_if::DepthCamera* const> cameras, const FlightParts& parts,
                               core::Arena& arena, std::span<firmware_if::Lidar* const> lidars) noexcept
    : aircraft_(aircraft),
      minor_frame_(config.minor_frame),
      rated_costs_(config.costs),
      costs_(config.costs),
      meter_(costs_, decision_clock_),
      system_(config, meter_, aircraft, cameras, parts, arena, lidars),
      flight_lane_(core::LaneId::kFlight, flight_clock_, system_.flight_program(), reactions_, nullptr),
      decision_lane_(core::LaneId::kDecision, decision_clock_, system_.decision_program(), reactions_,
                     nullptr) {
  meter_.attach(decision_lane_);
  flight_lane_.start(MonotonicTime{minor_frame_}, minor_frame_);
  decision_lane_.start(MonotonicTime{minor_frame_}, minor_frame_);
}

const DecisionOutput* LockstepFlight::step(const Computer& computer) noexcept {
  now_ += minor_frame_;
  flight_clock_.set(now_);
  if (!computer.flight_runs) {
    aircraft_.begin_frame(now_);  // the world does not wait
    return nullptr;
  }
  while (flight_lane_.release() <= now_) flight_lane_.run_frame();  // more than one after a stall
  if (!computer.decision_runs) return nullptr;
  if (decision_lane_.in_frame() && decision_clock_.now() <= now_) decision_lane_.step();
  if (decision_lane_.in_frame() || decision_lane_.release() > now_) return nullptr;
  decision_clock_.set(now_);
  if (computer.slower != slower_) {
    costs_ = core::slower(rated_costs_, computer.slower);
    slower_ = computer.slower;
  }
  const std::uint64_t before = system_.decision_program().decisions();
  do decision_lane_.step();
  while (decision_lane_.in_frame() && decision_lane_.next_slot() != core::SlotId::kHandOver);
  return system_.decision_program().decisions() > before ? &system_.decision_program().output() : nullptr;
}

}  // namespace roborun::flight
