#include "platform/flight/flight_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/energy_model.hpp"
#include "core/range.hpp"
#include "firmware_if/assert.hpp"

namespace roborun::flight {
namespace {

constexpr double kMapMargin_m = 3.0;
/// A pole of w metres at a distance of d is met by the part w f / d of all images (f: pixels per unit of the tangent). Flown straight
/// at with an image every s metres, from d1 to d2 it is expected to be met (w f / s) ln(d1 / d2) times. With s = w f / 4 that is
/// 6.4 times from five stopping distances to one, and it is missed once in 600 times.
constexpr double kThinLooks = 4.0;

PipelineConfig pipeline_config(const FlightConfig& config) noexcept {
  PipelineConfig pipeline;
  pipeline.flight_bounds_W = config.bounds_W;
  pipeline.vehicle = config.vehicle;
  // The published designs know one room.
  if (config.design != governor::Design::kAware) pipeline.vehicle.slow_error_m = 0.0;
  pipeline.map_bounds_W = map_bounds_W(config);
  pipeline.level_view_ratio = config.level_view_ratio;
  pipeline.sees_all_around = config.sees_all_around;
  pipeline.turns = config.gaze.follows;
  pipeline.too_near_m = config.too_near_m;
  pipeline.horizon_m = config.camera_range_m - 1.0;
  pipeline.fence = config.fence;
  pipeline.lattice = lattice_of(config);
  pipeline.minor_frame = config.minor_frame;
  pipeline.stops_straight = config.stops_straight;
  return pipeline;
}

stages::WayMemory::Config way_config(const FlightConfig& config) noexcept {
  using stages::WayMemory;
  WayMemory::Config ways{config.bounds_W, slow_radius_m(config.vehicle), lattice_of(config).finest_m,
                         config.fence, config.vehicle.radius_m};
  // A large world in larger cells, for its surfaces would take more blocks than there are; a wide vehicle, too.
  constexpr double kPositionsPerBlock = 8.0;
  const bool is_large =
      WayMemory::positions(ways) > kPositionsPerBlock * static_cast<double>(ways.max_blocks);
  const bool is_wide = WayMemory::cells_across(ways) > WayMemory::kMostAcross;
  if ((is_large && ways.finest_m < kPublishedCell_m) || is_wide) ways.finest_m *= 2.0;
  return ways;
}

bool remembers_ways(const FlightConfig& config) noexcept {
  return knows_ways(config.design) && stages::WayMemory::fits(way_config(config));
}

std::optional<stages::WayMemory> ways_of(const FlightConfig& config, core::Arena& arena) noexcept {
  if (!remembers_ways(config)) return std::nullopt;
  return std::optional<stages::WayMemory>(std::in_place, way_config(config), arena);
}

/// No faster than the vehicle turns.
GazeConfig gaze_of(const FlightConfig& config) noexcept {
  GazeConfig gaze = config.gaze;
  gaze.yaw_rate_radps = std::min(gaze.yaw_rate_radps, config.vehicle.yaw_rate_radps);
  return gaze;
}

}  // namespace

Status FlightConfig::validate() const noexcept {
  const std::int64_t frame_ns = minor_frame.count();
  const bool rate_ok = frame_ns > 0 && core::is_flight_rate(static_cast<int>(1'000'000'000 / frame_ns));
  const bool space_ok = is_finite(bounds_W.min_W) && is_finite(bounds_W.max_W) &&
                        bounds_W.size().minCoeff() > 0.0 && is_finite(goal_W) && std::isfinite(cruise_m);
  const bool sensors_ok = core::above(camera_range_m, 1.0, 200.0) &&
                          core::above(level_view_ratio, 0.0, 100.0) && core::within(too_near_m, 0.0, 100.0) &&
                          core::within(pixels_per_tan, 0.0, 1e4) &&
                          core::above(gaze.yaw_rate_radps, 0.0, 3.0) &&
                          core::above(gaze.stuck_s, 0.0, 1000.0) && core::within(gaze.lead_s, 0.0, 10.0);
  const bool ok = out_of_bounds(vehicle) == nullptr && rate_ok && space_ok && sensors_ok &&
                  costs.validate() == Status::kOk;
  return ok ? Status::kOk : Status::kInvalidArgument;
}

governor::GovernorConfig governor_config(const FlightConfig& config) noexcept {
  const auto cost_of = [&config](core::StageId id) { return seconds(config.costs.cost(id, {})); };
  governor::GovernorConfig g;
  g.design = config.design;
  g.model = config.model;
  g.point_cloud_s = cost_of(core::StageId::kPointCloud);
  g.governor_s = config.design == governor::Design::kAware ? cost_of(core::StageId::kGovernor) : 0.0;
  g.smoother_s = cost_of(core::StageId::kSmoother);
  g.v_max_mps = config.vehicle.speed_mps;
  if (config.aim == governor::Aim::kEnergy) g.cheapest_mps = cheapest_speed_mps(config.vehicle);
  g.vehicle_width_m = 2.0 * config.vehicle.radius_m;
  g.stopping = stopping_model(config.vehicle);
  const double range_m = config.camera_range_m;
  const double height_m = map_bounds_W(config).size().z();
  g.sensor_volume_max_m3 = 4.0 * range_m * range_m * std::min(height_m, 2.0 * range_m);
  g.lattice = lattice_of(config);
  if (config.pixels_per_tan > 0.0)
    g.thin_step_m = config.vehicle.thinnest_m * config.pixels_per_tan / kThinLooks;
  g.coarsest_level = lattice_of(config).coarsest_level_within(config.bounds_W.size().z() / 3.0);
  g.minor_frame = config.minor_frame;
  return g;
}

PrecisionLattice lattice_of(const FlightConfig& config) noexcept {
  const bool aware = config.design == governor::Design::kAware;
  // The memory of ways takes cells of twice the finest at most.
  const double least_m = slow_radius_m(config.vehicle) / stages::WayMemory::kMostAcross;
  return aware ? PrecisionLattice{std::max(config.vehicle.finest_cell_m, least_m)} : PrecisionLattice{};
}

Aabb map_bounds_W(const FlightConfig& config) noexcept {
  const Vector3 margin = Vector3::Constant(kMapMargin_m);
  return {config.bounds_W.min_W - margin, config.bounds_W.max_W + margin};
}

void describe_sensors(const SensorRig& rig, FlightConfig& config) noexcept {
  config.camera_range_m = shortest_range_m(rig);
  config.sees_all_around = cameras_see_all_around(rig);
  config.level_view_ratio = level_view_ratio(rig);
  config.too_near_m = too_near_m(rig);
  config.gaze.follows = !sees_horizon(rig);
  double least = std::numeric_limits<double>::infinity();
  for (const CameraSpec& camera : rig.cameras)
    least = std::min(
        {least, 0.5 * camera.width / camera.tan_half_width, 0.5 * camera.height / camera.tan_half_height});
  if (rig.cameras.empty())
    for (const LidarSpec& lidar : rig.lidars) least = std::min(least, 0.5 * cloud_pixels(lidar));
  config.pixels_per_tan = std::isfinite(least) ? least : 0.0;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    config.depth_error[i] = depth_error(rig.cameras[i].model);
    // Of the sky above nothing is known that the level cameras have not seen.
    config.sees_all_around = config.sees_all_around && !config.depth_error[i].dark_sky;
  }
  config.cloud_pixels = {};
  for (std::size_t i = 0; i < rig.lidars.size(); ++i) config.cloud_pixels[i] = cloud_pixels(rig.lidars[i]);
}

std::size_t FlightSystem::arena_bytes(const FlightConfig& config) noexcept {
  std::size_t bytes = stages::PointCloud::arena_bytes({});
  for (const std::uint16_t pixels : config.cloud_pixels)
    if (pixels > 0) bytes += stages::CloudImages::arena_bytes({pixels});
  if (remembers_ways(config)) bytes += stages::WayMemory::arena_bytes(way_config(config));
  return bytes;
}

FlightSystem::FlightSystem(const FlightConfig& config, core::StageMeter& meter, Aircraft& aircraft,
                           std::span<firmware_if::DepthCamera* const> cameras, const FlightParts& parts,
                           core::Arena& arena, std::span<firmware_if::Lidar* const> lidars) noexcept
    : map_((ROBORUN_ASSERT(config.validate() == Status::kOk), parts.map)),
      cloud_({.lattice = lattice_of(config)}, arena),
      ways_(ways_of(config, arena)),
      governor_(governor_config(config)),
      policy_(parts.policy != nullptr ? *parts.policy : governor_),
      pipeline_(pipeline_config(config), meter, policy_, cloud_, parts.map, parts.planner, smoother_,
                parts.ways != nullptr ? parts.ways
                : ways_               ? &*ways_
                                      : nullptr),
      control_(config.vehicle, seconds(config.minor_frame), gaze_of(config)),
      flight_program_(
          {config.vehicle, config.fence, config.answers}, control_, aircraft, mail_,
          {{slow_radius_m(config.vehicle), braking_mps2(config.vehicle), config.depth_error}, parts.watched}),
      decision_program_(
          {config.goal_W, config.seed, config.fence, config.bounds_W, config.minor_frame, config.depth_error},
          pipeline_, cameras, mail_, lidars, config.cloud_pixels, arena) {
  control_.set_cruise_height(config.cruise_m);
}

}  // namespace roborun::flight
