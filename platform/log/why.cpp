#include "platform/log/why.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <string_view>

namespace roborun::log {
namespace {

std::string words_of_source(std::string_view source) {
  if (source == "trajectory") return "the trajectory being flown: nowhere along it may the time run out";
  if (source == "visibility") return "how far ahead it can see, with no trajectory to follow";
  if (source == "shortest") return "the shortest decision that is of use: physics would allow even less";
  if (source == "longest") return "usefulness: physics would allow more, but the decision is done by then";
  if (source == "failures")
    return "failed decisions before it: precision first, so it gets what the finer cells take";
  if (source == "fixed") return "the static design: its knobs and its time never change";
  return std::string(source);
}

std::string words_of_speed(std::string_view source) {
  if (source == "file") return "the vehicle file: its fastest flight";
  if (source == "energy") return "--aim energy: faster, a metre would cost more";
  if (source == "goal") return "the goal, which is near";
  if (source == "motion") return "something that moves nearby";
  if (source == "thin") return "something thin nearby: it must be seen in time";
  if (source == "fixed") return "the static design: its speed never changes";
  if (source == "policy") return "the step of the mission, or a policy of your own";
  return std::string(source);
}

/// Calls `f` with each part of a text with + between.
template <typename F>
void each_part(std::string_view text, F&& f) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('+'), text.size());
    f(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

std::string_view words_of_active(std::string_view active) {
  static const std::map<std::string_view, std::string_view> kWords{
      {"deadline", "all the time is used"},
      {"v0_zero", "nothing is perceived"},
      {"v0_v1", "all that is exported was just perceived"},
      {"v_sensor", "all that the cameras see is taken"},
      {"v_map", "all that the map holds is taken"},
      {"v2_zero", "nothing is planned"},
      {"v0_max", "perception is at the upper end of its knob"},
      {"v1_max", "export is at the upper end of its knob"},
      {"v2_max", "the planner is at the upper end of its knob: more is of no use"},
      {"g_avg", "cells could be coarser but for the precision that the space asks for"},
      {"d_obs", "cells could be coarser but for the nearest obstacle"},
      {"g_min", "cells could be finer, but then not all that is in view would fit into the time"},
      {"empty_precision", "no precision satisfies both bounds"},
      {"empty_volume", "there is no volume"},
      {"too_slow", "even with nothing to do, the stages take longer than there is time"}};
  const auto word = kWords.find(active);
  return word == kWords.end() ? std::string_view() : word->second;
}

std::string metres(double x_m) { return std::isfinite(x_m) ? fmt::format("{:.1f} m", x_m) : "none in view"; }

std::string words_of_ways(const DecisionEntry& e) {
  const std::string_view ways = e.ways;
  if (ways == "ok")
    return fmt::format("{:.1f} m to the goal (a metre that nobody has seen yet counts as {:g})", e.way_m,
                       kUnseenWeight);
  if (ways == "no path") return "all that can be reached was seen, and none of it leads to the goal";
  if (ways == "infeasible")
    return "none with the room that plans take; one that is narrower, or not seen, there may be";
  if (ways == "goal blocked") return "the vehicle fits nowhere near the goal";
  if (ways == "start blocked") return "no way is known from here, which proves nothing";
  if (ways == "budget spent") return "no time was left to look";
  return "nothing remembers ways: it plans to its horizon";
}

}  // namespace

std::vector<std::string> why_of(const DecisionEntry& e) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format(
      "What it saw   nearest obstacle {}, average gap {}, free way ahead {}; {:.0f} m3 in view, {:.0f} m3 in "
      "the map.",
      metres(e.closest_obstacle_m), metres(e.gap_average_m), metres(e.visible_m), e.sensor_volume_m3,
      e.map_volume_m3));
  std::string refused;
  each_part(e.refused.view(), [&refused](std::string_view one) {
    refused += fmt::format("{}{}", refused.empty() ? "" : ", ", one);
  });
  if (!refused.empty()) lines.push_back(fmt::format("Not believed  {}.", refused));
  lines.push_back(
      fmt::format("How long      {:.2f} s until it must have decided, {:.2f} s granted. Set by {}.",
                  e.time_budget_s, e.deadline_s, words_of_source(e.budget_source)));
  lines.push_back(fmt::format(
      "How precise   map {:g} m, plan {:g} m (the space asks for {} or finer); perceived {:.0f}, exported "
      "{:.0f}, planned {:.0f} m3.",
      e.p0_m, e.p1_m, metres(e.demand_m), e.v0_m3, e.v1_m3, e.v2_m3));
  lines.push_back("Which way     " + words_of_ways(e));
  lines.push_back(fmt::format("How fast      the next trajectory may fly {:.1f} m/s. Set by {}.",
                              e.speed_limit_mps, words_of_speed(e.speed_source)));
  return lines;
}

std::vector<std::string> outcome_of(const DecisionEntry& e) {
  std::vector<std::string> lines{fmt::format("What held it back (solver: {})", e.solver)};
  each_part(e.active.view(), [&lines](std::string_view name) {
    lines.push_back(fmt::format("  {:<16} {}", name, words_of_active(name)));
  });
  if (e.active.view().empty()) lines.emplace_back("  none");
  lines.push_back(fmt::format("Outcome       planner: {}; smoother: {}.", e.planner, e.smoother));
  return lines;
}

}  // namespace roborun::log
