#include "platform/mission/mission_judge.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace roborun::mission {
namespace {

constexpr double kReachedSpeed_mps = 0.5;
constexpr double kHover_mps = 0.3;
constexpr double kOwnApproach_mps = 0.3;  // less is swaying on the spot
constexpr double kHolding_s = 5.0;        // of hovering, until a hold counts as the end
constexpr double kHardTouchdown_mps = 2.0;
constexpr double kMoved_m = 5.0;         // a way around may lead away from the goal
constexpr double kOffGround_m = 0.5;     // higher than this over what it stood on: it has left it
constexpr double kUneven_m = 0.3;        // how much ground may rise around where it stands
constexpr double kGiveUpAfter_s = 60.0;  // what cannot even stop

std::string words_of(const sitl::VehicleState& s) {
  return fmt::format("at ({:.1f}, {:.1f}, {:.1f}) m, flying {:.1f} m/s", s.p_WB.x(), s.p_WB.y(), s.p_WB.z(),
                     s.v_WB.norm());
}

}  // namespace

/// What the safety of the flight is judged by.
void MissionJudge::watch(MonotonicTime now) {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  for (const double ratio : aircraft_.far_side().throttle()) {
    if (ratio > 0.0) safety_.last_thrust_s = seconds(now.time_since_epoch());
  }
  if (safety_.left_fence_s < 0.0 && !fence_.allows_over_ground({s.p_WB, s.p_WB})) {
    safety_.left_fence_s = seconds(now.time_since_epoch());
    safety_.left_fence_W = s.p_WB;
  }
  left_ground_ = left_ground_ ||
                 (system_.control().airborne() && s.p_WB.z() > aircraft_.vehicle().ground_m() + kOffGround_m);
  if (s.on_ground && sink_mps_ > 0.0) {
    safety_.touchdown_mps = sink_mps_;
    safety_.touchdown_s = seconds(now.time_since_epoch());
  }
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
         (state.p_WB + state.shift_W - system_.decision_program().goals().now_W()).norm() < believed_m;
}

const char* MissionJudge::ends(const char* reason, std::string why) {
  safety_.end = std::move(why);
  return reason;
}

const char* MissionJudge::contact(MonotonicTime now) {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  // The vehicle's body, a sphere of half its span; the ground counts once it has left it, unless it lands. What it
  // stands on may be an obstacle of the world, a floor: until then the sphere is looked at above it.
  const bool stands = !left_ground_ || system_.control().descending();
  const bool down = !stands && s.p_WB.z() < world_.ground_m() + kUneven_m;
  Vector3 body_W = s.p_WB;
  if (stands) body_W.z() = std::max(body_W.z(), aircraft_.vehicle().ground_m() + radius_m_ + kUneven_m);
  const bool hard = system_.control().descending() && safety_.touchdown_mps > kHardTouchdown_mps;
  if (system_.pilot().action() < governor::Action::kTerminate) {
    const double clearance_m = world_.clearance_m(body_W, radius_m_);
    collided_ = clearance_m < radius_m_ || down || hard;
    if (clearance_m < radius_m_)
      return ends("collision",
                  fmt::format("an obstacle is {:.2f} m from its centre, its body reaches {:g} m; {}",
                              clearance_m, radius_m_, words_of(s)));
    if (down) return ends("collision", fmt::format("it flew into the ground; {}", words_of(s)));
    if (hard)
      return ends("collision", fmt::format("it came down at {:.2f} m/s, more than {:g} m/s breaks it",
                                           safety_.touchdown_mps, kHardTouchdown_mps));
  }
  if (const auto body = world_.nearest_body(s.p_WB, radius_m_, now)) {
    const Vector3 to_body = body->core_W - s.p_WB;
    collided_ = s.v_WB.dot(to_body) > kOwnApproach_mps * to_body.norm();
    return ends(collided_ ? "collision" : "struck",
                fmt::format("{}; {}", collided_ ? "it flew into a moving body" : "a moving body ran into it",
                            words_of(s)));
  }
  return nullptr;
}

const char* MissionJudge::hopeless(MonotonicTime now) {
  const flight::DecisionProgram& decisions = system_.decision_program();
  const bool last = system_.decision_program().goals().is_last();  // of a route: any, nothing is left out
  if (seconds(now.time_since_epoch()) > config_.time_limit_s)
    return ends("time_limit", fmt::format("after {:g} s it was {:.1f} m from the goal", config_.time_limit_s,
                                          (goal_W_ - aircraft_.vehicle().state().p_WB).norm()));
  if (last && decisions.has_no_way())
    return ends("no_way", "all that it can reach was seen, and none of it leads to the goal");
  if (last && decisions.is_goal_blocked()) return ends("goal_blocked", "the vehicle has no room at the goal");
  if (seconds(now - best_at_) > config_.no_progress_s)
    return ends("gave_up",
                fmt::format("for {:g} s it came neither nearer to the goal than {:.1f} m nor far from "
                            "where it was",
                            config_.no_progress_s, best_distance_m_));
  return nullptr;
}

const char* MissionJudge::judge(MonotonicTime now) {
  const sitl::VehicleState& s = aircraft_.vehicle().state();
  const flight::DecisionProgram& decisions = system_.decision_program();
  const Vector3& goal_W = decisions.goals().now_W();
  const double to_goal_m = (goal_W - s.p_WB).norm();
  if (goal_W != goal_W_) {
    goal_W_ = goal_W;
    best_distance_m_ = to_goal_m;
    moved_to_W_ = s.p_WB;
    best_at_ = now;
  }
  watch(now);
  if (const char* reason = contact(now)) return reason;
  const bool empty = s.battery_ratio <= 0.0;
  const bool late = seconds(now.time_since_epoch()) > config_.time_limit_s;
  if (system_.pilot().action() != governor::Action::kGoOn) {
    if (const char* reason = failsafe_reason(now)) return reason;
    if (empty && s.on_ground) return ends("battery_empty", "the battery was empty after it came down");
    return late ? ends("time_limit", fmt::format("after {:g} s its failsafe had not ended the flight",
                                                 config_.time_limit_s))
                : nullptr;
  }
  if (is_last() && to_goal_m < config_.goal_within_m && s.v_WB.norm() < kReachedSpeed_mps &&
      believes_to_have_arrived())
    return ends("reached_goal", fmt::format("{:.2f} m from the goal", to_goal_m));
  if (to_goal_m < best_distance_m_ - 0.5 || (s.p_WB - moved_to_W_).norm() > kMoved_m) {
    best_distance_m_ = std::min(best_distance_m_, to_goal_m);
    moved_to_W_ = s.p_WB;
    best_at_ = now;
  }
  if (empty) return ends("battery_empty", fmt::format("the battery was empty in flight; {}", words_of(s)));
  if (give_up_ == nullptr) {
    give_up_ = hopeless(now);
    if (give_up_ != nullptr) system_.decision_program().give_up();
    return nullptr;
  }
  // Given up: no more decisions; the committed trajectory ends in a stop, and the mission in a hover.
  const Trajectory& committed = system_.control().committed();
  const bool stopped = now > committed.ends() && s.v_WB.norm() < kHover_mps;
  const bool helpless = seconds(now.time_since_epoch()) > config_.time_limit_s + kGiveUpAfter_s;
  return stopped || helpless ? give_up_ : nullptr;
}

}  // namespace roborun::mission
