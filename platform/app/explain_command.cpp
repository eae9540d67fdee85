#include "platform/app/explain_command.hpp"

#include <fmt/format.h>

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
#include "platform/log/why.hpp"

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

/// The texts of the entry are those of the row.
log::DecisionEntry entry_of(const Row& r) {
  log::DecisionEntry e;
  e.time_ns = from_seconds(r.number("time_s")).count();
  e.budget_source = r.text("budget_source").c_str();
  e.speed_source = r.text("speed_source").c_str();
  e.solver = r.text("solver").c_str();
  e.ways = r.text("ways").c_str();
  e.planner = r.text("planner").c_str();
  e.smoother = r.text("smoother").c_str();
  e.active.append(r.text("active"));
  e.refused.append(r.text("refused"));
  const std::initializer_list<std::pair<const char*, double*>> numbers{
      {"x_m", e.p_WB.data()},
      {"y_m", &e.p_WB[1]},
      {"z_m", &e.p_WB[2]},
      {"speed_mps", &e.speed_mps},
      {"latency_s", &e.latency_s},
      {"time_budget_s", &e.time_budget_s},
      {"deadline_s", &e.deadline_s},
      {"p0_m", &e.p0_m},
      {"p1_m", &e.p1_m},
      {"v0_m3", &e.v0_m3},
      {"v1_m3", &e.v1_m3},
      {"v2_m3", &e.v2_m3},
      {"visible_m", &e.visible_m},
      {"closest_obstacle_m", &e.closest_obstacle_m},
      {"gap_average_m", &e.gap_average_m},
      {"sensor_volume_m3", &e.sensor_volume_m3},
      {"map_volume_m3", &e.map_volume_m3},
      {"demand_m", &e.demand_m},
      {"speed_limit_mps", &e.speed_limit_mps}};
  for (const auto& [key, value] : numbers) *value = r.number(key);
  if (r.text("ways") == "ok") e.way_m = r.number("way_m");
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    const char* stage = core::to_string(static_cast<core::StageId>(i));
    e.predicted_s[i] = r.number(fmt::format("{}_predicted_s", stage));
    e.stage_s[i] = r.number(fmt::format("{}_s", stage));
  }
  e.missed = r.text("missed") == "1";
  return e;
}

}  // namespace

std::string text_of_decision(const log::DecisionEntry& e, std::size_t number, std::string_view design) {
  std::string text =
      fmt::format("Decision {} of {}, at {:.2f} s: at ({:.1f}, {:.1f}, {:.1f}) m, flying {:.1f} m/s.\n\n",
                  number, design, seconds(Nanos{e.time_ns}), e.p_WB[0], e.p_WB[1], e.p_WB[2], e.speed_mps);
  for (const std::string& one : log::why_of(e)) text += one + "\n";
  text += "\n";
  text += fmt::format("{:<14} {:>12} {:>9}\n", "stage", "predicted s", "spent s");
  for (std::size_t i = 0; i < core::kStageCount; ++i)
    text += fmt::format("{:<14} {:>12.4f} {:>9.4f}\n", core::to_string(static_cast<core::StageId>(i)),
                        e.predicted_s[i], e.stage_s[i]);
  text += fmt::format("{:<14} {:>12} {:>9.4f}   {}\n\n", "all", "", e.latency_s,
                      e.missed ? "LATE: the vehicle is on its braking tail" : "in time");
  const std::vector<std::string> outcome = log::outcome_of(e);
  for (const std::string& one : outcome) text += (&one == &outcome.back() ? "\n" : "") + one + "\n";
  return text;
}

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
  return text_of_decision(entry_of(r), number, r.text("design"));
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
  command->add_option("--design", options->design, "Which design, if the trace holds several [the first]");
  command->callback([options, &run] {
    run = [options] {
      const std::string csv = input::read_text(options->file, "a file that roborun fly --trace wrote");
      fmt::print("{}", explain_decision(options->file, csv, options->at_s, options->design));
      return kDone;
    };
  });
}

}  // namespace roborun::app
