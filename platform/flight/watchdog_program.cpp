#include "platform/flight/watchdog_program.hpp"

namespace roborun::flight {

void WatchdogProgram::run(core::SlotId, core::LaneExecutive& lane) noexcept {
  const MonotonicTime now = lane.now();
  const std::optional<core::SlotId> flight = flight_->overdue(now);
  if (flight && flight_late_) lane.reactions().stop(*flight);
  flight_late_ = flight.has_value();
  const std::optional<core::SlotId> decision = decision_->overdue(now);
  if (braking_ && !decision) {
    lane.reactions().brake(*stalled_, false);
    braking_ = false;
  }
  if (decision && decision_late_ && !braking_) {
    lane.reactions().brake(*decision, true);
    stalled_ = decision;
    braking_ = true;
    ++stalls_;
  }
  decision_late_ = decision.has_value();
}

}  // namespace roborun::flight
