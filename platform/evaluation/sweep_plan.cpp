#include "platform/evaluation/sweep_plan.hpp"

#include <fmt/format.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "core/record/state_hash.hpp"
#include "platform/evaluation/suite.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"

namespace roborun::evaluation {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const SweepPlan& p) {
  Json json{{"commit", p.commit}, {"build", p.build}, {"suite", p.suite}, {"mission", p.mission}};
  json["environments"] = p.environments;
  json["profiles"] = Json::array();
  for (const SweepPlan::ProfileId& id : p.profiles)
    json["profiles"].push_back({{"name", id.name}, {"digest", id.digest}});
  json["designs"] = p.designs;
  json["seeds"] = p.seeds;
  json["map"] = p.map;
  json["planner"] = p.planner;
  json["vehicle"] = p.vehicle;
  json["worlds"] = p.worlds;
  json["settings"] = p.settings;
  json["aim"] = p.aim;
  json["shard"] = fmt::format("{}/{}", p.shard, p.shards);
  return json;
}

}  // namespace

std::vector<SweepMission> missions_of(const SweepPlan& plan) {
  std::vector<SweepMission> missions;
  const auto shards = static_cast<std::size_t>(plan.shards);
  std::size_t k = 0;
  for (const std::string& environment : plan.environments) {
    for (const SweepPlan::ProfileId& profile : plan.profiles) {
      for (const std::string& design : plan.designs) {
        for (const std::uint64_t seed : plan.seeds) {
          // Each round of `shards` missions starts one shard later, or three shards would get a design each.
          if ((k + k / shards) % shards == static_cast<std::size_t>(plan.shard - 1))
            missions.push_back({environment, profile.name, design, seed});
          ++k;
        }
      }
    }
  }
  return missions;
}

bool is_representative(const SweepPlan& plan, const SweepMission& mission) {
  if (is_suite(plan.suite)) return false;
  constexpr const char* kMiddle = "14";
  std::string environment = plan.environments[plan.environments.size() / 2];
  for (const std::string& e : plan.environments) environment = e == kMiddle ? e : environment;
  return mission.environment == environment && mission.profile == plan.profiles.front().name;
}

std::string name_of(const SweepMission& m) {
  return fmt::format("environment {}, {}, {}, seed {}", m.environment, m.profile, m.design, m.seed);
}

SweepMission mission_of_result(const report::MissionResult& r) {
  return {r.env, r.profile, r.design, r.seed};
}

std::string to_json(const SweepPlan& plan) {
  return json_of(plan).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

SweepPlan plan_from_json(const std::string& path, const std::string& text) {
  try {
    const Json json = input::parse_json(text);
    SweepPlan p;
    p.commit = json.value("commit", "");
    p.build = json.at("build");
    p.suite = json.at("suite");
    p.mission = json.at("mission");
    for (const Json& e : json.at("environments"))
      p.environments.push_back(e.is_number() ? std::to_string(e.get<int>()) : e.get<std::string>());
    for (const Json& id : json.at("profiles")) p.profiles.push_back({id.at("name"), id.at("digest")});
    p.designs = json.at("designs").get<std::vector<std::string>>();
    p.seeds = json.at("seeds").get<std::vector<std::uint64_t>>();
    p.map = json.at("map");
    p.planner = json.at("planner");
    p.vehicle = json.value("vehicle", "");
    p.worlds = json.value("worlds", "");
    p.settings = json.at("settings");
    p.aim = json.value("aim", "");
    const std::string shard = json.at("shard");
    const bool whole = std::sscanf(shard.c_str(), "%d/%d", &p.shard, &p.shards) == 2 && p.shard >= 1 &&
                       p.shard <= p.shards && !p.environments.empty() && !p.profiles.empty() &&
                       !p.designs.empty() && !p.seeds.empty();
    if (whole) return p;
  } catch (const std::exception&) {  // below
  }
  throw InputError(fmt::format("{}: is not a sweep's request: give a folder of roborun sweep", path));
}

std::string difference(const SweepPlan& a, const SweepPlan& b) {
  const Json left = json_of(a);
  const Json right = json_of(b);
  for (const auto& [key, value] : left.items()) {
    if (value != right.at(key)) return key;
  }
  return {};
}

std::string digest_of(const std::string& bytes) {
  core::StateHash hash;
  hash.add(static_cast<std::uint64_t>(bytes.size()));
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min(sizeof word, bytes.size() - at));
    hash.add(word);
  }
  return fmt::format("{:016x}", hash.value());
}

}  // namespace roborun::evaluation
