#include "platform/app/flight_programs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/camera_pose.hpp"
#include "core/geometry/math.hpp"
#include "core/random/counter_rng.hpp"
#include "core/record/state_hash.hpp"
#include "platform/app/landing_site.hpp"

namespace roborun::app {

using core::SlotId;
using governor::Action;
using governor::Phase;

namespace {

constexpr double kLostTilt_cos = 0.5;  // 60 degrees
constexpr double kSeam_m = 0.3;        // between what is flown and what is offered
constexpr double kHome_m = 1.0;
constexpr double kAtSite_m = 0.7;
constexpr double kDescent_mps = 1.0;
constexpr double kBlindDescent_mps = 0.5;
constexpr Nanos kSitePatience{10'000'000'000};   // until it comes down blindly ...
constexpr Nanos kStandPatience{20'000'000'000};  // ... also if it cannot stand still
constexpr int kReportDelay = 4;                  // minor frames at most, from a commit to its report
constexpr Nanos kIdlePeriod{100'000'000};        // of reports while there is nothing to decide
constexpr Nanos kLatestStop{20'000'000};         // 12 cm at 6 m/s

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
      guard(now);
      take_offers(now, lane);
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
      report.flying = flight_.flying();
      report.airborne = flight_.airborne();
      report.action = action_;
      report.standing = flight_.standing(now);
      report.home_W = flight_.home_W();
      report.ground_m = flight_.ground_m();
      mail_.report.publish();
      return;
    }
    default:
      return;
  }
}

void FlightProgram::take_offers(MonotonicTime now, const core::LaneExecutive& lane) noexcept {
  if (!mail_.offer.take()) return;
  const Offer& offer = mail_.offer.read();
  const MonotonicTime start = std::max(offer.trajectory.start_time, now);
  const bool fits = (flight_.committed().at(start).p_W - offer.trajectory.at(start).p_W).norm() < kSeam_m;
  const bool braking = action_ == Action::kHold || (lane.reactions().braking() && !offer.is_stop);
  if (fits && !braking)
    flight_.offer(offer.trajectory);
  else
    ++offers_refused_;
}

FailsafeMeasures FlightProgram::measure(MonotonicTime now) noexcept {
  FailsafeMeasures m;
  const AircraftHealth health = aircraft_.health(now);
  m.battery_used_ratio = 1.0 - health.battery_ratio;
  m.gnss_age_s = seconds(now - flight_.last_fix());
  m.esc_silence_s = seconds(health.esc_silence);
  if (health.hears_operator) operator_heard_ = now;
  m.link_silence_s = seconds(now - operator_heard_);
  m.killed = health.killed ? 1.0 : 0.0;
  if (const DecisionReport& d = mail_.decision.read(); d.heard) {
    m.depth_age_s = d.depth_age_s;
    m.planner_failures = d.failures;
    m.decision_late_s = seconds(now - d.due);
    m.map_refusals = d.map_refusals;
  }
  stages::EstimatedState state;
  if (flight_.estimator().state(state) != Status::kOk) return m;
  const bool tilted = state.q_WB.toRotationMatrix()(2, 2) < kLostTilt_cos;
  m.control_lost = tilted || flight_.imu_lost(now) ? 1.0 : 0.0;
  if (flight_.flying()) m.tracking_error_m = (state.p_WB - flight_.reference().p_W).norm();
  // Heights only between climb and descent: both go through the floor.
  const bool low = !flight_.airborne() || flight_.descending();
  const bool inside =
      low ? config_.fence.allows_over_ground({state.p_WB, state.p_WB}) : config_.fence.allows(state.p_WB);
  m.outside_fence = inside ? 0.0 : 1.0;
  return m;
}

void FlightProgram::guard(MonotonicTime now) noexcept {
  (void)mail_.decision.take();
  if (phase_ == Phase::kGround && flight_.flying()) phase_ = Phase::kTakeOff;
  if (phase_ == Phase::kTakeOff && flight_.airborne()) phase_ = Phase::kMission;
  if (flight_.landed()) return aircraft_.disarm();
  FailsafeMeasures measures = measure(now);
  if (flight_.descending()) measures.tracking_error_m = 0.0;  // the ground stops it, and is meant to
  conditions_ = monitor_.step(now, measures);
  const Action wanted = governor::arbitrate(conditions_, phase_);
  if (!config_.answers) return;
  if (wanted != action_) begin(wanted, now);
  phase_ = governor::phase_after(action_, phase_);
  if (action_ == Action::kReturn) come_home(now);
  if (action_ == Action::kLand) land(now);
}

void FlightProgram::begin(Action action, MonotonicTime now) noexcept {
  action_ = action;
  flight_.allow_take_off(action == Action::kGoOn);
  if (action == Action::kHold || action == Action::kLand) flight_.brake();
  if (action == Action::kTerminate) aircraft_.terminate();
  action_since_ = now;
  (void)events_.push_back({now, action, conditions_, phase_});
}

void FlightProgram::come_home(MonotonicTime now) noexcept {
  const Vector3 away = flight_.reference().p_W - flight_.home_W();
  if (away.norm() > kHome_m || !flight_.standing(now)) return;
  begin(Action::kLand, now);
  phase_ = Phase::kLand;
}

void FlightProgram::land(MonotonicTime now) noexcept {
  constexpr governor::ConditionSet kNoAdvice = governor::kReturnNeeds;  // nobody looks for a place then
  if (phase_ == Phase::kGround || flight_.descending()) return;
  const bool standing = flight_.standing(now);
  const DecisionReport& d = mail_.decision.read();
  if (standing && d.heard && d.site_known) {
    const Vector3 away = flight_.reference().p_W - d.site_W;
    if (core::hypot2(away.x(), away.y()) < kAtSite_m) {
      site_was_known_ = true;
      flight_.descend(now, kDescent_mps);
      return;
    }
  }
  const bool advised = (conditions_ & kNoAdvice) == 0;
  const Nanos patience = !standing ? kStandPatience : advised ? kSitePatience : Nanos{0};
  if (now - action_since_ < patience) return;
  flight_.descend(now, kBlindDescent_mps);
}

bool DecisionProgram::is_usable(std::size_t camera, const firmware_if::DepthFrame& frame) noexcept {
  constexpr int kEnough = 16;
  core::StateHash hash;
  std::size_t surfaces = 0;
  std::size_t valid = 0;
  for (const float depth_m : frame.depth_m) {
    if (!(depth_m > 0.0F)) continue;
    ++valid;
    if (!std::isfinite(depth_m)) continue;
    ++surfaces;
    hash.add(static_cast<double>(depth_m));
  }
  // The open sky is the same in every image.
  const bool stuck = surfaces >= kEnough && hash.value() == image_digest_[camera];
  image_digest_[camera] = hash.value();
  return !stuck && 5 * valid >= frame.depth_m.size();
}

void DecisionProgram::publish(MonotonicTime due) noexcept {
  report_.heard = true;
  report_.due = due;
  mail_.decision.draft() = report_;
  mail_.decision.publish();
}

void DecisionProgram::choose_site() noexcept {
  const FlightReport& report = mail_.report.read();
  if (report.action != Action::kLand || !report.standing || report_.site_known) return;
  const auto site_W =
      landing_site_W(pipeline_.view(), config_.fence, in_.p_WB, report.ground_m, pipeline_.radius_m());
  report_.site_known = site_W.has_value();
  if (site_W) report_.site_W = *site_W;
}

void DecisionProgram::judge() noexcept {
  const bool answer = out_.planner_status == Status::kNoPath || out_.planner_status == Status::kGoalBlocked;
  // On the way home even "no way" is a failure: nothing else will bring it down.
  const bool fine = out_.smoother_status == Status::kOk || report_.site_known || in_.climbing ||
                    (answer && mail_.report.read().action != Action::kReturn);
  report_.failures = fine ? 0 : report_.failures + 1;
  if (config_.map_refusals == nullptr) return;
  report_.map_refusals = *config_.map_refusals > refusals_before_ ? report_.map_refusals + 1 : 0;
  refusals_before_ = *config_.map_refusals;
}

void DecisionProgram::gather(core::LaneExecutive& lane) noexcept {
  (void)mail_.report.take();
  const FlightReport& report = mail_.report.read();
  const stages::EstimatedState& state = report.state;
  if (given_up_.load(std::memory_order_acquire) || !report.flying || !report.estimated) {
    // Nobody waits for it: decisions have not begun, or are over.
    last_usable_.fill(lane.release());
    publish(lane.release() + kIdlePeriod);
    lane.end_frame();
    return;
  }
  frames_.clear();
  report_.depth_age_s = 0.0;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    stages::PosedDepthFrame posed;
    Pose X_WB;
    if (cameras_[i]->read(posed.frame) == Status::kOk && is_usable(i, posed.frame) &&
        report.past.pose_at(posed.frame.stamp, X_WB) == Status::kOk) {
      posed.X_WC = core::camera_pose(X_WB, cameras_[i]->mount());
      (void)frames_.push_back(posed);
      last_usable_[i] = posed.frame.stamp;
    }
    report_.depth_age_s = std::max(report_.depth_age_s, seconds(lane.release() - last_usable_[i]));
  }
  publish(lane.release() + kIdlePeriod);
  if (frames_.empty()) {
    lane.set_period(4 * core::kMinorFrame);
    lane.end_frame();
    return;
  }
  in_.now = lane.release();
  in_.frames = {frames_.begin(), frames_.size()};
  in_.committed = &flown(lane.release());
  in_.climbing = !report.airborne;
  in_.p_WB = state.p_WB;
  in_.v_WB = state.v_WB;
  in_.goal_W = report.action == Action::kReturn ? report.home_W
               : report.action == Action::kLand ? state.p_WB  // close looks, slow
                                                : config_.goal_W;
  in_.seed = core::mix64(config_.seed * 1000003ULL + ++decisions_);
}

