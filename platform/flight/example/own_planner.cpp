/// Flies the planner of own_planner.hpp through the shipped simulator. Links roborun::mission.
#include "own_planner.hpp"

#include <memory>

#include "fly.hpp"

int main() {
  roborun::board::OwnParts own;
  own.planner = [](const roborun::board::PartRequest&) {
    return std::make_unique<example::StraightPlanner>();
  };
  return example::fly(own);
}
