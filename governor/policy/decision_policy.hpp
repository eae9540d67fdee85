/// Who decides how long to think, how precisely, and how fast to fly: the governor that ships, or a policy of
/// the reader's own (platform/flight/example/own_policy.cpp).
#pragma once

#include <cstdint>

#include "core/executive/stage_budget.hpp"
#include "core/operating_point.hpp"
#include "core/space_profile.hpp"
#include "firmware_if/time.hpp"
#include "governor/solver/lattice_solver.hpp"

namespace roborun::governor {

/// What set the time budget.
enum class BudgetSource : std::uint8_t { kTrajectory, kVisibility, kShortest, kLongest, kFailures, kFixed };
[[nodiscard]] const char* to_string(BudgetSource source) noexcept;

/// What set the speed limit: the vehicle file, the speed that spends least (Aim), the goal, something that moves or is thin nearby,
/// the static design, or a policy around the governor (the speed of a mission's step, or one of the reader's own).
enum class SpeedSource : std::uint8_t { kFile, kEnergy, kGoal, kMotion, kThin, kFixed, kPolicy };
[[nodiscard]] const char* to_string(SpeedSource source) noexcept;

/// What a policy is told besides the space.
struct Situation {
  int failures{};  ///< Decisions in a row without a trajectory.
  double distance_to_goal_m{};
  bool surveying{};  ///< The flight goes on to its hover whatever comes of this decision.
  bool motion{};     ///< Something moves nearby.
  bool thin{};       ///< Something thin stands or hangs nearby, and more may that is thinner.
  bool narrow{};     ///< What is flown was planned with the room of slow flight.
};

/// What was decided, and why.
struct Decision {
  OperatingPoint point{};
  Nanos time_budget{};  ///< Before the policy.
  BudgetSource source{};
  SpeedSource speed_source{};
  SolverProblem problem{};
  SolverSolution solution{};
  core::StageArray<double> predicted_s{};
  double demand_m{};  ///< Coarsest cell that the space allows: min((g_avg - width) / 4, d_obs / 2).

  /// Lowers the speed limit to this, if that is less. For a policy around another one.
  void cap_speed(double speed_mps) noexcept {
    if (!(speed_mps < point.speed_limit_mps)) return;
    point.speed_limit_mps = speed_mps;
    speed_source = SpeedSource::kPolicy;
  }
};

/// Contract:
///  1. decide() is called once per decision, after the point cloud and before the map. Its answer is granted
///     as it is: the policy alone keeps p0_level <= p1_level, both within 0 and kPrecisionLevels - 1, the
///     volumes at 0 or above, and the deadline above zero, in whole minor frames.
///  2. A profile may hold NaN and infinity (nothing in view, a camera without an image). The answer is finite.
///  3. observe() is called once per stage at the end of each decision that got there. A policy may ignore it.
///  4. The same calls in the same order give the same answers, on every machine.
/// RT-safe: no call blocks or allocates; decide() takes at most the budget of its slot (core::kFrameTable).
/// One thread.
class DecisionPolicy {
 public:
  virtual ~DecisionPolicy() = default;
  /// Returns what the stages may spend in this decision, and what was planned for each (predicted_s).
  [[nodiscard]] virtual Decision decide(const SpaceProfile& profile, const Situation& situation) noexcept = 0;
  /// Tells what a stage took, so that a model can follow a machine that slows down.
  virtual void observe(core::StageId id, double predicted_s, double spent_s) noexcept = 0;
  /// Returns the fastest that it ever allows, for reports.
  [[nodiscard]] virtual double v_max_mps() const noexcept = 0;
};

}  // namespace roborun::governor
