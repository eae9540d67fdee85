/// What every memory of the ways to a goal offers: what was seen of them stays, dead ends are left, and it proves it when there is no way.
#pragma once

#include <cstddef>
#include <span>

#include "core/executive/stage_budget.hpp"
#include "core/geometry/vector.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"
#include "stages/perception/map_view.hpp"

namespace roborun::stages {

/// A metre of space that nobody has seen yet counts as this many metres of known path: it may hide a detour.
inline constexpr double kUnknownWeight = 2.0;

/// Where and when the vehicle looks.
struct WayLook {
  MonotonicTime now{};
  Vector3 from_W = Vector3::Zero();
  double reach_m{};
};

/// Nothing of it is taken unchecked: planners look at the map before they follow a way. In each decision look(), then solve().
/// Calls end with their budget and count their work, which the planner's stage is charged for.
class Ways {
 public:
  virtual ~Ways() = default;

  /// Reads what the map knows now within reach of the vehicle. kOk or kBudgetSpent: the rest stays as it was.
  [[nodiscard]] virtual Status look(const MapView& map, const WayLook& look, core::StageBudget& budget,
                                    core::Work& work) noexcept = 0;
  /// The ways to the goal from everywhere that is not farther from it than the vehicle. kOk; kNoPath: there is none, and
  /// it is proved: cells that are occupied stand between both; kInfeasible: none with the room that is planned with, but
  /// there may be one that is narrower than that, or than cells tell, and none of it is worth a closer look; kStartBlocked, kGoalBlocked: no place of the vehicle
  /// is near (or from those near the start no way leads on, which proves nothing); kBudgetSpent: no answer.
  [[nodiscard]] virtual Status solve(const Vector3& from_W, const Vector3& goal_W, core::StageBudget& budget,
                                     core::Work& work) noexcept = 0;
  /// Nothing is known of any way.
  virtual void forget() noexcept = 0;

  /// After solve(): metres of known way, what is unknown on it at kUnknownWeight; +inf where none is known.
  [[nodiscard]] virtual double to_goal_m(const Vector3& p_W) const noexcept = 0;
  /// The way from a place: corners in known space one after the other, no farther than `within_m` from it, the last one
  /// where unknown space begins or the goal itself. Returns how many were written.
  [[nodiscard]] virtual std::size_t known_way(const Vector3& from_W, double within_m,
                                              std::span<Vector3> way_W) const noexcept = 0;
};

}  // namespace roborun::stages
