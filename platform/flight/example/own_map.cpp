/// Flies on the map of own_map.hpp through the shipped simulator. Links roborun::mission.
#include "own_map.hpp"

#include <memory>

#include "fly.hpp"

int main() {
  roborun::board::OwnParts own;
  own.map = [](const roborun::board::PartRequest& request) {
    return std::make_unique<example::VoxelMap>(request);
  };
  return example::fly(own);
}
