#include "platform/app/scenario_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <thread>

#include "platform/app/exit_code.hpp"
#include "platform/evaluation/worker_processes.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/scenario_file.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/report/svg.hpp"
#include "platform/report/trace_csv.hpp"

namespace roborun::app {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

struct ScenarioOptions {
  std::string path;
  std::string junit;
  std::string jobs{std::to_string(std::max(1U, std::thread::hardware_concurrency()))};
  bool json{false};
};

std::vector<std::string> files_of(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {path};
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
    if (entry.is_regular_file() && entry.path().extension() == ".toml")
      files.push_back(entry.path().string());
  }
  if (files.empty()) throw InputError(fmt::format("{}: no scenario in it: must hold .toml files", path));
  std::sort(files.begin(), files.end());
  return files;
}

/// Everything that is told of one scenario: a pure function of its file.
json verdict_of(const mission::Scenario& scenario) {
  const report::MissionReport report = mission::fly_scenario(scenario);
  json actions = json::array();
  for (const report::FailsafeRecord& r : report.safety.actions)
    actions.push_back(
        {{"time_s", r.time_s}, {"action", r.action}, {"phase", r.phase}, {"conditions", r.conditions}});
  const std::vector<std::string> complaints = mission::complaints_of(scenario, report);
  return {{"name", scenario.name},
          {"about", scenario.about},
          {"passed", complaints.empty()},
          {"complaints", complaints},
          {"outcome", report.result.reason},
          {"actions", actions},
          {"first_fault_s", report.safety.first_fault_s},
          {"last_thrust_s", report.safety.last_thrust_s},
          {"touchdown_mps", report.safety.touchdown_mps},
          {"landing_site_known", report.safety.landing_site_was_known},
          {"mission_time_s", report.result.mission_time_s},
          {"state_hash", report.result.state_hash}};
}

std::string junit_of(const std::vector<json>& verdicts) {
  const auto failed =
      std::count_if(verdicts.begin(), verdicts.end(), [](const json& v) { return !v["passed"]; });
  double total_s = 0.0;
  for (const json& v : verdicts) total_s += v["mission_time_s"].get<double>();
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"roborun scenario\" tests=\"{}\" "
      "failures=\"{}\" time=\"{:.3f}\">\n",
      verdicts.size(), failed, total_s);
  for (const json& v : verdicts) {
    xml += fmt::format("  <testcase classname=\"scenario\" name=\"{}\" time=\"{:.3f}\"",
                       report::xml_escape(v["name"]), v["mission_time_s"].get<double>());
    if (v["passed"]) {
      xml += "/>\n";
      continue;
    }
    const auto complaints = v["complaints"].get<std::vector<std::string>>();
    xml += fmt::format(">\n    <failure message=\"{}\"/>\n  </testcase>\n",
                       report::xml_escape(fmt::format("{}", fmt::join(complaints, "; "))));
  }
  return xml + "</testsuite>\n";
}

void tell(const json& v) {
  std::vector<std::string> actions;
  for (const json& a : v["actions"]) actions.push_back(a["action"]);
  fmt::print("{}  {:<34} {:<12} {:6.1f} s  {}\n", v["passed"] ? "pass" : "FAIL", v["name"].get<std::string>(),
             v["outcome"].get<std::string>(), v["mission_time_s"].get<double>(), fmt::join(actions, " > "));
  for (const json& c : v["complaints"]) fmt::print("      {}\n", c.get<std::string>());
}

