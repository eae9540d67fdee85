/// OMPL's planners behind the interface of the own planner: the baseline. Allocates: a target of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "stages/planning/planner.hpp"

namespace roborun::stages {

struct OmplConfig {
  std::uint32_t max_iterations{
      3000};  ///< Termination checks of the planner: a bound that repeats, unlike wall time.
};

/// Any of ompl_planner_names() (ompl_space.hpp); nullptr for another name. The space is R3 inside
/// the bounds and the horizon; the goal is the mission's goal if it lies there and is free, otherwise the
/// known-free point of the direct way; without an exact solution the approximate one is taken. The library's
/// exceptions end here. Repeats for the same sequence of calls in a process: OMPL has one global seed, set by
/// the first planner made.
[[nodiscard]] std::unique_ptr<Planner> make_ompl_planner(std::string_view name,
                                                         const OmplConfig& config) noexcept;

}  // namespace roborun::stages
