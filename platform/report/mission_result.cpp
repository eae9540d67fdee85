#include "platform/report/mission_result.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace roborun::report {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

std::string to_json(const MissionResult& r) {
  Json json;
  json["design"] = r.design;
  json["profile"] = r.profile;
  json["env"] = r.env;
  json["seed"] = r.seed;
  json["reached_goal"] = r.reached_goal;
  json["collided"] = r.collided;
  json["mission_time_s"] = r.mission_time_s;
  json["distance_m"] = r.distance_m;
  json["mean_velocity_mps"] = r.mean_velocity_mps;
  json["max_velocity_mps"] = r.max_velocity_mps;
  json["energy_kJ"] = r.energy_kJ;
  json["decisions"] = r.decisions;
  json["deadline_misses"] = r.deadline_misses;
  json["latency_s"] = {{"median", r.latency_s.median}, {"p99", r.latency_s.p99}, {"max", r.latency_s.max}};
  json["cpu_s"] = r.cpu_s;
  json["cpu_utilization_ratio"] = r.cpu_utilization_ratio;
  json["precision_m"] = {
      {"min", r.precision_m.min}, {"median", r.precision_m.median}, {"max", r.precision_m.max}};
  json["real_time_factor"] = r.real_time_factor;
  json["map_bytes"] = r.map_bytes;
  json["state_hash"] = r.state_hash;
  json["map"] = r.map;
  json["planner"] = r.planner;
  json["ways"] = r.ways;
  json["mission"] = r.mission;
  json["reason"] = r.reason;
  json["speed_limit_mps"] = r.speed_limit_mps;
  json["flight_Jpm"] = r.flight_Jpm;
  json["computing_Jpm"] = r.computing_Jpm;
  if (r.route)
    json["mission"] = {{"steps", r.route->steps}, {"done", r.route->done}, {"released", r.route->released}};
  for (const GoalRecord& g : r.goals)
    json["goals"].push_back({{"goal_m", {g.goal_W.x(), g.goal_W.y(), g.goal_W.z()}},
                             {"answer", g.answer},
                             {"time_s", g.time_s},
                             {"distance_m", g.distance_m}});
  json["refused"] = Json::object();
  for (const RefusedRecord& refused : r.refused)
    json["refused"][refused.sensor][refused.reason] = refused.images;
  json["near_brakes"] = r.near_brakes;
  json["map_drops"] = r.map_drops;
  if (r.suite) {
    json["possible"] = r.suite->possible;
    json["shortest_m"] = r.suite->shortest_m;
    json["command"] = r.suite->command;
  }
  json["believed"] = r.believed;
  // Text from file names may be anything: invalid UTF-8 is replaced, never thrown over.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace roborun::report
