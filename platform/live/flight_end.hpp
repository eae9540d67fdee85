/// When a flight on real time is over, why, and when nothing is left to do in the air.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "platform/live/live_lanes.hpp"

namespace roborun::live {

/// Of the thread that watches. Times since the first release of the lanes.
class FlightEnd {
 public:
  /// Both outlive it; `stop` may be empty. `has_autopilot`: whether somebody else may take the vehicle.
  FlightEnd(const Seen& seen, const std::function<bool()>& stop, double time_limit_s, bool has_autopilot,
            const Vector3& goal_W)
      : seen_(seen),
        stop_(stop),
        time_limit_s_(time_limit_s),
        has_autopilot_(has_autopilot),
        goal_W_(goal_W) {}

  /// Of now; `is_last`: there the flight ends.
  void set_goal(const Vector3& goal_W, bool is_last) {
    goal_W_ = goal_W;
    is_last_ = is_last;
    best_m_ = std::numeric_limits<double>::infinity();
  }
  void is_last() { is_last_ = true; }
  /// It stands at the goal of now on purpose.
  void holds(double now_s) { best_s_ = now_s; }
  [[nodiscard]] Vector3 p_W() const;
  [[nodiscard]] double to_goal_m() const { return (p_W() - goal_W_).norm(); }
  [[nodiscard]] bool is_there() const;
  enum class Order : std::uint8_t {
    kGoOn,
    kLand,  ///< Said once: reason() says why.
    kEnd,   ///< Nothing is left to do in the air, or nothing may be commanded any more.
  };
  /// About twenty times a second.
  [[nodiscard]] Order step(double now_s);
  /// A LiveReport::reason, and since when; empty: it flies on.
  [[nodiscard]] const std::string& reason() const noexcept { return reason_; }
  [[nodiscard]] double reason_s() const noexcept { return reason_s_; }
  /// A LiveReport::ended; empty: it has not.
  [[nodiscard]] const std::string& ended() const noexcept { return ended_; }

 private:
  /// Why the vehicle is to come down. Null: it is not.
  [[nodiscard]] const char* why_over(double now_s);
  /// Why nothing may be commanded any more. Null: it is ours.
  [[nodiscard]] const char* why_not_ours(double now_s);
  /// True once nothing is left to do in the air. After why_over().
  [[nodiscard]] bool is_down(double now_s);
  [[nodiscard]] const char* why_failsafe(double now_s);
  [[nodiscard]] bool is_stuck(double now_s);
  [[nodiscard]] bool is_off() const;
  [[nodiscard]] bool is_on_ground() const { return !seen_.flying.load(std::memory_order_relaxed); }

  const Seen& seen_;
  const std::function<bool()>& stop_;
  double time_limit_s_;
  bool has_autopilot_;
  Vector3 goal_W_;
  bool is_last_{true};
  std::string reason_, ended_;
  double reason_s_{0.0};
  std::optional<double> off_s_, hold_s_, lost_s_;
  double best_m_{std::numeric_limits<double>::infinity()}, best_s_{0.0};
  Vector3 moved_to_W_ = Vector3::Zero();
};

}  // namespace roborun::live
