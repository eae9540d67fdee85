#include "platform/app/flight_programs.hpp"

#include "core/geometry/camera_pose.hpp"
#include "core/random/counter_rng.hpp"

namespace roborun::app {

using core::SlotId;

namespace {

constexpr Nanos kLatestStop{20'000'000};  // 12 cm at 6 m/s

}  // namespace

void FlightProgram::run(SlotId slot, core::LaneExecutive& lane) noexcept {
  const MonotonicTime now = lane.release();
  switch (slot) {
    case SlotId::kWorld:
      aircraft_.begin_frame(now);
      return;
    case SlotId::kSense:
      flight_.sense(aircraft_.imu(), aircraft_.gnss(), aircraft_.barometer());
      return;
    case SlotId::kCommit:
      if (mail_.offer.take()) {
        const Offer& offer = mail_.offer.read();
        if (offer.is_stop || !lane.reactions().braking())
          flight_.offer(offer.trajectory);
        else
          ++offers_refused_;
      }
      flight_.commit(now);
      return;
    case SlotId::kTrack:
      flight_.track(now, aircraft_.motors());
      aircraft_.end_frame(now);
      return;
    case SlotId::kPublish: {
      FlightReport& report = mail_.report.draft();
      report.estimated = flight_.estimator().state(report.state) == Status::kOk;
      report.past.catch_up(flight_.estimator().past());
      if (report.committed_number != flight_.committed_number()) {
        report.committed = flight_.committed();
        report.committed_number = flight_.committed_number();
      }
      report.airborne = flight_.airborne();
      mail_.report.publish();
      return;
    }
    default:
      return;
  }
}

void DecisionProgram::gather(core::LaneExecutive& lane) noexcept {
  (void)mail_.report.take();
  const FlightReport& report = mail_.report.read();
  const stages::EstimatedState& state = report.state;
  if (given_up_.load(std::memory_order_acquire) || !report.airborne || !report.estimated) {
    lane.end_frame();
    return;
  }
  frames_.clear();
  for (firmware_if::DepthCamera* camera : cameras_) {
    stages::PosedDepthFrame posed;
    Pose X_WB;
    if (camera->read(posed.frame) != Status::kOk ||
        report.past.pose_at(posed.frame.stamp, X_WB) != Status::kOk)
      continue;
    posed.X_WC = core::camera_pose(X_WB, camera->mount());
    (void)frames_.push_back(posed);
  }
  if (frames_.empty()) {
    lane.set_period(4 * core::kMinorFrame);
    lane.end_frame();
    return;
  }
  in_.now = lane.release();
  in_.frames = {frames_.begin(), frames_.size()};
  in_.committed = &report.committed;
  in_.p_WB = state.p_WB;
  in_.v_WB = state.v_WB;
  in_.goal_W = config_.goal_W;
  in_.seed = core::mix64(config_.seed * 1000003ULL + ++decisions_);
}

void DecisionProgram::hand_over(const core::LaneExecutive& lane) noexcept {
  if (out_.kind == DecisionKind::kKeep) return;
  // Too late for its own start: the vehicle already flies its braking tail, and the result is of no use. A
  // stop is still better a little late; after a stall it would begin where the vehicle is no more.
  const Nanos latest = out_.kind == DecisionKind::kNew ? Nanos{0} : kLatestStop;
  if (out_.trajectory.start_time + latest < lane.now()) {
    ++too_late_;
    return;
  }
  mail_.offer.draft() = {out_.trajectory, out_.kind == DecisionKind::kBrake};
  mail_.offer.publish();
}

void WatchdogProgram::run(SlotId, core::LaneExecutive& lane) noexcept {
  const MonotonicTime now = lane.now();
  const std::optional<SlotId> flight = flight_->overdue(now);
  if (flight && flight_late_) lane.reactions().stop(*flight);
  flight_late_ = flight.has_value();
  const std::optional<SlotId> decision = decision_->overdue(now);
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

void DecisionProgram::run(SlotId slot, core::LaneExecutive& lane) noexcept {
  if (slot == SlotId::kGather) return gather(lane);
  if (slot == SlotId::kHandOver) return hand_over(lane);
  const auto stage =
      static_cast<core::StageId>(static_cast<int>(slot) - static_cast<int>(SlotId::kPointCloud));
  pipeline_.run(stage, in_, out_);
  if (slot == SlotId::kGovernor) lane.set_period(out_.decision.point.deadline);
}

}  // namespace roborun::app
