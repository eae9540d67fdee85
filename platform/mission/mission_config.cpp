#include "platform/mission/mission_config.hpp"

#include <fmt/format.h>

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

flight::FlightConfig flight_config_of(const sitl::World& world, const MissionConfig& config) {
  flight::FlightConfig flight = config.flight;
  flight.bounds_W = world.bounds_W();
  flight.goal_W = world.goal_W();
  flight.cruise_m = world.start_W().z();
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
  if (const std::string why = sitl::why_no_room(world, flight.vehicle.radius_m); !why.empty())
    throw InputError(why);
  flight.seed = config.seed;
  const PrecisionLattice lattice = lattice_of(flight);
  flight.costs = core::on_lattice(flight.costs, lattice);
  if (lattice.finest_m != kPublishedCell_m) {
    for (governor::LatencyModel& model : flight.model)
      model = {core::on_lattice(model.fixed_s, lattice), core::on_lattice(model.slope_s_per_m3, lattice)};
  }
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

Vector3 ground_below(const sitl::World& world) {
  const Vector3& start_W = world.start_W();
  return {start_W.x(), start_W.y(), world.ground_below_m(start_W)};
}

board::ImageLimits image_limits(const MissionConfig& config) {
  return board::image_limits(sitl::rig_of(config.simulator), config.flight.vehicle,
                             flight::lattice_of(config.flight));
}

}  // namespace roborun::mission