const Trajectory& DecisionProgram::flown(MonotonicTime now) const noexcept {
  const Trajectory& reported = mail_.report.read().committed;
  const bool newer = handed_over_.start_time > reported.start_time && handed_over_.start_time <= now &&
                     now - handed_over_.start_time <= kReportDelay * config_.minor_frame;
  return newer ? handed_over_ : reported;
}

bool DecisionProgram::hand_over(const core::LaneExecutive& lane) noexcept {
  if (out_.kind == DecisionKind::kKeep) return false;
  // Too late for its own start: the vehicle already flies its braking tail, and the result is of no use. A
  // stop is still better a little late; after a stall it would begin where the vehicle is no more.
  const Nanos latest = out_.kind == DecisionKind::kNew ? Nanos{0} : kLatestStop;
  if (out_.trajectory.start_time + latest < lane.now()) {
    ++too_late_;
    return false;
  }
  handed_over_ = out_.trajectory;
  mail_.offer.draft() = {out_.trajectory, out_.kind == DecisionKind::kBrake};
  mail_.offer.publish();
  return true;
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
  if (slot == SlotId::kHandOver) return (void)hand_over(lane);
  const auto stage =
      static_cast<core::StageId>(static_cast<int>(slot) - static_cast<int>(SlotId::kPointCloud));
  if (slot == SlotId::kPlanner) {
    choose_site();
    if (report_.site_known) in_.goal_W = report_.site_W;
  }
  pipeline_.run(stage, in_, out_);
  if (slot == SlotId::kMap && out_.kind == DecisionKind::kBrake) {
    if (hand_over(lane)) in_.committed = &handed_over_;
    out_.kind = DecisionKind::kKeep;
  }
  if (slot == SlotId::kPlanner) judge();
  if (slot == SlotId::kGovernor || slot == SlotId::kPlanner)
    publish(lane.release() + out_.decision.point.deadline);
  if (slot == SlotId::kGovernor) lane.set_period(out_.decision.point.deadline);
}

}  // namespace roborun::app
