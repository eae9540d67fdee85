/// Everything that a flight depends on besides its devices, its map and its planner.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/executive/cost_profile.hpp"
#include "core/executive/frame_table.hpp"
#include "core/geometry/fence.hpp"
#include "core/geometry/vector.hpp"
#include "core/precision.hpp"
#include "core/sensor_rig.hpp"
#include "core/vehicle_model.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"
#include "governor/policy/governor.hpp"

namespace roborun::flight {

/// For vehicles that do not see all around: the yaw follows where they will fly.
struct GazeConfig {
  bool follows{false};         ///< False: the yaw of the take-off is kept.
  double yaw_rate_radps{3.0};  ///< (0, 3]. The vehicle turns no faster than its own.
  double stuck_s{3.0};         ///< Hovering for so long without a new trajectory: it looks round.
  double lead_s{0.7};          ///< Looks where the trajectory goes so much later.
};

/// Read once, before the lanes start.
struct FlightConfig {
  VehicleModel vehicle{};
  Aabb bounds_W{};                   ///< The vehicle's centre stays inside, once it is in the air.
  Vector3 goal_W = Vector3::Zero();  ///< Inside bounds_W and the fence.
  double cruise_m{};                 ///< Height of the first hover, world frame.
  core::Fence fence{};               ///< What it forbids is occupied for planner and smoother.
  double camera_range_m{25.0};       ///< Of the cameras that the plans rely on. (1, 200]
  bool sees_all_around{true};  ///< The cameras together, a sky too; false: what is not seen may be anything.
  double level_view_ratio{1.0};  ///< Tangent of the elevation, up and down, that one turn sees.
  double too_near_m{};  ///< Half of the cube around the vehicle that may be too near for its sensors.
  /// Of the coarsest camera (without any: of the images of a cloud), per unit of the tangent; 0: no sensor. [0, 1e4]
  double pixels_per_tan{};
  GazeConfig gaze{};
  std::array<DepthError, kMostCameras>
      depth_error{};  ///< Of each camera: the map keeps this away from what it saw.
  /// Pixels a side of the images that each LiDAR's cloud becomes; 0: there is no such LiDAR.
  std::array<std::uint16_t, kMostLidars> cloud_pixels{};
  governor::Design design{governor::Design::kAware};
  governor::Aim aim{governor::Aim::kTime};  ///< Of the design aware: the static ones have their speed.
  core::CostProfile costs{};  ///< What the stages without knobs cost: their constant is planned for.
  governor::KnobArray<governor::LatencyModel> model{};  ///< Map, export, planner.
  std::uint64_t seed{1};                                ///< Of the planner's random numbers.
  Nanos minor_frame{core::kMinorFrame};                 ///< core::minor_frame_of() a legal rate.
  /// Without commands it stops straight on, wherever its path leads: an autopilot does. Curves are flown so slowly that this is
  /// free, too.
  bool stops_straight{false};
  bool answers{true};  ///< False: the failsafe sees and records, and does nothing. For tests alone.
  [[nodiscard]] Status validate() const noexcept;
};

/// The vehicle's own of the design aware; the static ones fly at the published precision.
[[nodiscard]] PrecisionLattice lattice_of(const FlightConfig& config) noexcept;
/// What the map has to hold: the flight's bounds and a margin in which surfaces are of interest.
[[nodiscard]] Aabb map_bounds_W(const FlightConfig& config) noexcept;
/// What a rig says of a flight: range, what is seen, the size of clouds.
void describe_sensors(const SensorRig& rig, FlightConfig& config) noexcept;

/// Half the sides of the box around the top of the climb that counts as free although no sensor has seen it: what a
/// vehicle needs to begin whose sensors leave gaps, or measure nothing nearby. Zero where they see all around from 0 m on.
/// Whoever starts it sees to it that this much space is free there. The rest as of FlightConfig.
[[nodiscard]] Vector3 assumed_free_half_m(const VehicleModel& vehicle, bool sees_all_around,
                                          double level_view_ratio, double too_near_m) noexcept;

}  // namespace roborun::flight
