#include "platform/flight/flight_program.hpp"

#include <algorithm>

namespace roborun::flight {

using core::SlotId;
using governor::Action;

namespace {

// Between what is flown and what is offered.
constexpr double kSeam_m = 0.3, kSeam_mps = 0.5;

}  // namespace

void FlightProgram::run(SlotId slot, core::LaneExecutive& lane) noexcept {
  const MonotonicTime now = lane.release();
  switch (slot) {
    case SlotId::kWorld:
      aircraft_.begin_frame(now);
      return;
    case SlotId::kSense:
      if (firmware_if::Autopilot* const autopilot = aircraft_.autopilot()) {
        autopilot->step(now);  // the sign of life comes from here: no loop, no heartbeat
        control_.sense(now, *autopilot);
        return;
      }
      control_.sense(aircraft_.imu(), aircraft_.gnss(), aircraft_.barometer(), aircraft_.odometry());
      return;
    case SlotId::kCommit:
      (void)mail_.decision.take();
      pilot_.guard(now, mail_.decision.read());
      control_.look_at(mail_.decision.read().gaze_target);
      take_offers(now, lane);
      control_.commit(now);
      return;
    case SlotId::kTrack:
      if (firmware_if::Autopilot* const autopilot = aircraft_.autopilot())
        control_.track(now, *autopilot);
      else
        control_.track(now, aircraft_.motors());
      aircraft_.end_frame(now);
      return;
    case SlotId::kPublish:
      return publish(now);
    case SlotId::kLook:
      return look(now);
    default:
      return;
  }
}

void FlightProgram::look(MonotonicTime now) noexcept {
  if (!control_.airborne() || control_.descending() || control_.braking()) return;
  const DecisionReport& decision = mail_.decision.read();
  if (!watch_.must_brake({now, decision.looked, decision.due, decision.refused, control_.committed(),
                          control_.committed_number(), control_.estimator().past()}))
    return;
  brake_for_near();
}

void FlightProgram::brake_for_near() noexcept {
  control_.brake();
  ++near_brakes_;
}

void FlightProgram::publish(MonotonicTime now) noexcept {
  FlightReport& report = mail_.report.draft();
  report.estimated = control_.estimator().state(report.state) == Status::kOk;
  report.past.catch_up(control_.estimator().past());
  if (report.committed_number != control_.committed_number()) {
    report.committed = control_.committed();
    report.committed_number = control_.committed_number();
  }
  report.flying = control_.flying();
  report.airborne = control_.airborne();
  report.action = pilot_.action();
  report.standing = control_.standing(now);
  report.home_W = control_.home_W();
  report.ground_m = control_.ground_m();
  aircraft_.is_flown({report.estimated, report.state.q_WB.inverse() * Vector3::UnitZ(),
                      report.state.p_WB.z() - report.ground_m, report.state.v_WB.norm(),
                      report.action != Action::kGoOn});
  mail_.report.publish();
}

void FlightProgram::take_offers(MonotonicTime now, const core::LaneExecutive& lane) noexcept {
  if (!mail_.offer.take()) return;
  const Offer& offer = mail_.offer.read();
  const MonotonicTime start = std::max(offer.trajectory.start_time, now);
  const TrajectoryPoint flown = control_.committed().at(start), offered = offer.trajectory.at(start);
  const bool fits =
      (flown.p_W - offered.p_W).norm() < kSeam_m && (flown.v_W - offered.v_W).norm() < kSeam_mps;
  const bool braking = pilot_.action() == Action::kHold || (lane.reactions().braking() && !offer.is_stop);
  if (fits && !braking)
    control_.offer(offer.trajectory);
  else
    ++offers_refused_;
}

}  // namespace roborun::flight
