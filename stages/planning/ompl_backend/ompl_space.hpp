/// What every OMPL planner needs to plan in our map: R3 with our collision checks, and planners by name.
#pragma once

#include <ompl/base/Planner.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>

#include <cstdint>
#include <span>
#include <string_view>

#include "stages/perception/map_view.hpp"

namespace roborun::stages {

/// R3 inside `bounds_W`: a state is valid if its box is free, a motion if is_segment_free(): the same checks
/// as the own planner's. `view` and `lookups` must live as long as the result.
[[nodiscard]] ompl::base::SpaceInformationPtr make_ompl_space(const MapView& view, const Aabb& bounds_W,
                                                              double radius_m, std::uint64_t& lookups);
/// Shortest path from start to within `tolerance_m` of the goal.
[[nodiscard]] ompl::base::ProblemDefinitionPtr make_ompl_problem(const ompl::base::SpaceInformationPtr& info,
                                                                 const Vector3& start_W,
                                                                 const Vector3& goal_W, double tolerance_m);
[[nodiscard]] Vector3 to_vector(const ompl::base::State* state);

/// OMPL's geometric planners by OMPL's own names; nullptr for another name.
[[nodiscard]] ompl::base::PlannerPtr allocate_ompl_planner(std::string_view name,
                                                           const ompl::base::SpaceInformationPtr& info);
[[nodiscard]] std::span<const std::string_view> ompl_planner_names() noexcept;

}  // namespace roborun::stages
