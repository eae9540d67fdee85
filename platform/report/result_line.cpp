#include "platform/report/result_line.hpp"

#include <limits>
#include <nlohmann/json.hpp>

#include "platform/input/json_reader.hpp"

namespace roborun::report {
namespace {

using Json = nlohmann::ordered_json;

double number(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

}  // namespace

std::string to_line(const MissionResult& result) {
  Json json = Json::parse(to_json(result));
  for (const char* of_the_clock : {"real_time_factor", "believed"}) json.erase(of_the_clock);
  return json.dump();
}

std::optional<MissionResult> from_line(const std::string& line) {
  try {
    const Json json = input::parse_json(line);
    MissionResult r;
    r.design = json.at("design");
    r.profile = json.at("profile");
    r.env = json.at("env");
    r.seed = json.at("seed");
    r.reached_goal = json.at("reached_goal");
    r.collided = json.at("collided");
    r.mission_time_s = number(json.at("mission_time_s"));
    r.distance_m = number(json.at("distance_m"));
    r.mean_velocity_mps = number(json.at("mean_velocity_mps"));
    r.max_velocity_mps = number(json.at("max_velocity_mps"));
    r.energy_kJ = number(json.at("energy_kJ"));
    r.flight_Jpm = number(json.value("flight_Jpm", Json()));  // results of before have none
    r.computing_Jpm = number(json.value("computing_Jpm", Json()));
    r.decisions = json.at("decisions");
    r.deadline_misses = json.at("deadline_misses");
    const Json& latency = json.at("latency_s");
    r.latency_s = {number(latency.at("median")), number(latency.at("p99")), number(latency.at("max"))};
    r.cpu_s = number(json.at("cpu_s"));
    r.cpu_utilization_ratio = number(json.at("cpu_utilization_ratio"));
    const Json& precision = json.at("precision_m");
    r.precision_m = {number(precision.at("min")), number(precision.at("median")),
                     number(precision.at("max"))};
    r.map_bytes = json.at("map_bytes");
    r.state_hash = json.at("state_hash");
    r.map = json.at("map");
    r.planner = json.at("planner");
    r.ways = json.value("ways", "own");  // results of before have none
    r.mission = json.at("mission");
    r.reason = json.at("reason");
    r.speed_limit_mps = number(json.at("speed_limit_mps"));
    if (json.contains("refused"))  // results of before have none
      for (const auto& [sensor, reasons] : json.at("refused").items())
        for (const auto& [reason, images] : reasons.items()) r.refused.push_back({sensor, reason, images});
    r.near_brakes = json.value("near_brakes", std::uint64_t{0});
    r.map_drops = json.value("map_drops", std::uint64_t{0});
    if (json.contains("possible"))
      r.suite = SuiteFlight{json.at("possible"), number(json.at("shortest_m")), json.at("command")};
    return r;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace roborun::report
