#include "platform/mission/mission_config.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/energy_model.hpp"
#include "platform/flight/failsafe_monitor.hpp"
#include "platform/input/input_error.hpp"
#include "platform/sitl/sensors/lidar.hpp"

namespace roborun::mission {

governor::Design design_of(const char* option, const std::string& name) {
  for (const auto design :
       {governor::Design::kAware, governor::Design::kStatic, governor::Design::kStaticFair}) {
    if (name == governor::to_string(design)) return design;
  }
  throw InputError(fmt::format(
      "{}: unknown design '{}': must be aware, static, static-fair, or several with commas between", option,
      name));
}

std::optional<governor::Aim> aim_named(const std::string& name) {
  for (const auto aim : {governor::Aim::kTime, governor::Aim::kEnergy})
    if (name == governor::to_string(aim)) return aim;
  return std::nullopt;
}

governor::Aim aim_of(const char* option, const std::string& name) {
  const auto aim = aim_named(name);
  if (!aim) throw InputError(fmt::format("{}: unknown aim '{}': must be time or energy", option, name));
  return *aim;
}

flight::FlightConfig flight_config_in(const FlightSpace& space, const MissionConfig& config) {
  flight::FlightConfig flight = config.flight;
  flight.bounds_W = space.bounds_W;
  flight.goal_W = space.goal_W;
  flight.cruise_m = space.cruise_m;
  const SensorRig rig = sitl::rig_of(config.simulator);
  if (const VehicleKey* key = out_of_bounds(flight.vehicle))
    throw InputError(fmt::format("vehicle: {}.{}: {} must be from {} to {}", key->table, key->key,
                                 flight.vehicle.*key->value, key->low, key->high));
  if (const auto fault = first_fault(rig))
    throw InputError(fmt::format("{} {}: {}: must be from {} to {}: {}", fault->sensor, fault->index + 1,
                                 fault->key, fault->low, fault->high, fault->text));
  describe_sensors(rig, flight);
  const sitl::DepthNoise& noise = config.simulator.camera;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    if (rig.cameras[i].model == CameraModel::kClean)
      flight.depth_error[i] = {noise.noise_m, noise.noise_per_m};
  flight.stops_straight = config.autopilot.has_value();
  if (config.autopilot)
    flight.vehicle = as_flown_by(flight.vehicle, companion_config(*config.autopilot, flight.vehicle).planned);
  flight.seed = config.seed;
  const PrecisionLattice lattice = lattice_of(flight);
  flight.costs = core::on_lattice(flight.costs, lattice);
  if (lattice.finest_m != kPublishedCell_m) {
    for (governor::LatencyModel& model : flight.model)
      model = {core::on_lattice(model.fixed_s, lattice), core::on_lattice(model.slope_s_per_m3, lattice)};
  }
  return flight;
}

flight::FlightConfig flight_config_of(const sitl::World& world, const MissionConfig& config) {
  flight::FlightConfig flight =
      flight_config_in({world.bounds_W(), config.route ? config.route->first_W() : world.goal_W(),
                        config.route ? config.route->cruise_m : world.start_W().z()},
                       config);
  if (const std::string why = sitl::why_no_room(world, flight.vehicle.radius_m); !why.empty())
    throw InputError(why);
  return flight;
}

void set_vehicle(MissionConfig& config, const vehicle::Vehicle& vehicle) {
  config.flight.vehicle = vehicle.model;
  config.simulator.rig = vehicle.rig;
  config.simulator.sensors.imu = vehicle.rig.imu;
  config.simulator.sensors.gnss = vehicle.rig.gnss;
  config.simulator.sensors.odometry = vehicle.rig.odometry;
  config.simulator.lidar_patterns.clear();
  for (std::size_t i = 0; i < vehicle.rig.lidars.size(); ++i) {
    auto& pattern = config.simulator.lidar_patterns.emplace_back();
    if (i >= vehicle.patterns.size() || vehicle.patterns[i].empty()) continue;
    pattern = sitl::load_lidar_pattern(vehicle.patterns[i]);
    config.simulator.rig->lidars[i] = sitl::spec_of(pattern, vehicle.rig.lidars[i]);
  }
}

std::vector<std::string> beyond_reach(const sitl::World& world, const MissionConfig& config) {
  const VehicleModel& vehicle = config.flight.vehicle;
  const auto* const low =
      std::find_if(flight::kFailsafeThresholds.begin(), flight::kFailsafeThresholds.end(),
                   [](const auto& row) { return row.condition == governor::Condition::kBatteryLow; });
  const double usable_J = low->limit * vehicle.battery_J;
  std::vector<Vector3> goals_W{world.goal_W()};
  if (config.route) {
    goals_W.clear();
    for (const RouteStep& step : config.route->steps)
      if (step.goal_W) goals_W.push_back(*step.goal_W);
  }
  for (const GivenGoals& given : config.goals)
    if (given.at_s == 0.0) goals_W = given.goals_W;
  std::vector<std::string> lines;
  double way_m = 0.0;
  Vector3 last_W = world.start_W();
  for (const Vector3& goal_W : goals_W) {
    way_m += (goal_W - last_W).norm();
    last_W = goal_W;
    const double needed_J = way_m / vehicle.speed_mps * hover_power_W(vehicle);
    if (needed_J > usable_J)
      lines.push_back(
          fmt::format("goal ({:.2f}, {:.2f}, {:.2f}): beyond the battery's reach: {:.0f} m take {:.0f} kJ at "
                      "least, and the failsafe turns back after {:.0f} kJ",
                      goal_W.x(), goal_W.y(), goal_W.z(), way_m, 1e-3 * needed_J, 1e-3 * usable_J));
  }
  return lines;
}

Vector3 ground_below(const sitl::World& world) {
  const Vector3& start_W = world.start_W();
  return {start_W.x(), start_W.y(), world.ground_below_m(start_W)};
}

board::ImageLimits image_limits(const MissionConfig& config) {
  return board::image_limits(sitl::rig_of(config.simulator), config.flight.vehicle,
                             flight::lattice_of(config.flight));
}

}  // namespace roborun::mission