int run_scenarios(const ScenarioOptions& options) {
  const int jobs = input::jobs_of(options.jobs);
  // Every file is checked before the first one is flown.
  std::vector<mission::Scenario> scenarios;
  std::vector<std::string> inputs;
  for (const std::string& file : files_of(options.path)) {
    scenarios.push_back(mission::load_scenario(file));
    inputs.push_back(file);
    inputs.insert(inputs.end(), scenarios.back().files.begin(), scenarios.back().files.end());
  }
  input::check_outputs({{"--junit", options.junit}}, inputs);

  std::vector<json> verdicts(scenarios.size());
  std::vector<std::size_t> tasks(scenarios.size());
  std::iota(tasks.begin(), tasks.end(), std::size_t{0});
  std::size_t done = 0;
  std::size_t failed = 0;
  const input::StopOnSignal stop;
  report::ProgressLine line;
  evaluation::WorkerCalls calls;
  calls.work = [&](std::size_t i) {
    return verdict_of(scenarios[i]).dump(-1, ' ', false, json::error_handler_t::replace);
  };
  calls.answered = [&](std::size_t i, const std::string& answer) {
    verdicts[i] = json::parse(answer);
    ++done;
    failed += verdicts[i]["passed"] ? 0U : 1U;
    if (line.due()) line.show(fmt::format("{} of {} scenarios flown", done, scenarios.size()));
  };
  calls.died = [&](std::size_t i) {
    throw InputError(fmt::format("{}: the flight's process died", scenarios[i].name));
  };
  calls.go_on = [] { return !input::StopOnSignal::requested(); };
  if (!evaluation::run_in_processes(tasks, jobs, calls))
    throw input::Interrupted(fmt::format("{} of {} scenarios flown, {} of them failed; no file was written",
                                         done, scenarios.size(), failed));

  for (const json& v : verdicts) {
    if (options.json)
      fmt::print("{}\n", v.dump());
    else
      tell(v);
  }
  if (!options.json) fmt::print("{} of {} passed\n", verdicts.size() - failed, verdicts.size());
  if (!options.junit.empty()) input::write_file(options.junit, junit_of(verdicts));
  return failed == 0 ? kDone : kNotGood;
}

}  // namespace

void add_scenario_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<ScenarioOptions>();
  CLI::App* scenario_app =
      app.add_subcommand("scenario", "Fly scenarios with faults from files, and judge each flight");
  scenario_app->require_subcommand(1);
  CLI::App* run_app = scenario_app->add_subcommand("run", "Fly one file, or every .toml file of a folder");
  run_app->footer(
      "Examples:\n"
      "  roborun scenario run platform/sitl/scenarios                 the library\n"
      "  roborun scenario run platform/sitl/scenarios/gnss_off.toml\n"
      "  roborun scenario run my_scenarios --junit out/junit.xml --jobs 4\n\n"
      "A scenario:\n"
      "  [scenario]\n"
      "  about = \"Satellite navigation is lost in cruise: it lands\"\n"
      "  world = \"worlds/yard.toml\"      # relative to this file; or environment = \"14\"\n"
      "  seed = 1                        # design = \"aware\", cost_factor = 1; [camera] [wind] [fog] "
      "[battery] [flight] "
      "[cpu]\n"
      "  [fence]                         # [fence] as in a settings file: platform/README.md\n"
      "  altitude_m = [0.5, 9]\n"
      "  keep_in = [{ polygon = [[-5, -10], [45, -10], [45, 10], [-5, 10]] }]\n"
      "  keep_out = [{ circle = [20, 0, 4] }]      # x, y, radius\n"
      "  [[fault]]\n"
      "  component = \"gnss\"              # imu gnss barometer depth battery esc esc_status can "
      "kill_switch\n"
      "                                  # link planner map clock cpu wind\n"
      "  kind = \"off\"                    # stuck garbage wrong slow delayed intermittent on\n"
      "  instance = 0                    # of depth (0..5), esc and esc_status (0..3); all if left out\n"
      "  phase = \"mission\"               # ground take_off mission hold return land; the start if left "
      "out\n"
      "  at_s = 2.0                      # after the phase began\n"
      "  for_s = 1.0                     # for ever if left out\n"
      "  [[body]]                        # moves; also in a world file\n"
      "  radius = 0.5                    # height = 3: an upright cylinder; a sphere if left out\n"
      "  speed = 2                       # m/s along path, from at_s on\n"
      "  path = [[16, 8, 4], [16, -8, 4]]\n"
      "  [expect]\n"
      "  outcome = \"landed\"              # reached_goal landed holding terminated killed collision ...\n"
      "  action = \"land\"                 # go_on hold return land terminate kill: the last one\n"
      "  condition = \"gnss\"              # that held when an action was decided\n"
      "  within_s = 1.5                  # from the first fault to the first action\n"
      "  touchdown_mps = 1.5             # motors_stop_within_s, home_within_m, goal_within_m, landing_site_known\n\n"
      "Exit code: 0 all passed, 1 at least one failed (its line says why), 2 bad input.");
  run_app->add_option("path", options->path, "A scenario file, or a folder of them")->required();
  run_app->add_option("--junit", options->junit, "Write the verdicts to this file as JUnit XML");
  run_app->add_option("--jobs", options->jobs, "Flights at a time, 1 .. 1024")->capture_default_str();
  run_app->add_flag("--json", options->json, "One JSON object a scenario on standard output, nothing else");
  run_app->callback([options, &run] { run = [options] { return run_scenarios(*options); }; });
}

}  // namespace roborun::app
