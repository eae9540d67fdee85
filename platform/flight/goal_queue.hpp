/// The goals of a flight, in order, and what became of each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/exchange/mailbox.hpp"
#include "core/geometry/fence.hpp"
#include "core/geometry/vector.hpp"
#include "core/memory/static_vector.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::flight {

/// Where a flight has reached its goal.
[[nodiscard]] constexpr bool is_at_goal(double to_goal_m, double speed_mps) noexcept {
  return to_goal_m < 1.0 && speed_mps < 0.5;
}

enum class GoalAnswer : std::uint8_t {
  kFlown,     ///< No answer yet: it is flown to, or it is to come.
  kReached,   ///< is_at_goal(), by the vehicle's own estimate.
  kBlocked,   ///< No room for the vehicle at it: it hovers at the nearest place that it could reach.
  kNoWay,     ///< Proof that no way leads to it.
  kReplaced,  ///< Others were given in its place.
};
[[nodiscard]] const char* to_string(GoalAnswer answer) noexcept;

struct Goal {
  Vector3 p_W = Vector3::Zero();
  GoalAnswer answer{};
  MonotonicTime at{};   ///< Of the answer.
  double distance_m{};  ///< From the vehicle then.
};

/// Fixed memory. One thread gives goals, the decision lane's own does the rest. RT-safe: O(kMost).
class GoalQueue {
 public:
  static constexpr std::size_t kMost = 16;      ///< Given at once.
  static constexpr std::size_t kMostTold = 64;  ///< Later ones are flown to and not told.
  using Places = core::StaticVector<Vector3, kMost>;

  struct Config {
    Aabb bounds_W{};
    core::Fence fence{};
    double room_m{};  ///< That the fence leaves around a goal.
  };
  GoalQueue(const Config& config, const Vector3& first_W) noexcept;

  /// These in the place of all that are not answered yet, from the next decision on. kGoalBlocked: one of them is not
  /// finite, outside of the bounds, or too near to the fence; kInvalidArgument: none, or more than kMost. Then
  /// nothing changes.
  [[nodiscard]] Status give(std::span<const Vector3> goals_W) noexcept;
  /// What was given last takes effect. True if there was something.
  bool take(MonotonicTime now, const Vector3& p_WB) noexcept;
  /// The goal of now has this answer, and the next one is flown to. False, and nothing changes, if it is the last one.
  bool next(GoalAnswer answer, MonotonicTime now, const Vector3& p_WB) noexcept;

  [[nodiscard]] const Vector3& now_W() const noexcept { return places_W_[at_]; }
  [[nodiscard]] bool is_last() const noexcept { return at_ + 1 == places_W_.size(); }
  /// In the order in which they were given.
  [[nodiscard]] std::span<const Goal> told() const noexcept { return {told_.begin(), told_.size()}; }

 private:
  void begin(const Places& places_W) noexcept;
  void answer(std::size_t index, GoalAnswer answer, MonotonicTime now, const Vector3& p_WB) noexcept;

  Config config_;
  core::Mailbox<Places> given_;
  Places places_W_;
  std::size_t at_{0};     ///< Of places_W_.
  std::size_t first_{0};  ///< Of them, in told_.
  core::StaticVector<Goal, kMostTold> told_;
};

}  // namespace roborun::flight
