#include "platform/app/backends.hpp"

#include <fmt/format.h>

#include "platform/sitl/world/input_error.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/planning/rrt_star.hpp"

namespace roborun::app {
namespace {

stages::BrickMap::Config brick_config(const Aabb& map_bounds_W, const sitl::DepthCameraConfig& camera) {
  stages::BrickMap::Config config;
  config.bounds_W = map_bounds_W;
  config.max_image_side = camera.pixels;
  return config;
}

}  // namespace

std::size_t backend_bytes(const Aabb& map_bounds_W, const sitl::DepthCameraConfig& camera) {
  return stages::BrickMap::arena_bytes(brick_config(map_bounds_W, camera)) + stages::RrtStar::arena_bytes({}) + 4096;
}

MapAndPlanner make_backends(const std::string& map, const std::string& planner, const Aabb& map_bounds_W,
                            const sitl::DepthCameraConfig& camera, core::Arena& arena) {
  MapAndPlanner result;
  if (map == "own") {
    const stages::BrickMap::Config config = brick_config(map_bounds_W, camera);
    if (config.validate() != Status::kOk) throw sitl::InputError("map: the world is too large for the map: at most 4 million bricks of 4.8 m");
    result.map = std::make_unique<stages::BrickMap>(config, arena);
  } else {
    throw sitl::InputError(fmt::format("unknown map '{}': must be own or octomap", map));
  }
  if (planner == "own") {
    result.planner = std::make_unique<stages::RrtStar>(stages::RrtStar::Config{}, arena);
  } else {
    throw sitl::InputError(fmt::format("unknown planner '{}': must be own or ompl:RRTstar", planner));
  }
  return result;
}

}  // namespace roborun::app
