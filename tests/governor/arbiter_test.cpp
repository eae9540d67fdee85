#include "governor/failsafe/arbiter.hpp"

#include <gtest/gtest.h>

#include "tests/support/names.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::governor {
namespace {

constexpr std::array<Phase, kPhaseCount> kPhases{Phase::kGround,     Phase::kTakeOff, Phase::kMission,
                                                 Phase::kHold,       Phase::kReturn,  Phase::kLand,
                                                 Phase::kTerminated, Phase::kKilled};

/// What a flight does with the arbiter: the action begins a phase, and the phase is the memory.
Action run(ConditionSet conditions, Phase& phase) {
  const Action action = arbitrate(conditions, phase);
  phase = phase_after(action, phase);
  return action;
}

TEST(Arbiter, IsTotalAndMonotoneOnAllSubsetsAndPhases) {
  std::array<int, kActionCount> seen{};
  for (const Phase phase : kPhases) {
    for (unsigned set = 0; set <= kAllConditions; ++set) {
      const Action action = arbitrate(static_cast<ConditionSet>(set), phase);
      ASSERT_LT(static_cast<std::size_t>(action), kActionCount);
      ++seen[static_cast<std::size_t>(action)];
      // One condition more is enough: every superset is a chain of these.
      for (unsigned c = 0; c < kConditionCount; ++c) {
        const auto more = static_cast<ConditionSet>(set | (1U << c));
        ASSERT_GE(arbitrate(more, phase), action)
            << "set " << set << " and condition " << c << ", phase " << to_string(phase);
      }
    }
  }
  for (std::size_t a = 0; a < kActionCount; ++a) EXPECT_GT(seen[a], 0) << to_string(static_cast<Action>(a));
}

TEST(Arbiter, TakesAPhaseThatIsNoneForKilled) {
  for (const unsigned none : {8U, 9U, 255U})
    EXPECT_EQ(arbitrate(0, static_cast<Phase>(none)), arbitrate(0, Phase::kKilled)) << none;
  EXPECT_EQ(arbitrate(0, Phase::kKilled), Action::kKill);
}

TEST(Arbiter, BeginsThePhaseOfItsActionButStaysOnTheGround) {
  for (const Phase phase : kPhases) {
    const bool ground = phase == Phase::kGround;
    EXPECT_EQ(phase_after(Action::kGoOn, phase), phase);
    EXPECT_EQ(phase_after(Action::kHold, phase), ground ? phase : Phase::kHold);
    EXPECT_EQ(phase_after(Action::kReturn, phase), ground ? phase : Phase::kReturn);
    EXPECT_EQ(phase_after(Action::kLand, phase), ground ? phase : Phase::kLand);
    EXPECT_EQ(phase_after(Action::kTerminate, phase), Phase::kTerminated);
    EXPECT_EQ(phase_after(Action::kKill, phase), Phase::kKilled);
  }
}

TEST(Arbiter, NeverReplacesASaferActionInAnyOrderOfAnyPairOfSets) {
  for (const Phase start : kPhases) {
    for (unsigned c1 = 0; c1 < kConditionCount; ++c1) {
      for (unsigned c2 = 0; c2 < kConditionCount; ++c2) {
        // Both orders, overlapping, one after the other, and gone again.
        const auto a = static_cast<ConditionSet>(1U << c1);
        const auto b = static_cast<ConditionSet>(1U << c2);
        Phase phase = start;
        Action last = Action::kGoOn;
        for (const ConditionSet now : {a, static_cast<ConditionSet>(a | b), b, ConditionSet{0}, a, b}) {
          const Action action = run(now, phase);
          if (start != Phase::kGround) {
            ASSERT_GE(action, last) << "pair " << c1 << ", " << c2 << " from " << to_string(start);
          }
          last = action;
        }
      }
    }
  }
}

TEST(Arbiter, SettlesAtOnceWhateverTheSetAndNeverOscillates) {
  for (const Phase start : kPhases) {
    for (unsigned set = 0; set <= kAllConditions; ++set) {
      Phase phase = start;
      const Action first = run(static_cast<ConditionSet>(set), phase);
      const Action second = run(static_cast<ConditionSet>(set), phase);
      const Phase settled = phase;
      const Action third = run(static_cast<ConditionSet>(set), phase);
      ASSERT_EQ(second, first) << "set " << set << " from " << to_string(start);
      ASSERT_EQ(third, second);
      ASSERT_EQ(phase, settled);
    }
  }
}

TEST(Arbiter, AKilledVehicleStaysKilledAndATerminatedOneCanStillBeKilled) {
  EXPECT_EQ(arbitrate(0, Phase::kKilled), Action::kKill);
  EXPECT_EQ(arbitrate(0, Phase::kTerminated), Action::kTerminate);
  for (const Phase phase : kPhases) EXPECT_EQ(arbitrate(bit(Condition::kKill), phase), Action::kKill);
  for (const Phase phase : kPhases) EXPECT_EQ(arbitrate(kAllConditions, phase), Action::kKill);
}

TEST(Arbiter, LandsWhereAReturnCannotBeFlown) {
  const ConditionSet low = bit(Condition::kBatteryLow);
  EXPECT_EQ(arbitrate(low, Phase::kMission), Action::kReturn);
  for (const Condition c : {Condition::kGnss, Condition::kDepth, Condition::kPlanner, Condition::kMap}) {
    EXPECT_EQ(arbitrate(low | bit(c), Phase::kMission), Action::kLand) << to_string(c);
    EXPECT_EQ(arbitrate(bit(c), Phase::kReturn), Action::kLand) << to_string(c);
  }
}

TEST(Arbiter, PrefersLandingToHoldingOnAnEmptyBattery) {
  EXPECT_EQ(arbitrate(bit(Condition::kDepth), Phase::kMission), Action::kHold);
  EXPECT_EQ(arbitrate(bit(Condition::kDepth) | bit(Condition::kBatteryCritical), Phase::kMission),
            Action::kLand);
  EXPECT_EQ(arbitrate(bit(Condition::kBatteryCritical), Phase::kHold), Action::kLand);
}

TEST(Arbiter, TerminatesAFlyAwayButNotOnTheGround) {
  const ConditionSet away = bit(Condition::kFence) | bit(Condition::kGnss);
  EXPECT_EQ(arbitrate(away, Phase::kMission), Action::kTerminate);
  EXPECT_EQ(arbitrate(away, Phase::kLand), Action::kTerminate);
  EXPECT_EQ(arbitrate(away, Phase::kGround), Action::kHold);
}

TEST(Arbiter, IgnoresBitsThatAreNoCondition) {
  for (const Phase phase : kPhases)
    EXPECT_EQ(arbitrate(static_cast<ConditionSet>(~kAllConditions), phase), arbitrate(0, phase));
}

TEST(Arbiter, DoesNotAllocate) {
  const test::NoAllocScope scope;
  unsigned sum = 0;
  for (unsigned set = 0; set <= kAllConditions; ++set)
    sum += static_cast<unsigned>(arbitrate(static_cast<ConditionSet>(set), Phase::kMission));
  EXPECT_GT(sum, 0U);
  EXPECT_EQ(scope.count(), 0U);
}

TEST(Arbiter, AnActionThatIsNoneKills) {
  EXPECT_EQ(phase_after(static_cast<Action>(kActionCount), Phase::kMission), Phase::kKilled);
}

TEST(Arbiter, ActionsConditionsAndPhasesHaveTheNamesOfScenarioFiles) {
  test::expect_names<Action>({"go_on", "hold", "return", "land", "terminate", "kill"});
  test::expect_names<Condition>({"battery_low", "battery_critical", "fence", "gnss", "depth", "can_telemetry",
                                 "link", "wind", "planner", "map", "watchdog", "kill"});
  test::expect_names<Phase>(
      {"ground", "take_off", "mission", "hold", "return", "land", "terminated", "killed"});
}

}  // namespace
}  // namespace roborun::governor
