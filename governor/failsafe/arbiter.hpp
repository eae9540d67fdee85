/// What the vehicle does when something is wrong: one table from conditions and phase of flight to one
/// action. Ranks after the failsafe matrices of PX4 and ArduPilot; the rules below the table are ours.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace roborun::governor {

/// Ascending: each is safer for those on the ground than the one before.
enum class Action : std::uint8_t {
  kGoOn,       ///< The mission; on the ground: it may start.
  kHold,       ///< To the stop at the end of the committed trajectory, and hover. On the ground: stay.
  kReturn,     ///< The goal is the place of the take-off; there it lands.
  kLand,       ///< Down, here or at the nearest place known to be free.
  kTerminate,  ///< Motors off, by the runtime's own judgement.
  kKill,       ///< Motors off, by the operator's switch.
};
inline constexpr std::size_t kActionCount = 6;
[[nodiscard]] const char* to_string(Action action) noexcept;

/// How each is detected, and from when on, is the table of platform/flight/failsafe_monitor.hpp.
enum class Condition : std::uint8_t {
  kBatteryLow,
  kBatteryCritical,
  kFence,         ///< Outside of the permitted space.
  kGnss,          ///< No usable fix, and no odometry.
  kDepth,         ///< No usable depth image.
  kCanTelemetry,  ///< A motor's controller is silent, or the bus is gone.
  kLink,          ///< No operator.
  kWind,          ///< Blown off the path by more than what plans allow for.
  kPlanner,       ///< No usable trajectory: the planner fails, or the decision lane is late.
  kMap,           ///< The map takes nothing more.
  kWatchdog,      ///< The control loop has lost the vehicle: no IMU, or an attitude it never asks for.
  kKill,          ///< The kill switch, or its wiring.
};
inline constexpr std::size_t kConditionCount = 12;
[[nodiscard]] const char* to_string(Condition condition) noexcept;

/// A set of conditions, one bit each.
using ConditionSet = std::uint16_t;
[[nodiscard]] constexpr ConditionSet bit(Condition condition) noexcept {
  return static_cast<ConditionSet>(1U << static_cast<unsigned>(condition));
}
inline constexpr ConditionSet kAllConditions = (1U << kConditionCount) - 1U;

/// What the vehicle is doing. From kHold on it is what an earlier action began: no phase is left for a less
/// safe one, which is the memory of the arbiter.
enum class Phase : std::uint8_t { kGround, kTakeOff, kMission, kHold, kReturn, kLand, kTerminated, kKilled };
inline constexpr std::size_t kPhaseCount = 8;
[[nodiscard]] const char* to_string(Phase phase) noexcept;

struct FailsafeRow {
  Condition condition;
  std::array<Action, kPhaseCount> action;  ///< By Phase.
};

// clang-format off
inline constexpr std::array<FailsafeRow, kConditionCount> kFailsafeTable = [] {
  using C = Condition;
  constexpr Action hold = Action::kHold, back = Action::kReturn, land = Action::kLand,
                   term = Action::kTerminate, kill = Action::kKill;
  return std::array<FailsafeRow, kConditionCount>{{
    //                      ground take-off mission  hold  return  land  terminated killed
    {C::kBatteryLow,      {{ hold,  land,    back,   back,  back,  land,  term,     kill }}},  // below is home
    {C::kBatteryCritical, {{ hold,  land,    land,   land,  land,  land,  term,     kill }}},
    {C::kFence,           {{ hold,  land,    back,   back,  back,  land,  term,     kill }}},
    {C::kGnss,            {{ hold,  land,    land,   land,  land,  land,  term,     kill }}},  // it drifts
    {C::kDepth,           {{ hold,  hold,    hold,   hold,  land,  land,  term,     kill }}},
    {C::kCanTelemetry,    {{ hold,  land,    land,   land,  land,  land,  term,     kill }}},  // four motors, no spare
    {C::kLink,            {{ hold,  land,    back,   back,  back,  land,  term,     kill }}},
    {C::kWind,            {{ hold,  land,    land,   land,  land,  land,  term,     kill }}},  // it cannot follow a path
    {C::kPlanner,         {{ hold,  hold,    hold,   hold,  land,  land,  term,     kill }}},
    {C::kMap,             {{ hold,  hold,    hold,   hold,  land,  land,  term,     kill }}},
    {C::kWatchdog,        {{ hold,  term,    term,   term,  term,  term,  term,     kill }}},
    {C::kKill,            {{ kill,  kill,    kill,   kill,  kill,  kill,  kill,     kill }}},
  }};
}();
// clang-format on

/// Without any condition: what the phase already is.
inline constexpr std::array<Action, kPhaseCount> kPhaseFloor{
    Action::kGoOn,   Action::kGoOn, Action::kGoOn,      Action::kHold,
    Action::kReturn, Action::kLand, Action::kTerminate, Action::kKill};

/// Combination rule 1: a return needs all of these; without one of them it becomes a landing.
inline constexpr ConditionSet kReturnNeeds =
    bit(Condition::kGnss) | bit(Condition::kDepth) | bit(Condition::kPlanner) | bit(Condition::kMap);
/// Combination rule 2: outside the fence and without position it may fly away: in the air, motors off.
inline constexpr ConditionSet kFlyAway = bit(Condition::kFence) | bit(Condition::kGnss);

/// The action: the safest of the phase's own, of each condition's cell, and of what the two rules make of it.
/// @param conditions  Any value; bits beyond the twelve are ignored.
/// @return            Exactly one action for every input. More conditions never give a less safe one.
/// RT-safe: O(1), no allocation, no state. Checked on all 4,096 subsets x 8 phases.
[[nodiscard]] Action arbitrate(ConditionSet conditions, Phase phase) noexcept;

/// The phase that an action begins; `phase` itself for kGoOn, and on the ground for all that is flown.
/// RT-safe: O(1).
[[nodiscard]] Phase phase_after(Action action, Phase phase) noexcept;

}  // namespace roborun::governor
