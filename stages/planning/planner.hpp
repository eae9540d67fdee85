/// What every path planner offers: a piecewise-straight, collision-free path towards the goal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/executive/stage_budget.hpp"
#include "core/geometry/vector.hpp"
#include "core/memory/static_vector.hpp"
#include "firmware_if/status.hpp"
#include "stages/perception/map_view.hpp"
#include "stages/planning/ways.hpp"

namespace roborun::stages {

inline constexpr std::size_t kMaxWaypoints = 64;
using Path = core::StaticVector<Vector3, kMaxWaypoints>;

struct PlanRequest {
  Vector3 start_W = Vector3::Zero();
  /// Final goal of the mission; most of the time far outside the known space.
  Vector3 goal_W = Vector3::Zero();
  Aabb bounds_W{};       ///< The vehicle's centre stays inside.
  double radius_m{};     ///< Vehicle and tracking error; every point of the path keeps this box free.
  double volume_m3{};    ///< v2: stop when the explored volume exceeds it.
  double horizon_m{};    ///< No point of the path is farther from the start than this.
  double satisfied_m{};  ///< A path to the goal of at most this length ends the search; 0: search on.
  /// The path of the plan before, or empty: a hint. Nothing of it is taken unchecked.
  Path kept_W{};
  /// What is known of the ways to the goal, or null: then the rest of a way counts as straight and unknown.
  const Ways* ways{nullptr};
  std::uint64_t seed{};  ///< Same request, same map, same seed: same path.
};

struct PlanResult {
  Path path_W{};        ///< From the start; empty unless kOk or kBudgetSpent.
  bool reaches_goal{};  ///< The last way-point is the goal (within one cell).
  double cost_m{};      ///< Length of the path.
  /// units: map lookups; volume_m3: space explored by the tree. In lockstep it is what the flight is charged,
  /// and it is compared with the time that it took (platform/mission/work_check.hpp).
  core::Work work{};
};

/// Contract (proved on every implementation by tests/stages/planning/planner_contract_test.cpp):
///  1. Every straight piece of a returned path passes is_segment_free() on the given view. Unknown is not
///     free.
///  2. If the goal cannot be reached inside known free space, the path leads to the point of it from which
///     the goal promises to be nearest: least path length plus kUnknownWeight times the remaining straight
///     distance.
///  3. These are answers, not errors:
///      - kStartBlocked: no path; how it is left, find_way_out() knows (way_out.hpp);
///      - kGoalBlocked: the goal is occupied or out of bounds; with the path to the nearest point, if there
///        is one;
///      - kNoPath: nothing is better than the start;
///      - kInvalidArgument: not finite, or empty bounds;
///      - kBudgetSpent: with the best path so far.
class Planner {
 public:
  virtual ~Planner() = default;
  [[nodiscard]] virtual Status plan(const PlanRequest& request, const MapView& view,
                                    core::StageBudget& budget, PlanResult& result) noexcept = 0;
};

}  // namespace roborun::stages
