#include "governor/failsafe/arbiter.hpp"

#include <algorithm>

namespace roborun::governor {
namespace {

constexpr bool is_sound() noexcept {
  for (std::size_t c = 0; c < kConditionCount; ++c) {
    const FailsafeRow& row = kFailsafeTable[c];
    if (static_cast<std::size_t>(row.condition) != c) return false;
    for (std::size_t p = 0; p < kPhaseCount; ++p) {
      if (row.action[p] < kPhaseFloor[p]) return false;
    }
  }
  return true;
}
static_assert(is_sound(), "rows in the order of their conditions, no cell below the floor of its phase");

}  // namespace

Action arbitrate(ConditionSet conditions, Phase phase) noexcept {
  const auto p = static_cast<std::size_t>(phase) < kPhaseCount ? static_cast<std::size_t>(phase)
                                                               : static_cast<std::size_t>(Phase::kKilled);
  Action action = kPhaseFloor[p];
  for (const FailsafeRow& row : kFailsafeTable) {
    if ((conditions & bit(row.condition)) != 0) action = std::max(action, row.action[p]);
  }
  if (action == Action::kReturn && (conditions & kReturnNeeds) != 0) action = Action::kLand;
  if ((conditions & kFlyAway) == kFlyAway && phase != Phase::kGround)
    action = std::max(action, Action::kTerminate);
  return action;
}

Phase phase_after(Action action, Phase phase) noexcept {
  switch (action) {
    case Action::kGoOn:
      return phase;
    case Action::kHold:
      return phase == Phase::kGround ? phase : Phase::kHold;
    case Action::kReturn:
      return phase == Phase::kGround ? phase : Phase::kReturn;
    case Action::kLand:
      return phase == Phase::kGround ? phase : Phase::kLand;
    case Action::kTerminate:
      return Phase::kTerminated;
    case Action::kKill:
      return Phase::kKilled;
  }
  return Phase::kKilled;
}

const char* to_string(Action action) noexcept {
  constexpr std::array<const char*, kActionCount> kName{"go_on", "hold",      "return",
                                                        "land",  "terminate", "kill"};
  return kName[static_cast<std::size_t>(action)];
}

const char* to_string(Condition condition) noexcept {
  constexpr std::array<const char*, kConditionCount> kName{
      "battery_low", "battery_critical", "fence", "gnss",     "depth", "can_telemetry", "link",
      "wind",        "planner",          "map",   "watchdog", "kill"};
  return kName[static_cast<std::size_t>(condition)];
}

const char* to_string(Phase phase) noexcept {
  constexpr std::array<const char*, kPhaseCount> kName{"ground", "take_off", "mission",    "hold",
                                                       "return", "land",     "terminated", "killed"};
  return kName[static_cast<std::size_t>(phase)];
}

}  // namespace roborun::governor
