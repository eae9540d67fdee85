#include "platform/mission/mission_judge.hpp"

#include <algorithm>

namespace roborun::mission {
namespace {

constexpr double kReachedSpeed_mps = 0.5;
constexpr double kHover_mps = 0.3;
constexpr double kOwnApproach_mps = 0.3;  // less is swaying on the spot
constexpr double kHolding_s = 5.0;        // of hovering, until a hold counts as the end
constexpr double kHardTouchdown_mps = 2.0;
constexpr double kMoved_m = 5.0;         // a way around may lead away from the goal
constexpr std::uint64_t kProof = 5;      // decisions without a way
constexpr double kOffGround_m = 0.5;     // higher than this over what it stood on: it has left it
constexpr double kUneven_m = 0.3;        // how much ground may rise around where it stands
constexpr double kGiveUpAfter_s = 60.0;  // what cannot even stop

}  // namespace

/// What the safety of the flight is judged by.
void MissionJudge::watch(MonotonicTime now) {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  for (const double ratio : aircraft_.far_side().throttle()) {
    if (ratio > 0.0) safety_.last_thrust_s = seconds(now.time_since_epoch());
  }
  if (!fence_.allows_over_ground({s.p_WB, s.p_WB})) safety_.left_fence = true;
  left_ground_ = left_ground_ ||
                 (system_.control().airborne() && s.p_WB.z() > aircraft_.vehicle().ground_m() + kOffGround_m);
  if (s.on_ground && sink_mps_ > 0.0) safety_.touchdown_mps = sink_mps_;
  sink_mps_ = s.on_ground ? 0.0 : -s.v_WB.z();
}

/// Null: the failsafe has not ended the mission.
const char* MissionJudge::failsafe_reason(MonotonicTime now) const {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  const flight::FailsafePilot& pilot = system_.pilot();
  const bool turning =
      std::any_of(s.thrust_ratio.begin(), s.thrust_ratio.end(), [](double ratio) { return ratio > 0.02; });
  switch (pilot.action()) {
    case governor::Action::kHold:
      return s.v_WB.norm() < kHover_mps && seconds(now - pilot.action_since()) > kHolding_s ? "holding"
                                                                                            : nullptr;
    case governor::Action::kLand:
      return system_.control().landed() && !turning ? "landed" : nullptr;
    case governor::Action::kTerminate:
      return s.on_ground && !turning ? "terminated" : nullptr;
    case governor::Action::kKill:
      return s.on_ground && !turning ? "killed" : nullptr;
    default:
      return nullptr;
  }
}

bool MissionJudge::believes_to_have_arrived() const {
  const double believed_m = JudgeConfig{}.goal_within_m;
  if (config_.goal_within_m <= believed_m) return true;
  stages::EstimatedState state;
  return system_.control().estimator().state(state) == Status::kOk &&
         (state.p_WB + state.shift_W - world_.goal_W()).norm() < believed_m;
}

const char* MissionJudge::judge(MonotonicTime now) {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  const double to_goal_m = (world_.goal_W() - s.p_WB).norm();
  const governor::Action action = system_.pilot().action();
  watch(now);
  // The vehicle's body, a sphere of half its span; the ground counts once it has left it, unless it lands. What it
  // stands on may be an obstacle of the world, a floor: until then the sphere is looked at above it.
  const bool stands = !left_ground_ || system_.control().descending();
  const bool down = !stands && s.p_WB.z() < world_.ground_m() + kUneven_m;
  Vector3 body_W = s.p_WB;
  if (stands) body_W.z() = std::max(body_W.z(), aircraft_.vehicle().ground_m() + radius_m_ + kUneven_m);
  const bool hard = system_.control().descending() && safety_.touchdown_mps > kHardTouchdown_mps;
  const bool motors_off = action >= governor::Action::kTerminate;
  if (!motors_off && (world_.clearance_m(body_W, radius_m_) < radius_m_ || down || hard)) {
    collided_ = true;
    return "collision";
  }
  if (const auto body = world_.nearest_body(s.p_WB, radius_m_, now)) {
    const Vector3 to_body = body->core_W - s.p_WB;
    collided_ = s.v_WB.dot(to_body) > kOwnApproach_mps * to_body.norm();
    return collided_ ? "collision" : "struck";
  }
  if (action != governor::Action::kGoOn) {
    if (const char* reason = failsafe_reason(now)) return reason;
    if (s.battery_ratio <= 0.0 && s.on_ground) return "battery_empty";
    return seconds(now.time_since_epoch()) > config_.time_limit_s ? "time_limit" : nullptr;
  }
  if (to_goal_m < config_.goal_within_m && s.v_WB.norm() < kReachedSpeed_mps && believes_to_have_arrived()) {
    return "reached_goal";
  }
  if (to_goal_m < best_distance_m_ - 0.5 || (s.p_WB - moved_to_W_).norm() > kMoved_m) {
    best_distance_m_ = std::min(best_distance_m_, to_goal_m);
    moved_to_W_ = s.p_WB;
    best_at_ = now;
  }
  if (s.battery_ratio <= 0.0) return "battery_empty";
  if (give_up_ == nullptr) {
    if (system_.decision_program().no_way() >= kProof) give_up_ = "no_way";
    if (give_up_ == nullptr && seconds(now - best_at_) > config_.no_progress_s) give_up_ = "gave_up";
    if (seconds(now.time_since_epoch()) > config_.time_limit_s) give_up_ = "time_limit";
    if (give_up_ == nullptr) return nullptr;
    system_.decision_program().give_up();
    return nullptr;
  }
  // Given up: no more decisions; the committed trajectory ends in a stop, and the mission in a hover.
  const Trajectory& committed = system_.control().committed();
  const bool stopped =
      now > committed.start_time + from_seconds(committed.duration_s()) && s.v_WB.norm() < kHover_mps;
  const bool helpless = seconds(now.time_since_epoch()) > config_.time_limit_s + kGiveUpAfter_s;
  return stopped || helpless ? give_up_ : nullptr;
}

}  // namespace roborun::mission
