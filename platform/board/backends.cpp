#include "platform/board/backends.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "platform/board/plugin_loader.hpp"
#include "platform/input/input_error.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/perception/cloud_images.hpp"
#include "stages/perception/octomap_backend/octomap_backend.hpp"
#include "stages/planning/ompl_backend/ompl_backend.hpp"
#include "stages/planning/rrt_star.hpp"

namespace roborun::board {
namespace {

stages::BrickMap::Config brick_config(const Aabb& map_bounds_W, const ImageLimits& images) {
  stages::BrickMap::Config config;
  config.bounds_W = map_bounds_W;
  config.max_image_width = images.width;
  config.max_image_height = images.height;
  config.max_frames = images.frames;
  config.all_around_frames = images.all_around_frames;
  config.vehicle_radius_m = images.vehicle_radius_m;
  config.thinnest_m = images.thinnest_m;
  config.lattice = images.lattice;
  if (config.validate() != Status::kOk) {
    throw InputError(
        fmt::format("map: the world is too large for the map: at most 4 million bricks of {} m; "
                    "must have smaller bounds, or the vehicle a larger limits.finest_cell_m",
                    stages::kBrickCells * images.lattice.finest_m));
  }
  return config;
}

std::unique_ptr<stages::OccupancyMap> make_map(const std::string& name, const PartRequest& request,
                                               core::Arena& arena) {
  const Aabb& bounds_W = request.map_bounds_W;
  const ImageLimits& images = request.images;
  if (name == "own") return std::make_unique<stages::BrickMap>(brick_config(bounds_W, images), arena);
  if (name == "octomap")
    return stages::make_octomap_backend(
        {bounds_W, images.vehicle_radius_m, images.lattice, images.range_m + 5.0});
  if (is_plugin(name)) return load_map(name, request);
  throw InputError(fmt::format("unknown map '{}': must be own or octomap, or plugin:FILE.so", name));
}

std::unique_ptr<stages::Planner> make_planner(const std::string& name, const PartRequest& request,
                                              core::Arena& arena) {
  if (name == "own") return std::make_unique<stages::RrtStar>(stages::RrtStar::Config{}, arena);
  if (is_plugin(name)) return load_planner(name, request);
  std::unique_ptr<stages::Planner> planner;
  if (name.rfind("ompl:", 0) == 0) planner = stages::make_ompl_planner(name.substr(5), {});
  if (planner == nullptr) {
    throw InputError(fmt::format(
        "unknown planner '{}': must be own or ompl:NAME, NAME one of OMPL's "
        "geometric planners (RRTstar, "
        "InformedRRTstar, BITstar, ABITstar, AITstar, RRTConnect, PRMstar, FMT, ...), or plugin:FILE.so",
        name));
  }
  return planner;
}

std::unique_ptr<stages::Ways> make_ways(const std::string& name, const PartRequest& request) {
  if (name == "own") return nullptr;
  if (is_plugin(name)) return load_ways(name, request);
  throw InputError(fmt::format("unknown memory of ways '{}': must be own or plugin:FILE.so", name));
}

}  // namespace

bool uses_plugin(const BackendNames& names) noexcept {
  return is_plugin(names.map) || is_plugin(names.planner) || is_plugin(names.ways);
}

ImageLimits image_limits(const SensorRig& rig, const VehicleModel& vehicle,
                         const PrecisionLattice& lattice) noexcept {
  ImageLimits limits;
  limits.vehicle_radius_m = vehicle.radius_m;
  limits.thinnest_m = vehicle.thinnest_m;
  limits.lattice = lattice;
  limits.frames = rig.cameras.size();
  limits.all_around_frames = cameras_see_all_around(rig) ? rig.cameras.size() : 0;
  for (const CameraSpec& camera : rig.cameras) {
    limits.width = std::max(limits.width, camera.width);
    limits.height = std::max(limits.height, camera.height);
    limits.range_m = std::max(limits.range_m, camera.range_m);
  }
  for (const LidarSpec& lidar : rig.lidars) {
    limits.frames = std::max(limits.frames, stages::CloudImages::kImages);
    limits.width = std::max(limits.width, cloud_pixels(lidar));
    limits.height = std::max(limits.height, cloud_pixels(lidar));
    limits.range_m = std::max(limits.range_m, lidar.range_m);
  }
  return limits;
}

std::size_t backend_bytes(const Aabb& map_bounds_W, const ImageLimits& images) {
  return stages::BrickMap::arena_bytes(brick_config(map_bounds_W, images)) +
         stages::RrtStar::arena_bytes({}) + 4096;
}

Backends make_backends(const BackendNames& names, const PartRequest& request, core::Arena& arena,
                       const OwnParts& own) {
  Backends result{own.map ? own.map(request) : make_map(names.map, request, arena),
                  own.planner ? own.planner(request) : make_planner(names.planner, request, arena),
                  own.ways ? own.ways(request) : make_ways(names.ways, request)};
  if (result.map == nullptr || result.planner == nullptr || (own.ways && result.ways == nullptr))
    throw InputError("map, planner, ways: not enough memory");
  return result;
}

}  // namespace roborun::board
