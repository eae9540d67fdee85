#include "platform/app/scenario_matrix_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <thread>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/scenario_flights.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/scenario_matrix.hpp"

namespace roborun::app {
namespace {

struct MatrixOptions {
  std::string faults;
  std::string environments{"1,14,27"};
  std::string seeds{"1"};
  std::string phase{"mission"};
  double at_s{mission::MatrixPlan{}.at_s};
  double for_s{mission::MatrixPlan{}.for_s};
  double time_limit_s{600.0};
  std::string out;
  std::string jobs{std::to_string(std::max(1U, std::thread::hardware_concurrency()))};
  bool json{false};
};

mission::MatrixPlan matrix_of(const MatrixOptions& options) {
  mission::MatrixPlan plan;
  plan.faults = options.faults.empty() ? mission::usual_faults() : input::split(options.faults);
  plan.environments = input::split(options.environments);
  plan.seeds = seeds_of("", options.seeds);
  if (plan.seeds.empty()) throw InputError("--seeds: '' names none: must be whole numbers with commas");
  plan.phase = mission::phase_named("--phase", options.phase);
  plan.at_s = options.at_s;
  plan.for_s = options.for_s;
  plan.time_limit_s = options.time_limit_s;
  refuse_twice("--faults", plan.faults);
  std::vector<std::string> columns;
  for (const std::string& environment : plan.environments)
    columns.push_back(mission::column_name(environment));
  refuse_twice("--environments", columns);
  return plan;
}

/// "depth:fog yard seed 1" as a file's name.
std::string stem_of(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == ':' || c == ' '; }, '_');
  return name;
}

/// The verdicts of one cell, of all its seeds: "3/3 landed", "FAIL 2/3 landed, collision".
std::string words_of_cell(std::span<const nlohmann::json> verdicts) {
  std::vector<std::string> outcomes;
  std::size_t passed = 0;
  for (const nlohmann::json& v : verdicts) {
    passed += v["passed"] ? 1U : 0U;
    const std::string outcome = v["outcome"];
    if (std::find(outcomes.begin(), outcomes.end(), outcome) == outcomes.end()) outcomes.push_back(outcome);
  }
  const std::string count = verdicts.size() > 1 ? fmt::format("{}/{} ", passed, verdicts.size()) : "";
  return fmt::format("{} {}{}", passed == verdicts.size() ? "pass" : "FAIL", count,
                     fmt::join(outcomes, ", "));
}

/// A row for each fault, a column for each environment.
std::string matrix_table(const mission::MatrixPlan& plan, const std::vector<nlohmann::json>& verdicts) {
  std::vector<std::vector<std::string>> rows{{"fault"}};
  for (const std::string& environment : plan.environments)
    rows.front().push_back(mission::column_name(environment));
  std::span<const nlohmann::json> left = verdicts;
  for (const std::string& fault : plan.faults) {
    rows.push_back({fault});
    for (std::size_t e = 0; e < plan.environments.size(); ++e) {
      rows.back().push_back(words_of_cell(left.first(plan.seeds.size())));
      left = left.subspan(plan.seeds.size());
    }
  }
  std::vector<std::size_t> width(rows.front().size(), 0);
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], row[i].size());
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}  ", row[i], width[i]);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

nlohmann::ordered_json matrix_json(const mission::MatrixPlan& plan,
                                   const std::vector<nlohmann::json>& verdicts, std::size_t passed) {
  nlohmann::ordered_json cells = nlohmann::ordered_json::array();
  std::size_t at = 0;
  for (const std::string& fault : plan.faults) {
    for (const std::string& environment : plan.environments) {
      for (const std::uint64_t seed : plan.seeds) {
        nlohmann::ordered_json cell{{"fault", fault}, {"environment", environment}, {"seed", seed}};
        for (const char* key : {"passed", "outcome", "complaints", "checks", "actions", "first_fault_s",
                                "mission_time_s", "state_hash", "files", "commands"})
          if (verdicts[at].contains(key)) cell[key] = verdicts[at][key];
        cells.push_back(std::move(cell));
        ++at;
      }
    }
  }
  return {{"faults", plan.faults},
          {"environments", plan.environments},
          {"seeds", plan.seeds},
          {"phase", governor::to_string(plan.phase)},
          {"at_s", plan.at_s},
          {"for_s", plan.for_s},
          {"flights", at},
          {"passed", passed},
          {"cells", std::move(cells)}};
}

