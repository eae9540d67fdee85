#include "platform/flight/failsafe_pilot.hpp"

#include <algorithm>

#include "core/geometry/math.hpp"

namespace roborun::flight {

using governor::Action;
using governor::Phase;

namespace {

constexpr double kLostTilt_rad = 1.0472;  // 60 degrees ...
constexpr double kBeyondLimit_rad = 0.3;  // ... or so much more than the controller ever asks for
constexpr double kHome_m = 1.0;
constexpr double kAtSite_m = 0.7;
constexpr double kDescent_mps = 1.0;
constexpr double kBlindDescent_mps = 0.5;
constexpr Nanos kSitePatience{10'000'000'000};   // until it comes down blindly ...
constexpr Nanos kStandPatience{20'000'000'000};  // ... also if it cannot stand still

}  // namespace

FailsafePilot::FailsafePilot(const Config& config, FlightControl& control, Aircraft& aircraft) noexcept
    : config_(config),
      lost_tilt_cos_(core::sin_cos(std::max(kLostTilt_rad, config.vehicle.tilt_rad + kBeyondLimit_rad)).cos),
      control_(control),
      aircraft_(aircraft) {}

FailsafeMeasures FailsafePilot::measure(MonotonicTime now, const DecisionReport& d) noexcept {
  FailsafeMeasures m;
  const AircraftHealth health = aircraft_.health(now);
  battery_ratio_ = health.battery_ratio;
  m.battery_used_ratio = 1.0 - health.battery_ratio;
  m.position_age_s = seconds(now - control_.last_position());
  m.esc_silence_s = seconds(health.esc_silence);
  if (health.hears_operator) operator_heard_ = now;
  m.link_silence_s = seconds(now - operator_heard_);
  m.killed = health.killed ? 1.0 : 0.0;
  if (d.heard) {
    m.depth_age_s = d.depth_age_s;
    depth_sensor_ = d.depth_sensor;
    depth_fault_ = d.depth_fault;
    m.planner_failures = d.failures;
    m.decision_late_s = seconds(now - d.due);
    m.map_refusals = d.map_refusals;
  }
  stages::EstimatedState state;
  if (control_.estimator().state(state) != Status::kOk) return m;
  const bool tilted = state.q_WB.toRotationMatrix()(2, 2) < lost_tilt_cos_;
  m.control_lost = tilted || control_.imu_lost(now) ? 1.0 : 0.0;
  if (control_.flying() && !control_.unheard(now))
    m.tracking_error_ratio =
        (state.p_WB - control_.reference().p_W).norm() / planned_radius_m(config_.vehicle);
  // Heights only between climb and descent: both go through the floor.
  const bool low = !control_.airborne() || control_.descending();
  const Vector3 p_W = state.p_WB + state.shift_W;
  const bool inside = low ? config_.fence.allows_over_ground({p_W, p_W}) : config_.fence.allows(p_W);
  m.outside_fence = inside ? 0.0 : 1.0;
  return m;
}

void FailsafePilot::guard(MonotonicTime now, const DecisionReport& decision) noexcept {
  if (phase_ == Phase::kGround && control_.flying()) phase_ = Phase::kTakeOff;
  if (phase_ == Phase::kTakeOff && control_.airborne()) phase_ = Phase::kMission;
  if (control_.landed()) return aircraft_.disarm();
  FailsafeMeasures measures = measure(now, decision);
  if (control_.descending()) measures.tracking_error_ratio = 0.0;  // the ground stops it, and is meant to
  conditions_ = monitor_.step(now, measures);
  Action wanted = governor::arbitrate(conditions_, phase_);
  if (asked_down_.load(std::memory_order_relaxed))
    wanted = std::max(wanted, phase_ == Phase::kGround ? Action::kHold : Action::kLand);
  if (!config_.answers) return;
  if (wanted != action_) begin(wanted, now);
  phase_ = governor::phase_after(action_, phase_);
  if (action_ == Action::kReturn) come_home(now);
  if (action_ == Action::kLand) land(now, decision);
}

void FailsafePilot::begin(Action action, MonotonicTime now) noexcept {
  action_ = action;
  came_up_here_ = action == Action::kLand && phase_ == Phase::kTakeOff;
  control_.allow_take_off(action == Action::kGoOn);
  if (action == Action::kHold || action == Action::kLand) control_.brake();
  if (action == Action::kTerminate) aircraft_.terminate();
  action_since_ = now;
  (void)events_.push_back({now, action, conditions_, phase_, depth_sensor_, depth_fault_});
}

void FailsafePilot::come_home(MonotonicTime now) noexcept {
  const Vector3 away = control_.reference().p_W - control_.home_W();
  if (away.norm() > kHome_m || !control_.standing(now)) return;
  begin(Action::kLand, now);
  phase_ = Phase::kLand;
}

void FailsafePilot::land(MonotonicTime now, const DecisionReport& d) noexcept {
  constexpr governor::ConditionSet kNoAdvice = governor::kReturnNeeds;  // nobody looks for a place then
  if (phase_ == Phase::kGround || control_.descending()) return;
  const bool standing = control_.standing(now);
  const auto is_at_site = [&] {
    const Vector3 away = control_.reference().p_W - d.site_W;
    return d.heard && d.site_known && core::hypot2(away.x(), away.y()) < kAtSite_m;
  };
  if (standing && (came_up_here_ || is_at_site())) {
    site_was_known_ = true;
    control_.descend(now, kDescent_mps);
    return;
  }
  const bool advised = (conditions_ & kNoAdvice) == 0;
  const Nanos patience = !standing ? kStandPatience : advised ? kSitePatience : Nanos{0};
  if (now - action_since_ < patience) return;
  control_.descend(now, kBlindDescent_mps);
}

}  // namespace roborun::flight
