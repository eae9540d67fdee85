/// Maps and planners by name: any design flies with any of them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/geometry/vector.hpp"
#include "core/memory/arena.hpp"
#include "core/sensor_rig.hpp"
#include "core/vehicle_model.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/planning/planner.hpp"

namespace roborun::board {

/// Which map and planner: "own" or "octomap", "own" or "ompl:NAME".
struct BackendNames {
  std::string map{"own"};
  std::string planner{"own"};
  friend bool operator==(const BackendNames&, const BackendNames&) = default;
};

/// What the map must be able to take.
struct ImageLimits {
  std::uint16_t width{}, height{};  ///< Pixels of the largest image, clouds' images included.
  double range_m{};                 ///< The farthest that a sensor sees.
  std::size_t frames{6};            ///< Most images of one scan.
  /// So many images of cameras see all around; 0: there are not enough of them. (BrickMap::Config)
  std::size_t all_around_frames{6};
  double vehicle_radius_m{VehicleModel{}.radius_m};  ///< Where the vehicle is, nothing else is.
};
[[nodiscard]] ImageLimits image_limits(const SensorRig& rig, const VehicleModel& vehicle) noexcept;

struct MapAndPlanner {
  std::unique_ptr<stages::OccupancyMap> map;
  std::unique_ptr<stages::Planner> planner;
};

/// Bytes that the own backends take from the arena.
[[nodiscard]] std::size_t backend_bytes(const Aabb& map_bounds_W, const ImageLimits& images);
/// Throws InputError for unknown names, and for a world that the map cannot hold.
[[nodiscard]] MapAndPlanner make_backends(const BackendNames& names, const Aabb& map_bounds_W,
                                          const ImageLimits& images, core::Arena& arena);

}  // namespace roborun::board
