#include "platform/report/flight_record.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "platform/input/json_reader.hpp"

namespace roborun::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kEveryPoint = 5;  // 10 Hz to 2 Hz
constexpr std::size_t kPathFields = 5;
constexpr std::size_t kDecisionFields = 12 + core::kStageCount;

double rounded(double value) { return std::round(value * 1e4) / 1e4; }

Json row(std::initializer_list<double> values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(rounded(value));
  return json;
}

}  // namespace

std::string to_flight_record(const MissionReport& mission) {
  Json path = Json::array();
  for (std::size_t i = 0; i < mission.path.size(); i += kEveryPoint) {
    const PathPoint& p = mission.path[i];
    path.push_back(row({p.time_s, p.p_WB.x(), p.p_WB.y(), p.p_WB.z(), p.speed_mps}));
  }
  Json decisions = Json::array();
  for (const DecisionRecord& d : mission.decisions) {
    Json json = row({d.time_s, d.p_WB.x(), d.p_WB.y(), d.p_WB.z(), d.speed_mps, d.p0_m, d.v0_m3,
                     d.time_budget_s, d.deadline_s, d.latency_s, d.visible_m, d.missed ? 1.0 : 0.0});
    for (const double s : d.stage_s) json.push_back(rounded(s));
    decisions.push_back(std::move(json));
  }
  return Json{{"path", std::move(path)}, {"decisions", std::move(decisions)}}.dump() + "\n";
}

bool from_flight_record(const std::string& text, MissionReport& mission) {
  std::vector<PathPoint> path;
  std::vector<DecisionRecord> decisions;
  const auto finite = [](const Json& json) { return json.is_null() ? 0.0 : json.get<double>(); };
  try {
    const Json json = input::parse_json(text);
    for (const Json& p : json.at("path")) {
      if (p.size() != kPathFields) return false;
      path.push_back({finite(p[0]), Vector3(finite(p[1]), finite(p[2]), finite(p[3])), finite(p[4])});
    }
    for (const Json& j : json.at("decisions")) {
      if (j.size() != kDecisionFields) return false;
      DecisionRecord d;
      d.time_s = finite(j[0]);
      d.p_WB = Vector3(finite(j[1]), finite(j[2]), finite(j[3]));
      d.speed_mps = finite(j[4]);
      d.p0_m = finite(j[5]);
      d.v0_m3 = finite(j[6]);
      d.time_budget_s = finite(j[7]);
      d.deadline_s = finite(j[8]);
      d.latency_s = finite(j[9]);
      d.visible_m = finite(j[10]);
      d.missed = finite(j[11]) > 0.5;
      for (std::size_t i = 0; i < core::kStageCount; ++i) d.stage_s[i] = finite(j[12 + i]);
      decisions.push_back(d);
    }
  } catch (const std::exception&) {
    return false;
  }
  mission.path = std::move(path);
  mission.decisions = std::move(decisions);
  return true;
}

}  // namespace roborun::report
