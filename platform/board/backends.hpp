/// Maps, planners and memories of ways by name, or of the reader's own: any design flies with any of them.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/geometry/vector.hpp"
#include "core/memory/arena.hpp"
#include "core/sensor_rig.hpp"
#include "core/vehicle_model.hpp"
#include "governor/policy/decision_policy.hpp"
#include "platform/board/part_request.hpp"
#include "platform/flight/flight_config.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/planning/planner.hpp"
#include "stages/planning/ways.hpp"

namespace roborun::board {

/// Which map, planner and memory of ways: "own" or "octomap", "own" or "ompl:NAME", "own", or "plugin:FILE.so" (plugin.hpp).
struct BackendNames {
  std::string map{"own"};
  std::string planner{"own"};
  std::string ways{"own"};
  friend bool operator==(const BackendNames&, const BackendNames&) = default;
};

/// Parts that the reader's own program makes, once per flight. Empty: by name, and the governor that ships.
struct OwnParts {
  std::function<std::unique_ptr<stages::OccupancyMap>(const PartRequest&)> map{};
  std::function<std::unique_ptr<stages::Planner>(const PartRequest&)> planner{};
  std::function<std::unique_ptr<governor::DecisionPolicy>(const flight::FlightConfig&)> policy{};
  std::function<std::unique_ptr<stages::Ways>(const PartRequest&)> ways{};
  [[nodiscard]] bool empty() const noexcept { return !map && !planner && !policy && !ways; }
};
/// Of what this rig delivers.
[[nodiscard]] ImageLimits image_limits(const SensorRig& rig, const VehicleModel& vehicle,
                                       const PrecisionLattice& lattice) noexcept;

[[nodiscard]] bool uses_plugin(const BackendNames& names) noexcept;

struct Backends {
  std::unique_ptr<stages::OccupancyMap> map;
  std::unique_ptr<stages::Planner> planner;
  std::unique_ptr<stages::Ways> ways;  ///< Null: those that FlightSystem has.
};

/// Bytes that the own backends take from the arena.
[[nodiscard]] std::size_t backend_bytes(const Aabb& map_bounds_W, const ImageLimits& images);
/// Those of `own` where it has some, the others by name. Throws InputError for unknown names,
/// for a plugin that is none or another program's, and for a world that the map cannot hold.
[[nodiscard]] Backends make_backends(const BackendNames& names, const PartRequest& request,
                                     core::Arena& arena, const OwnParts& own = {});

}  // namespace roborun::board
