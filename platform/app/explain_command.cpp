#include "platform/app/explain_command.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <sstream>
#include <vector>

#include "core/executive/stage_budget.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "stages/planning/ways.hpp"

namespace roborun::app {
namespace {

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

class Row {
 public:
  Row(const std::map<std::string, std::size_t>& column, std::vector<std::string> field)
      : column_(column), field_(std::move(field)) {}
  [[nodiscard]] const std::string& text(const std::string& key) const {
    const auto at = column_.find(key);
    if (at == column_.end())
      throw InputError(fmt::format("no column '{}': must be a file that roborun fly --trace wrote", key));
    return field_[at->second];
  }
  [[nodiscard]] double number(const std::string& key) const {
    return std::strtod(text(key).c_str(), nullptr);
  }

 private:
  const std::map<std::string, std::size_t>& column_;
  std::vector<std::string> field_;
};

std::string words_of_source(const Row& r) {
  const std::string& source = r.text("budget_source");
  if (source == "trajectory") return "the trajectory being flown: nowhere along it may the time run out";
  if (source == "visibility") return "how far ahead it can see, with no trajectory to follow";
  if (source == "shortest") return "the shortest decision there is: physics would allow even less";
  if (source == "longest") return "usefulness: physics would allow more, but the decision is done by then";
  if (source == "failures")
    return "failed decisions before it: precision first, so it gets what the finer cells take";
  if (source == "fixed") return "the static design: its knobs and its time never change";
  return source;
}

std::string words_of_active(const std::string& active) {
  static const std::map<std::string, std::string> kWords{
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
  std::string text;
  std::istringstream stream(active);
  for (std::string name; std::getline(stream, name, '+');) {
    const auto word = kWords.find(name);
    text += fmt::format("  {:<16} {}\n", name, word == kWords.end() ? "" : word->second);
  }
  return text.empty() ? "  none\n" : text;
}

/// "camera 1 fog+camera 2 turned" as a list.
std::string words_of_refused(std::string refused) {
  for (std::size_t at = refused.find('+'); at != std::string::npos; at = refused.find('+', at))
    refused.replace(at, 1, ", ");
  return refused;
}

std::string metres(const Row& r, const char* key) {
  const double x = r.number(key);
  return std::isfinite(x) ? fmt::format("{:.1f} m", x) : "none in view";
}

std::string words_of_ways(const Row& r) {
  const std::string& ways = r.text("ways");
  if (ways == "ok")
    return fmt::format("{:.1f} m to the goal (a metre that nobody has seen yet counts as {:g})",
                       r.number("way_m"), stages::kUnknownWeight);
  if (ways == "no path") return "all that can be reached was seen, and none of it leads to the goal";
  if (ways == "infeasible")
    return "none with the room that plans take; one that is narrower, or not seen, there may be";
  if (ways == "goal blocked") return "the vehicle fits nowhere near the goal";
  if (ways == "start blocked") return "no way is known from here, which proves nothing";
  if (ways == "budget spent") return "no time was left to look";
  return "nothing remembers ways: it plans to its horizon";
}

}  // namespace

std::string explain_decision(const std::string& name, const std::string& csv, double at_s,
                             const std::string& design) {
  std::istringstream stream(csv);
  std::string line;
  std::getline(stream, line);
  std::map<std::string, std::size_t> column;
  const std::vector<std::string> header = fields_of(line);
  for (std::size_t i = 0; i < header.size(); ++i) column[header[i]] = i;
  for (const char* key :
       {"design", "time_s", "budget_source", "deadline_s", "active", "map_predicted_s", "missed"}) {
    if (column.count(key) == 0)
      throw InputError(
          fmt::format("{}: no column '{}': must be a file that roborun fly --trace wrote", name, key));
  }
  std::string chosen = design;
  std::string known;
  std::vector<std::string> found;
  std::size_t number = 0;
  std::size_t index = 0;
  double first_s = 0.0;
  double last_s = 0.0;
  for (std::size_t at = 2; std::getline(stream, line); ++at) {
    std::vector<std::string> fields = fields_of(line);
    if (fields.size() != header.size())
      throw InputError(fmt::format("{}:{}: {} fields: must be {}", name, at, fields.size(), header.size()));
    const std::string& here = fields[column["design"]];
    if (known.find(here) == std::string::npos) known += (known.empty() ? "" : ", ") + here;
    if (chosen.empty()) chosen = here;
    if (here != chosen) continue;
    const double time_s = std::strtod(fields[column["time_s"]].c_str(), nullptr);
    if (index == 0) first_s = time_s;
    ++index;
    last_s = time_s + std::strtod(fields[column["deadline_s"]].c_str(), nullptr);
    if (time_s > at_s) continue;
    found = std::move(fields);
    number = index;
  }
  if (index == 0)
    throw InputError(fmt::format("{}: no decision of design '{}': must be one of {}", name, chosen, known));
  if (found.empty() || at_s > last_s)
    throw InputError(
        fmt::format("--at: {} s is outside the trace: must be {:.2f} to {:.2f}", at_s, first_s, last_s));

  const Row r(column, std::move(found));
  std::string text =
      fmt::format("Decision {} of {}, at {:.2f} s: at ({:.1f}, {:.1f}, {:.1f}) m, flying {:.1f} m/s.\n\n",
                  number, r.text("design"), r.number("time_s"), r.number("x_m"), r.number("y_m"),
                  r.number("z_m"), r.number("speed_mps"));
  text += fmt::format(
      "What it saw   nearest obstacle {}, average gap {}, free way ahead {}; {:.0f} m3 in view, {:.0f} m3 in "
      "the map.\n",
      metres(r, "closest_obstacle_m"), metres(r, "gap_average_m"), metres(r, "visible_m"),
      r.number("sensor_volume_m3"), r.number("map_volume_m3"));
  if (!r.text("refused").empty())
    text += fmt::format("Not believed  {}.\n", words_of_refused(r.text("refused")));
  text += fmt::format("How long      {:.2f} s until it must have decided, {:.2f} s granted. Set by {}.\n",
                      r.number("time_budget_s"), r.number("deadline_s"), words_of_source(r));
  text += fmt::format(
      "How precise   map {} m, plan {} m (the space asks for {} or finer); perceived {:.0f}, exported "
      "{:.0f}, planned {:.0f} "
      "m3.\n",
      r.text("p0_m"), r.text("p1_m"), metres(r, "demand_m"), r.number("v0_m3"), r.number("v1_m3"),
      r.number("v2_m3"));
  text += "Which way     " + words_of_ways(r) + "\n";
  text +=
      fmt::format("How fast      the next trajectory may fly {:.1f} m/s.\n\n", r.number("speed_limit_mps"));
  text += fmt::format("{:<14} {:>12} {:>9}\n", "stage", "predicted s", "spent s");
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    const char* stage = core::to_string(static_cast<core::StageId>(i));
    text += fmt::format("{:<14} {:>12.4f} {:>9.4f}\n", stage, r.number(fmt::format("{}_predicted_s", stage)),
                        r.number(fmt::format("{}_s", stage)));
  }
  text += fmt::format("{:<14} {:>12} {:>9.4f}   {}\n\n", "all", "", r.number("latency_s"),
                      r.text("missed") == "1" ? "LATE: the vehicle is on its braking tail" : "in time");
  text +=
      fmt::format("What held it back (solver: {})\n{}", r.text("solver"), words_of_active(r.text("active")));
  text += fmt::format("\nOutcome       planner: {}; smoother: {}.\n", r.text("planner"), r.text("smoother"));
  return text;
}

void add_explain_command(CLI::App& app, std::function<int()>& run) {
  struct ExplainOptions {
    std::string file;
    double at_s{0.0};
    std::string design;
  };
  const auto options = std::make_shared<ExplainOptions>();
  CLI::App* command = app.add_subcommand("explain", "Why a decision was what it was, in plain words");
  command->footer(
      "Example:\n"
      "  roborun fly --trace flight.csv && roborun explain flight.csv --at 60");
  command->add_option("trace", options->file, "What roborun fly --trace FILE wrote")->required();
  add_number(*command, "--at", options->at_s, -1e6, 1e6, "Seconds since the start of the mission")
      ->default_str("")
      ->required();
  command->add_option("--design", options->design, "If the trace holds several [the first]");
  command->callback([options, &run] {
    run = [options] {
      const std::string csv = input::read_text(options->file, "a file that roborun fly --trace wrote");
      fmt::print("{}", explain_decision(options->file, csv, options->at_s, options->design));
      return kDone;
    };
  });
}

}  // namespace roborun::app
