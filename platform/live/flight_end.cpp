#include "platform/live/flight_end.hpp"

#include "platform/flight/goal_queue.hpp"

namespace roborun::live {
namespace {

using governor::Action;

constexpr double kHolding_s = 5.0;       // of hovering, until a hold counts as the end
constexpr double kNoProgress_s = 120.0;  // as mission::JudgeConfig
constexpr double kMoved_m = 5.0;
constexpr double kNearer_m = 0.5;
constexpr double kZeros_s = 0.3;    // of zeros, after the motors are off
constexpr double kFalling_s = 3.0;  // the same, where they went off in the air
constexpr double kLost_s = 10.0;    // of an autopilot's silence, until it is left to itself
constexpr double kDisarm_s = 6.0;   // as long as it is asked to

}  // namespace

Vector3 FlightEnd::p_W() const {
  return {seen_.x_m.load(std::memory_order_relaxed), seen_.y_m.load(std::memory_order_relaxed),
          seen_.z_m.load(std::memory_order_relaxed)};
}

bool FlightEnd::is_there() const {
  return seen_.phase.load(std::memory_order_relaxed) == governor::Phase::kMission &&
         flight::is_at_goal(to_goal_m(), seen_.speed_mps.load(std::memory_order_relaxed));
}

bool FlightEnd::is_stuck(double now_s) {
  const double far_m = to_goal_m();
  const Vector3 at_W = p_W();
  if ((has_autopilot_ && is_on_ground()) || far_m < best_m_ - kNearer_m ||
      (at_W - moved_to_W_).norm() > kMoved_m) {
    best_m_ = std::min(best_m_, far_m);
    moved_to_W_ = at_W;
    best_s_ = now_s;
  }
  return now_s - best_s_ > kNoProgress_s;
}

const char* FlightEnd::why_failsafe(double now_s) {
  switch (seen_.action.load(std::memory_order_relaxed)) {
    case Action::kKill:
      return "killed";
    case Action::kTerminate:
      return "terminated";
    case Action::kLand:
      return seen_.landed.load(std::memory_order_relaxed) ? "landed" : nullptr;
    case Action::kHold:
      if (!hold_s_) hold_s_ = now_s;
      return now_s - *hold_s_ > kHolding_s ? "holding" : nullptr;
    default:
      hold_s_.reset();
      return nullptr;
  }
}

const char* FlightEnd::why_over(double now_s) {
  if (stop_ && stop_()) return "interrupted";
  if (const char* why = why_failsafe(now_s)) return why;
  if (is_last_ && is_there()) return "reached_goal";
  if (seen_.no_way.load(std::memory_order_relaxed)) return "no_way";
  if (seen_.goal_blocked.load(std::memory_order_relaxed)) return "goal_blocked";
  if (is_stuck(now_s)) return "gave_up";
  return now_s > time_limit_s_ ? "time_limit" : nullptr;
}

const char* FlightEnd::why_not_ours(double now_s) {
  using firmware_if::AutopilotStage;
  const AutopilotStage stage = seen_.stage.load(std::memory_order_relaxed);
  // Disarmed by us, or by itself on the ground at the end of our descent.
  const bool down =
      seen_.landed.load(std::memory_order_relaxed) ||
      (seen_.descending.load(std::memory_order_relaxed) && !seen_.armed.load(std::memory_order_relaxed));
  if (stage != AutopilotStage::kLost) lost_s_.reset();
  if (down) return nullptr;
  switch (stage) {
    case AutopilotStage::kPilots:
      ended_ = "the pilot's";
      return "pilot";
    case AutopilotStage::kRefused:
      ended_ = is_on_ground() ? "on the ground" : "the pilot's";
      return "refused";
    case AutopilotStage::kLost:
      if (!lost_s_) lost_s_ = now_s;
      if (now_s - *lost_s_ < kLost_s) return nullptr;
      ended_ = "the autopilot's";
      return "lost";
    default:
      return nullptr;
  }
}

FlightEnd::Order FlightEnd::step(double now_s) {
  const bool flies_on = reason_.empty();
  if (!flies_on && is_down(now_s)) return Order::kEnd;
  const char* const not_ours = why_not_ours(now_s);
  const char* const why = not_ours == nullptr && flies_on ? why_over(now_s) : not_ours;
  if (why != nullptr && flies_on) {
    reason_ = why;
    reason_s_ = now_s;
  }
  if (not_ours != nullptr) return Order::kEnd;
  return why != nullptr && flies_on ? Order::kLand : Order::kGoOn;
}

bool FlightEnd::is_off() const {
  const Action action = seen_.action.load(std::memory_order_relaxed);
  return action == Action::kTerminate || action == Action::kKill;
}

bool FlightEnd::is_down(double now_s) {
  const bool on_ground = is_on_ground();
  const bool armed = has_autopilot_ && seen_.armed.load(std::memory_order_relaxed);
  const bool landed = seen_.landed.load(std::memory_order_relaxed) ||
                      (has_autopilot_ && !armed && seen_.descending.load(std::memory_order_relaxed));
  if (!off_s_ && (on_ground || landed || is_off())) {
    off_s_ = now_s;
    ended_ = on_ground ? "on the ground" : landed ? "landed" : "motors off";
  }
  if (!on_ground && !landed && !is_off()) off_s_.reset();  // it took off in that very moment
  if (!off_s_) return false;
  if (armed && now_s - *off_s_ < kDisarm_s) return false;
  return now_s - *off_s_ > (is_off() && !on_ground ? kFalling_s : kZeros_s);
}

}  // namespace roborun::live
