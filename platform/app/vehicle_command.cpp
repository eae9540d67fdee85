#include "platform/app/vehicle_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/energy_model.hpp"
#include "core/geometry/math.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/board/backends.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/mission/speed_limits.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::app {
namespace {

struct VehicleOptions {
  std::string file;
  bool json{false};
};

/// What follows from a vehicle.
struct Consequences {
  double thrust_to_weight_ratio{}, hover_ratio{}, tilt_mps2{};
  std::array<std::array<double, 2>, 4> stop{};  ///< Speed, distance.
  double range_m{};                             ///< Of its sensors, the shortest.
  double blind_deg{};                           ///< Widest angle to the nearest direction that is seen.
  mission::SpeedLimits speed;
  double cheapest_mps{};
  EnergyPerMetre least, at_top;              ///< At cheapest_mps, and at limits.speed_mps.
  Vector3 assumed_half_m = Vector3::Zero();  ///< flight::assumed_free_half_m().
  double gap_m{};                            ///< The narrowest that plans go through, slowly.
  double thin_m{};                           ///< As far away limits.thinnest_m is a pixel wide; 0: not known.
  std::size_t bytes{};                       ///< In a world of 100 x 100 x 10 m.
};

Consequences consequences_of(const vehicle::Vehicle& vehicle) {
  const VehicleModel& v = vehicle.model;
  mission::MissionConfig config;
  mission::set_vehicle(config, vehicle);
  config.flight.bounds_W = {{0.0, 0.0, 0.0}, {100.0, 100.0, 10.0}};
  Consequences c;
  c.thrust_to_weight_ratio = thrust_to_weight_ratio(v);
  c.hover_ratio = 1.0 / c.thrust_to_weight_ratio;
  c.tilt_mps2 = tilt_acceleration_mps2(v);
  const StoppingModel stop = stopping_model(v);
  for (std::size_t i = 0; i < c.stop.size(); ++i) {
    const double speed_mps = v.speed_mps * static_cast<double>(i + 1) / static_cast<double>(c.stop.size());
    c.stop[i] = {speed_mps, stop.distance_m(speed_mps)};
  }
  const board::ImageLimits images = image_limits(config);
  const SensorRig rig = sitl::rig_of(config.simulator);
  describe_sensors(rig, config.flight);
  c.range_m = config.flight.camera_range_m;
  c.blind_deg = widest_blind_angle_rad(rig) * 180.0 / core::kPi;
  c.assumed_half_m = flight::assumed_free_half_m(v, config.flight.sees_all_around,
                                                 config.flight.level_view_ratio, config.flight.too_near_m);
  c.speed = mission::speed_limits(config.flight);
  c.cheapest_mps = cheapest_speed_mps(v);
  c.least = energy_per_metre(v, c.cheapest_mps);
  c.at_top = energy_per_metre(v, v.speed_mps);
  c.gap_m = 2.0 * slow_radius_m(v);
  c.thin_m = v.thinnest_m * config.flight.pixels_per_tan;
  c.bytes = flight::FlightSystem::arena_bytes(config.flight) +
            board::backend_bytes(map_bounds_W(config.flight), images) + sizeof(flight::FlightSystem);
  return c;
}

/// Names of the models of its sensors, each once, in their order.
std::vector<std::string> models_of(const SensorRig& rig) {
  std::vector<std::string> names;
  const auto add = [&names](const char* kind, auto model) {
    std::string name = fmt::format("{} {}", kind, to_string(model));
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(std::move(name));
  };
  for (const CameraSpec& camera : rig.cameras) add("camera", camera.model);
  for (const LidarSpec& lidar : rig.lidars) add("lidar", lidar.model);
  add("imu", rig.imu);
  add("gnss", rig.gnss);
  if (rig.odometry != OdometryModel::kNone) add("odometry", rig.odometry);
  return names;
}

/// What it cannot do, one line each.
std::vector<std::string> shortcomings_of(const vehicle::Vehicle& vehicle, const Consequences& c) {
  std::vector<std::string> lines;
  const VehicleModel& v = vehicle.model;
  const mission::SpeedLimit& lowest = c.speed.lowest();
  if (lowest.speed_mps < v.speed_mps)
    lines.push_back(fmt::format("cannot use its {:.1f} m/s: {} allows {:.1f} m/s", v.speed_mps, lowest.name,
                                lowest.speed_mps));
  if (c.thrust_to_weight_ratio < 1.6)
    lines.push_back(
        fmt::format("has little thrust for wind: thrust-to-weight {:.2f}", c.thrust_to_weight_ratio));
  if (!c.assumed_half_m.isZero(0.0))
    lines.push_back(fmt::format(
        "cannot see all around, or not nearby: take off where {:.1f} m to all sides and {:.1f} m above and "
        "below the top of the climb are "
        "free",
        c.assumed_half_m.x(), c.assumed_half_m.z()));
  lines.push_back(fmt::format("cannot pass gaps narrower than {:.2f} m", c.gap_m));
  if (c.thin_m > 0.0 && c.thin_m < c.stop.back()[1])
    lines.push_back(
        fmt::format("may fly into the first pole or wire of {:.0f} mm that it meets: it surely sees it from "
                    "{:.2f} m, and stops within {:.2f} m",
                    1000.0 * v.thinnest_m, c.thin_m, c.stop.back()[1]));
  return lines;
}

nlohmann::ordered_json json_of(const std::vector<mission::SpeedLimit>& limits) {
  nlohmann::ordered_json array = nlohmann::ordered_json::array();
  for (const mission::SpeedLimit& limit : limits)  // infinity, without drag, is null in JSON
    array.push_back({{"name", limit.name}, {"speed_mps", limit.speed_mps}, {"why", limit.why}});
  return array;
}

void print_speeds(const mission::SpeedLimits& speed) {
  const mission::SpeedLimit& lowest = speed.lowest();
  fmt::print("\nin the open            m/s  set by\n");
  for (const mission::SpeedLimit& limit : speed.always)
    fmt::print("  {:<18}{:>6.1f}  {}{}\n", limit.name, limit.speed_mps, limit.why,
               &limit == &lowest ? "   <- limits it" : "");
  fmt::print("lower where\n");
  for (const mission::SpeedLimit& limit : speed.where)
    fmt::print("  {:<18}{:>6.1f}  {}\n", limit.name, limit.speed_mps, limit.why);
}

nlohmann::ordered_json json_of(double speed_mps, const EnergyPerMetre& energy) {
  return {
      {"speed_mps", speed_mps}, {"flight_Jpm", energy.flight_Jpm}, {"computing_Jpm", energy.computing_Jpm}};
}

void print_energy(double top_mps, const Consequences& c) {
  const auto line = [](double speed_mps, const EnergyPerMetre& e, const char* text) {
    fmt::print("  {:>6.1f} {:>8.1f} {:>11.1f} {:>7.1f}  {}\n", speed_mps, e.flight_Jpm, e.computing_Jpm,
               e.total_Jpm(), text);
  };
  fmt::print("\nJ/m in still air\n  {:>6} {:>8} {:>11} {:>7}\n", "at m/s", "flight", "computing", "both");
  line(c.cheapest_mps, c.least,
       c.cheapest_mps < top_mps ? "the least: --aim energy flies no faster"
                                : "the least: --aim energy changes nothing, it never flies faster");
  line(top_mps, c.at_top, "limits.speed_mps");
}

int check(const VehicleOptions& options) {
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(options.file);
  const Consequences c = consequences_of(vehicle);
  const std::vector<std::string> cannot = shortcomings_of(vehicle, c);
  if (options.json) {
    nlohmann::ordered_json j = {{"name", vehicle.name},
                                {"about", vehicle.about},
                                {"thrust_to_weight_ratio", c.thrust_to_weight_ratio},
                                {"hover_throttle_ratio", c.hover_ratio},
                                {"tilt_acceleration_mps2", c.tilt_mps2},
                                {"stopping", nlohmann::ordered_json::array()},
                                {"sensor_models", models_of(vehicle.rig)},
                                {"range_m", c.range_m},
                                {"blind_deg", c.blind_deg},
                                {"speed_mps", c.speed.lowest().speed_mps},
                                {"speed_limited_by", c.speed.lowest().name},
                                {"speed_limits", json_of(c.speed.always)},
                                {"speed_where", json_of(c.speed.where)},
                                {"least_energy", json_of(c.cheapest_mps, c.least)},
                                {"top_speed_energy", json_of(vehicle.model.speed_mps, c.at_top)},
                                {"narrowest_gap_m", c.gap_m},
                                {"bytes", c.bytes},
                                {"cannot", cannot}};
    for (const auto& [speed_mps, distance_m] : c.stop)
      j["stopping"].push_back({{"speed_mps", speed_mps}, {"distance_m", distance_m}});
    fmt::print("{}\n", j.dump());
    return kDone;
  }
  fmt::print("{}: {}\n\n", vehicle.name, vehicle.about);
  fmt::print("thrust to weight     {:.2f}, hovers at {:.0f} % of full throttle\n", c.thrust_to_weight_ratio,
             100.0 * c.hover_ratio);
  fmt::print("sideways             {:.1f} m/s2 at its tilt limit of {:.0f} degrees\n", c.tilt_mps2,
             vehicle.model.tilt_rad * 180.0 / core::kPi);
  fmt::print("stops within        ");
  for (const auto& [speed_mps, distance_m] : c.stop)
    fmt::print(" {:.2f} m from {:.1f} m/s{}", distance_m, speed_mps,
               speed_mps < vehicle.model.speed_mps ? "," : "\n");
  fmt::print("sees                 {:.0f} m\n", c.range_m);
  fmt::print("simulated with       {}\n", fmt::join(models_of(vehicle.rig), ", "));
  fmt::print("widest blind angle   {:.0f} degrees\n", c.blind_deg);
  fmt::print("memory               {:.1f} MiB in a world of 100 x 100 x 10 m\n",
             static_cast<double>(c.bytes) / 1048576.0);
  for (const std::string& line : cannot) fmt::print("it                   {}\n", line);
  print_speeds(c.speed);
  print_energy(vehicle.model.speed_mps, c);
  return kDone;
}

int list(const VehicleOptions& options) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const std::string& name : vehicle::shipped_vehicles()) {
    const vehicle::Vehicle v = vehicle::load_vehicle(name);
    if (options.json)
      all.push_back({{"name", v.name}, {"about", v.about}});
    else
      fmt::print("{:<8} {}\n", v.name, v.about);
  }
  if (options.json) fmt::print("{}\n", all.dump());
  return kDone;
}

}  // namespace

