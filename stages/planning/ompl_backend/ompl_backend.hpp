/// OMPL's planners behind the interface of the own planner: the baseline. Allocates: a target of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "core/range.hpp"
#include "stages/planning/planner.hpp"

namespace roborun::stages {

struct OmplConfig {
  /// Termination checks of the planner: a bound that repeats, unlike wall time. [1, 10000000]
  std::uint32_t max_iterations{3000};
  [[nodiscard]] constexpr Status validate() const noexcept {
    return core::within<std::uint32_t>(max_iterations, 1, 10'000'000) ? Status::kOk
                                                                      : Status::kInvalidArgument;
  }
};

/// Makes any of ompl_planner_names() (ompl_space.hpp); nullptr for another name. The space is R3 inside
/// the bounds and the horizon; the goal is the mission's goal if it lies there and is free, otherwise the
/// known-free point of the direct way; without an exact solution the approximate one is taken. The library's
/// exceptions end here. Repeats for the same sequence of calls in a process: OMPL has one global seed, set by
/// the first planner made. Precondition, asserted: config.validate() is kOk.
[[nodiscard]] std::unique_ptr<Planner> make_ompl_planner(std::string_view name,
                                                         const OmplConfig& config) noexcept;

}  // namespace roborun::stages
