#include "platform/app/backends.hpp"

#include <fmt/format.h>

#include "platform/sitl/world/input_error.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/perception/octomap_backend/octomap_backend.hpp"
#include "stages/planning/ompl_backend/ompl_backend.hpp"
#include "stages/planning/rrt_star.hpp"

namespace roborun::app {
namespace {

stages::BrickMap::Config brick_config(const Aabb& map_bounds_W, const sitl::DepthCameraConfig& camera) {
  stages::BrickMap::Config config;
  config.bounds_W = map_bounds_W;
  config.max_image_side = camera.pixels;
  if (config.validate() != Status::kOk) {
    throw sitl::InputError("map: the world is too large for the map: at most 4 million bricks of 4.8 m");
  }
  return config;
}

std::unique_ptr<stages::OccupancyMap> make_map(const std::string& name, const Aabb& bounds_W,
                                               const sitl::DepthCameraConfig& camera, core::Arena& arena) {
  if (name == "own") return std::make_unique<stages::BrickMap>(brick_config(bounds_W, camera), arena);
  if (name == "octomap") return stages::make_octomap_backend({bounds_W, camera.range_m + 5.0});
  throw sitl::InputError(fmt::format("unknown map '{}': must be own or octomap", name));
}

std::unique_ptr<stages::Planner> make_planner(const std::string& name, core::Arena& arena) {
  if (name == "own") return std::make_unique<stages::RrtStar>(stages::RrtStar::Config{}, arena);
  std::unique_ptr<stages::Planner> planner;
  if (name.rfind("ompl:", 0) == 0) planner = stages::make_ompl_planner(name.substr(5), {});
  if (planner == nullptr) {
    throw sitl::InputError(fmt::format(
        "unknown planner '{}': must be own or ompl:NAME, NAME one of OMPL's geometric planners (RRTstar, "
        "InformedRRTstar, BITstar, ABITstar, AITstar, RRTConnect, PRMstar, FMT, ...)",
        name));
  }
  return planner;
}

}  // namespace

std::size_t backend_bytes(const Aabb& map_bounds_W, const sitl::DepthCameraConfig& camera) {
  return stages::BrickMap::arena_bytes(brick_config(map_bounds_W, camera)) +
         stages::RrtStar::arena_bytes({}) + 4096;
}

MapAndPlanner make_backends(const std::string& map, const std::string& planner, const Aabb& map_bounds_W,
                            const sitl::DepthCameraConfig& camera, core::Arena& arena) {
  MapAndPlanner result{make_map(map, map_bounds_W, camera, arena), make_planner(planner, arena)};
  if (result.map == nullptr) throw sitl::InputError("map: not enough memory");
  return result;
}

}  // namespace roborun::app