void add_vehicle_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<VehicleOptions>();
  CLI::App* command =
      app.add_subcommand("vehicle", "Vehicles: which ship, and what follows from a vehicle file");
  command->footer(
      "Examples:\n"
      "  roborun vehicle list\n"
      "  roborun vehicle check x500\n"
      "  roborun vehicle check mine.toml        a copy of platform/vehicle/x500.toml with your numbers\n"
      "  roborun fly --vehicle mine.toml\n\n"
      "check ends with the speed that the vehicle can be flown at in the open, by what limits it:\n"
      "  file   limits.speed_mps\n"
      "  sight  a stop within the range of its sensors, with the decisions of the flight\n"
      "  drag   level flight at tilt_rad\n"
      "and with what the flight lowers it to among thin things, beside what moves and near the goal. All but "
      "sight, a bound\n"
      "beside the flight, are the flight's own numbers. A plan may be slower still: around obstacles, and "
      "into "
      "what is not seen yet.\n"
      "Last, what a metre costs at the speed that spends least (fly --aim energy), and at "
      "limits.speed_mps.\n\n"
      "All keys with unit, range and meaning: roborun config. Exit code: 0, or 2: the file is wrong, or its "
      "vehicle cannot fly.");
  command->require_subcommand(1);
  CLI::App* list_app = command->add_subcommand("list", "The vehicles that ship, paper first");
  list_app->add_flag("--json", options->json, "One JSON array on standard output, nothing else");
  list_app->callback([options, &run] { run = [options] { return list(*options); }; });
  CLI::App* check_app = command->add_subcommand("check",
                                                "Stopping distances, thrust, what it sees, memory, what it "
                                                "cannot do, how fast it can fly and what limits that");
  check_app->add_option("FILE", options->file, "A vehicle file, or the name of a shipped vehicle")
      ->required();
  check_app->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  check_app->callback([options, &run] { run = [options] { return check(*options); }; });
}

}  // namespace roborun::app
