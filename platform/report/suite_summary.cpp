#include "platform/report/suite_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace roborun::report {
namespace {

using Json = nlohmann::ordered_json;

bool possible(const MissionResult& r) { return r.suite->possible; }
bool arrived(const MissionResult& r) { return r.reached_goal && !r.collided; }

/// World and vehicle.
std::pair<std::string, std::string> parts(const MissionResult& r) {
  const std::size_t cut = r.env.find('/');
  return {r.env.substr(0, cut), r.env.substr(cut + 1)};
}

/// "1-20" or "1-3,7".
std::string shown(const std::vector<std::uint64_t>& seeds) {
  std::string text;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    std::size_t last = i;
    while (last + 1 < seeds.size() && seeds[last + 1] == seeds[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ",", seeds[i]);
    if (last > i) text += fmt::format("-{}", seeds[last]);
    i = last;
  }
  return text;
}

std::string shown(double value) {
  return std::isfinite(value) ? fmt::format("{:.2f}", value) : std::string("-");
}

/// Several summaries as one; its world is `name`, and it has no medians.
SuiteSummary sum(const std::vector<SuiteSummary>& all, const std::string& name) {
  SuiteSummary whole;
  whole.world = name;
  for (const SuiteSummary& s : all) {
    whole.flights += s.flights;
    whole.possible += s.possible;
    whole.reached += s.reached;
    whole.collided += s.collided;
    whole.no_way += s.no_way;
  }
  return whole;
}

}  // namespace

bool failed(const MissionResult& r) {
  if (r.collided) return true;
  return possible(r) ? !r.reached_goal : !r.reached_goal && r.reason != "no_way";
}

std::vector<SuiteSummary> summarise(const std::vector<MissionResult>& flights) {
  std::vector<SuiteSummary> summaries;
  std::vector<std::vector<double>> ratios;
  for (const MissionResult& r : flights) {
    const auto names = parts(r);
    const auto& world = names.first;
    const auto& vehicle = names.second;
    auto found = std::find_if(summaries.begin(), summaries.end(), [&](const SuiteSummary& s) {
      return s.world == world && s.vehicle == vehicle && s.profile == r.profile && s.design == r.design;
    });
    if (found == summaries.end()) {
      summaries.push_back({world, vehicle, r.profile, r.design, {}});
      ratios.emplace_back();
      found = summaries.end() - 1;
    }
    SuiteSummary& s = *found;
    s.seeds.push_back(r.seed);
    ++s.flights;
    s.possible += possible(r) ? 1 : 0;
    s.collided += r.collided ? 1 : 0;
    s.no_way += !possible(r) && r.reason == "no_way" ? 1 : 0;
    if (!possible(r) || !arrived(r)) continue;
    ++s.reached;
    s.mean_velocity_mps += r.mean_velocity_mps;
    ratios[static_cast<std::size_t>(found - summaries.begin())].push_back(r.distance_m / r.suite->shortest_m);
  }
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    SuiteSummary& s = summaries[i];
    std::vector<double>& mine = ratios[i];
    std::sort(s.seeds.begin(), s.seeds.end());
    std::sort(mine.begin(), mine.end());
    const double none = std::numeric_limits<double>::quiet_NaN();
    const std::size_t half = mine.size() / 2;
    s.mean_velocity_mps = mine.empty() ? none : s.mean_velocity_mps / s.reached;
    s.way_ratio = mine.empty()           ? none
                  : mine.size() % 2 == 1 ? mine[half]
                                         : 0.5 * (mine[half - 1] + mine[half]);
    s.way_ratio_max = mine.empty() ? none : mine.back();
  }
  return summaries;
}

std::string suite_table(const std::vector<MissionResult>& flights) {
  constexpr const char* kRow = "{:<14} {:<11} {:<8} {:>7} {:>8} {:>7} {:>8} {:>6} {:>6} {:>6} {:>6}  {}\n";
  std::string text = fmt::format(fmt::runtime(kRow), "world", "vehicle", "profile", "flights", "possible",
                                 "reached", "collided", "no way", "m/s", "way", "worst", "seeds");
  std::vector<SuiteSummary> all = summarise(flights);
  if (all.size() > 1) all.push_back(sum(all, "all"));
  for (const SuiteSummary& s : all) {
    const bool whole = s.seeds.empty();
    text += fmt::format(fmt::runtime(kRow), s.world, s.vehicle, s.profile, s.flights, s.possible, s.reached,
                        s.collided, s.no_way, whole ? "" : shown(s.mean_velocity_mps),
                        whole ? "" : shown(s.way_ratio), whole ? "" : shown(s.way_ratio_max), shown(s.seeds));
  }
  text +=
      "possible: the judge finds a way with 0.2 m of room; reached: of these, and without a collision; no "
      "way: of the others, "
      "proven by the\nvehicle; m/s: mean of those that reached; way: flown over shortest, median and worst "
      "of them\n";
  for (const MissionResult& r : flights) {
    if (!failed(r)) continue;
    const auto names = parts(r);
    const auto& world = names.first;
    const auto& vehicle = names.second;
    text += fmt::format("{}: {}, {}, {}, {}, seed {}: {} after {:.0f} s, {:.0f} m\n  {}\n",
                        possible(r) ? "failed" : "impossible, and not proven", world, vehicle, r.profile,
                        r.design, r.seed, r.reason, r.mission_time_s, r.distance_m, r.suite->command);
  }
  return text;
}

std::string suite_json(const std::string& suite, const std::vector<MissionResult>& flights, bool complete) {
  Json json{{"suite", suite}, {"complete", complete}};
  json["worlds"] = Json::array();
  for (const SuiteSummary& s : summarise(flights)) {
    json["worlds"].push_back({{"world", s.world},
                              {"vehicle", s.vehicle},
                              {"profile", s.profile},
                              {"design", s.design},
                              {"seeds", s.seeds},
                              {"flights", s.flights},
                              {"possible", s.possible},
                              {"reached", s.reached},
                              {"collided", s.collided},
                              {"no_way", s.no_way},
                              {"mean_velocity_mps", s.mean_velocity_mps},
                              {"way_ratio", s.way_ratio},
                              {"way_ratio_max", s.way_ratio_max}});
  }
  json["failed"] = Json::array();
  for (const MissionResult& r : flights) {
    if (!failed(r)) continue;
    const auto names = parts(r);
    const auto& world = names.first;
    const auto& vehicle = names.second;
    json["failed"].push_back({{"world", world},
                              {"vehicle", vehicle},
                              {"profile", r.profile},
                              {"design", r.design},
                              {"seed", r.seed},
                              {"possible", possible(r)},
                              {"collided", r.collided},
                              {"reason", r.reason},
                              {"mission_time_s", r.mission_time_s},
                              {"distance_m", r.distance_m},
                              {"command", r.suite->command}});
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace roborun::report
