/// Maps and planners by name: any design flies with any of them.
#pragma once

#include <memory>
#include <string>

#include "core/geometry/vector.hpp"
#include "core/memory/arena.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/planning/planner.hpp"

namespace roborun::app {

/// Which map and planner: "own" or "octomap", "own" or "ompl:NAME".
struct BackendNames {
  std::string map{"own"};
  std::string planner{"own"};
  friend bool operator==(const BackendNames&, const BackendNames&) = default;
};

struct MapAndPlanner {
  std::unique_ptr<stages::OccupancyMap> map;
  std::unique_ptr<stages::Planner> planner;
};

/// Bytes that the own backends take from the arena.
[[nodiscard]] std::size_t backend_bytes(const Aabb& map_bounds_W, const sitl::DepthCameraConfig& camera);
/// map: "own" or "octomap"; planner: "own" or "ompl:NAME". Throws sitl::InputError for anything else, and for
/// a world that the map cannot hold.
[[nodiscard]] MapAndPlanner make_backends(const std::string& map, const std::string& planner,
                                          const Aabb& map_bounds_W, const sitl::DepthCameraConfig& camera,
                                          core::Arena& arena);

}  // namespace roborun::app
