/// Everything that a flight depends on besides its devices, its map and its planner.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/executive/cost_profile.hpp"
#include "core/executive/frame_table.hpp"
#include "core/geometry/fence.hpp"
#include "core/geometry/vector.hpp"
#include "core/vehicle_model.hpp"
#include "firmware_if/time.hpp"
#include "governor/policy/governor.hpp"

namespace roborun::flight {

/// More cameras than that no vehicle has.
inline constexpr std::size_t kMostCameras = 8;

/// Read once, before the lanes start.
struct FlightConfig {
  VehicleModel vehicle{};
  Aabb bounds_W{};                   ///< The vehicle's centre stays inside, once it is in the air.
  Vector3 goal_W = Vector3::Zero();  ///< Inside bounds_W and the fence.
  double cruise_m{};                 ///< Height of the first hover, world frame.
  core::Fence fence{};               ///< What it forbids is occupied for planner and smoother.
  double camera_range_m{25.0};       ///< Of the cameras that the plans rely on. (1, 200]
  governor::Design design{governor::Design::kAware};
  core::CostProfile costs{};  ///< What the stages without knobs cost: their constant is planned for.
  governor::KnobArray<governor::LatencyModel> model{};  ///< Map, export, planner.
  std::uint64_t seed{1};                                ///< Of the planner's random numbers.
  Nanos minor_frame{core::kMinorFrame};                 ///< core::minor_frame_of() a legal rate.
  bool answers{true};  ///< False: the failsafe sees and records, and does nothing. For tests alone.
};

/// What the map has to hold: the flight's bounds and a margin in which surfaces are of interest.
[[nodiscard]] Aabb map_bounds_W(const FlightConfig& config) noexcept;

}  // namespace roborun::flight