int fly_matrix(const MatrixOptions& options) {
  const int jobs = input::jobs_of(options.jobs);
  const mission::MatrixPlan plan = matrix_of(options);
  std::vector<ScenarioFlight> flights;
  std::vector<std::string> inputs;
  for (mission::Scenario& cell : mission::cells_of(plan)) {
    inputs.insert(inputs.end(), cell.files.begin(), cell.files.end());
    const std::string stem = stem_of(cell.name);
    flights.push_back({std::move(cell), stem, "", "failed/" + stem + ".csv"});
  }
  std::size_t at = 0;
  for (const std::string& fault : plan.faults)
    for (const std::string& environment : plan.environments)
      for (const std::uint64_t seed : plan.seeds)
        flights[at++].again = fmt::format(
            "roborun scenario matrix --faults {} --environments {} --seeds {} --phase {} --at {} --for {} "
            "--time-limit {} --out failed",
            fault, input::shell_word(environment), seed, options.phase, plan.at_s, plan.for_s,
            plan.time_limit_s);
  const ScenarioOutputs outputs{{}, {}, {}, options.out};
  for (std::size_t e = 0; e < plan.environments.size(); ++e)  // a world that is none, before the first flight
    (void)mission::world_of(flights[e * plan.seeds.size()].scenario);
  check_scenario_outputs(flights, outputs, "", inputs);
  const std::vector<nlohmann::json> verdicts = fly_scenarios(flights, outputs, jobs, [&](const auto& v) {
    if (!options.json && !v["passed"]) print_now(text_of_verdict(v));
  });
  const auto passed = static_cast<std::size_t>(
      std::count_if(verdicts.begin(), verdicts.end(), [](const nlohmann::json& v) { return v["passed"]; }));
  if (options.json)
    fmt::print("{}\n", matrix_json(plan, verdicts, passed).dump());
  else
    fmt::print("{}{} of {} passed\n", matrix_table(plan, verdicts), passed, verdicts.size());
  refuse_lost_logs(verdicts);
  return passed == verdicts.size() ? kDone : kNotGood;
}

}  // namespace

void add_scenario_matrix_command(CLI::App& scenario_app, std::function<int()>& run) {
  const auto options = std::make_shared<MatrixOptions>();
  CLI::App* app = scenario_app.add_subcommand(
      "matrix", "Fly faults x environments x seeds, and give a verdict for each cell");
  app->footer(
      "Examples:\n"
      "  roborun scenario matrix                                        every component, three environments\n"
      "  roborun scenario matrix --faults none,gnss:off,depth:covered:0 --environments 1,14 --seeds 1,2,3\n"
      "  roborun scenario matrix --faults esc:off --environments my/yard.toml --phase return --out "
      "out/failed\n\n"
      "A cell with a fault passes if the flight ends at the goal or as the failsafe has it (landed, "
      "holding,\n"
      "terminated, killed), without a collision, and the fault was injected. A cell of 'none' must reach the "
      "goal.\nFlown by the aware design with the cost profile paper. Failed flights are printed as they "
      "fall, "
      "with reasons and\ncommands; the table comes at the end. Components and kinds: roborun scenario run "
      "--help.\n\n"
      "Exit code: 0 all passed, 1 at least one failed, 2 bad input, 130 stopped.");
  app->add_option(
      "--faults", options->faults,
      "none, COMPONENT:KIND or COMPONENT:KIND:INSTANCE, with commas [none, and one of each component]");
  app->add_option("--environments", options->environments, "1 .. 27, or worlds *.toml, with commas")
      ->capture_default_str();
  app->add_option("--seeds", options->seeds, "Whole numbers with commas")->capture_default_str();
  app->add_option("--phase", options->phase,
                  "Phase in which the fault begins: ground take_off mission hold return land")
      ->capture_default_str();
  add_number(*app, "--at", options->at_s, 0.0, 7200.0, "Seconds after the phase began");
  add_number(*app, "--for", options->for_s, 0.0, 1e6, "Seconds that the fault lasts");
  add_number(*app, "--time-limit", options->time_limit_s, 1.0, 7200.0,
             "Seconds after which a flight is given up");
  app->add_option("--out", options->out, "Folder for trace, picture and log of every flight that fails");
  app->add_option("--jobs", options->jobs, "Flights at a time, 1 .. 1024")->capture_default_str();
  app->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  app->callback([options, &run] { run = [options] { return fly_matrix(*options); }; });
}

}  // namespace roborun::app
