/// Our planner as one of OMPL's, so that ompl::tools::Benchmark can measure it beside the others.
#pragma once

#include <ompl/base/Planner.h>

#include "stages/perception/map_view.hpp"
#include "stages/planning/rrt_star.hpp"

namespace roborun::stages {

/// Named "roborun_RRTstar". solve() runs until the termination condition is true, or until the planner's own
/// bounds (`config`) end it; a path to the goal is an exact solution, a path to somewhere else an approximate
/// one. Each solve() starts anew, with the next seed. `view` must live as long as the result; `info` must be
/// a make_ompl_space() of the same view and radius. Throws ompl::Exception for a goal that is not a state.
[[nodiscard]] ompl::base::PlannerPtr make_planner_for_ompl(const ompl::base::SpaceInformationPtr& info,
                                                           const MapView& view, double radius_m,
                                                           const RrtStar::Config& config);

}  // namespace roborun::stages
