#include "platform/app/flight_source.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/mission/replay.hpp"
#include "platform/mission/scenario_file.hpp"
#include "platform/mission/settings_file.hpp"
#include "platform/mission/what_if.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::app {
namespace {

using Json = nlohmann::ordered_json;

/// Names that are no files (of shipped vehicles) stay.
std::string absolute(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) ? std::filesystem::absolute(path).string() : path;
}

std::string to_json(const FlightSource& source) {
  Json j;
  if (source.world.empty()) {
    j["env"] = source.env;
    j["mission"] = source.mission;
  } else {
    j["world"] = absolute(source.world);
    j["start"] = source.in_file.start;
    j["goals"] = source.in_file.goals;
    j["bounds"] = source.in_file.bounds;
    j["ground"] = source.in_file.ground;
    j["cell"] = source.in_file.cell;
    j["scale"] = source.in_file.scale;
    j["surfaces"] = source.in_file.surfaces;
  }
  j["vehicle"] = absolute(source.vehicle);
  j["settings"] = absolute(source.settings);
  if (!source.aim.empty()) j["aim"] = source.aim;
  j["profile"] = absolute(source.profile);
  return j.dump(-1, ' ', false, Json::error_handler_t::replace);
}

FlightSource source_from(const Json& j) {
  FlightSource source;
  if (j.contains("world")) {
    source.world = j.at("world").get<std::string>();
    source.in_file.start = j.at("start").get<std::string>();
    source.in_file.goals = j.at("goals").get<std::vector<std::string>>();
    source.in_file.bounds = j.at("bounds").get<std::string>();
    source.in_file.ground = j.at("ground").get<std::string>();
    source.in_file.cell = j.at("cell").get<std::string>();
    source.in_file.scale = j.at("scale").get<double>();
    source.in_file.surfaces = j.at("surfaces").get<bool>();
  } else {
    source.env = j.at("env").get<std::string>();
    source.mission = j.at("mission").get<std::string>();
  }
  source.vehicle = j.at("vehicle").get<std::string>();
  source.settings = j.at("settings").get<std::string>();
  source.aim = j.value("aim", "");
  source.profile = j.at("profile").get<std::string>();
  return source;
}

/// The message of `/configuration`.
Json configuration_of(const std::string& log) {
  log::McapReader reader(log);
  for (log::Message m; reader.next(m);)
    if (m.channel->topic == "/configuration") return input::parse_json(m.data);
  throw InputError(fmt::format("{}: no log of a flight: it holds no configuration", log));
}

PreparedFlight prepare_scenario(const std::string& path, std::uint64_t seed) {
  PreparedFlight flight;
  mission::Scenario scenario = mission::load_scenario(path);
  scenario.config.seed = seed;
  flight.world = std::make_unique<sitl::World>(mission::world_of(scenario));
  flight.config = scenario.config;
  flight.env = scenario.name;
  flight.inputs = scenario.files;
  flight.inputs.push_back(path);
  return flight;
}

}  // namespace

PreparedFlight prepare(const FlightSource& source, std::uint64_t seed) {
  PreparedFlight flight;
  mission::MissionConfig& config = flight.config;
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(source.vehicle);
  mission::set_vehicle(config, vehicle);
  flight.inputs = vehicle.patterns;
  for (const std::string& path : {source.vehicle, source.world, source.settings, source.profile})
    flight.inputs.push_back(path);
  if (!source.settings.empty()) mission::load_settings(source.settings, config);
  if (!source.aim.empty()) config.flight.aim = mission::aim_of("--aim", source.aim);
  config.seed = seed;
  config.source = to_json(source);
  if (source.world.empty()) {
    if (any_given(source.in_file))
      throw InputError("--start, --goal and the like go with --world FILE: the environments have their own");
    const sitl::Mission mission = sitl::mission_of(source.mission);
    const sitl::NamedEnvironment named = sitl::environment(source.env);
    flight.world = std::make_unique<sitl::World>(sitl::generate(named.knobs, mission, seed));
    flight.env = fmt::format("{}", named.number);
    flight.zone_m = named.knobs.spread_m;
    flight.title =
        fmt::format("Environment {} ({}), {}, seed {}", named.number, named.name, source.mission, seed);
    return flight;
  }
  flight.world = std::make_unique<sitl::World>(
      sitl::load_world(source.world, world_options(source.in_file, config.flight.vehicle.radius_m)));
  if (const std::vector<Vector3> goals_W = goals_of(source.in_file); goals_W.size() > 1)
    config.goals.push_back({0.0, goals_W});
  flight.env = source.world;
  flight.title = fmt::format("{}, seed {}", source.world, seed);
  return flight;
}

PreparedFlight prepare_again(const std::string& log) {
  const mission::RecordedFlight recorded = mission::Recording(log).flight();
  const Json configuration = configuration_of(log);
  const auto source = configuration.find("source");
  if (source == configuration.end())
    throw InputError(
        fmt::format("{}: does not say from what world it was flown: must be a log of roborun fly "
                    "or of a scenario's file",
                    log));
  PreparedFlight flight;
  try {
    const auto profile = configuration.at("profile").get<std::string>();
    if (source->contains("scenario")) {
      flight = prepare_scenario(source->at("scenario").get<std::string>(), recorded.flight.seed);
    } else {
      if (profile == "host")
        throw InputError(
            fmt::format("{}: was flown at the costs of that machine (--profile host), which it does "
                        "not say: must be flown with another profile",
                        log));
      const FlightSource flown = source_from(*source);
      flight = prepare(flown, recorded.flight.seed);
      const board::Profile costs = board::load_profile(flown.profile, recorded.backends);
      flight.config.flight.costs = costs.costs;
      flight.config.flight.model = costs.model;
    }
    flight.config.profile_name = profile;
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: no log of a flight of this program: {}", log, error.what()));
  }
  mission::fly_as_recorded(flight.config, recorded);
  flight.config.source.clear();  // what changes in flight is in no file
  return flight;
}

}  // namespace roborun::app
