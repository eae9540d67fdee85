/// What the planners are compared on: fields of pillars, and what needs a search.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "stages/planning/planner.hpp"
#include "tests/support/box_view.hpp"

namespace roborun::bench {

struct Problem {
  test::BoxView view;
  stages::PlanRequest request;
};

/// pillars60, pillars150: pillars of 1.5 to 4.5 m, one for each 160 m2 and the first across the straight line. forest: a
/// trunk of 0.6 to 1.2 m for each 3.5 x 3.5 m. trap: walls on three sides of the goal, 20 to 48 m, open to the far side.
/// maze: 8 x 8 rooms with corridors of 5.6 m. serpentine: eight walls with openings at alternating ends. slots: three
/// walls with a slot of 2.4 m each. windows: three walls with a window of 2.4 x 2.4 m each. The same for the same number.
[[nodiscard]] Problem problem_of(std::string_view kind, std::uint64_t number);
/// So many are solved of each kind.
struct Kind {
  std::string_view name;
  std::uint64_t problems;
};
[[nodiscard]] const std::vector<Kind>& kinds();

}  // namespace roborun::bench
