#include "platform/app/scenario_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/scenario_flights.hpp"
#include "platform/app/scenario_matrix_command.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/scenario_file.hpp"
#include "platform/report/svg.hpp"

namespace roborun::app {
namespace {

namespace fs = std::filesystem;

struct ScenarioOptions {
  std::string path;
  std::string filter;
  std::string seed, seeds;
  std::string junit;
  ScenarioOutputs outputs;
  std::string jobs{std::to_string(std::max(1U, std::thread::hardware_concurrency()))};
  bool json{false};
};

/// The scenarios of a folder; what is a TOML file and no scenario is named and left out.
std::vector<std::string> scenarios_in(const std::string& folder) {
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.path().extension() == ".toml")
      files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  const auto foreign = std::stable_partition(files.begin(), files.end(), mission::is_scenario);
  if (foreign == files.begin())
    throw InputError(fmt::format("{}: no scenario in it: must hold .toml files with [scenario]", folder));
  for (auto file = foreign; file != files.end(); ++file)
    fmt::print(stderr, "roborun: {}: skipped: no scenario (no [scenario] in it)\n", *file);
  files.erase(foreign, files.end());
  return files;
}

/// By the file's name without ending, with * and ?; several patterns with commas.
void keep_matching(std::vector<std::string>& files, const std::string& filter, const std::string& path) {
  if (filter.empty()) return;
  const std::vector<std::string> patterns = input::split(filter);
  std::erase_if(files, [&patterns](const std::string& file) {
    const std::string name = fs::path(file).stem().string();
    return std::none_of(patterns.begin(), patterns.end(), [&name](const std::string& pattern) {
      return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
    });
  });
  if (files.empty())
    throw InputError(
        fmt::format("--filter: no scenario of {} is called '{}': must be names with * and ?, with "
                    "commas between, as in 'gnss_*,kill_*'",
                    path, filter));
}

std::vector<std::string> files_of(const ScenarioOptions& options) {
  std::error_code error;
  std::vector<std::string> files{options.path};
  if (fs::is_directory(options.path, error)) files = scenarios_in(options.path);
  keep_matching(files, options.filter, options.path);
  return files;
}

/// One for each scenario and seed.
std::vector<ScenarioFlight> flights_of(const ScenarioOptions& options, std::vector<std::string>& inputs) {
  const std::vector<std::uint64_t> seeds = seeds_of(options.seed, options.seeds);
  std::vector<ScenarioFlight> flights;
  // Every file is checked before the first one is flown.
  for (const std::string& file : files_of(options)) {
    const mission::Scenario scenario = mission::load_scenario(file);
    inputs.push_back(file);
    inputs.insert(inputs.end(), scenario.files.begin(), scenario.files.end());
    const auto add = [&](const mission::Scenario& s, const std::string& stem, const std::string& seed) {
      const std::string trace = stem + ".csv";
      flights.push_back(
          {s, stem,
           fmt::format("roborun scenario run {}{} --trace {} --plot {}", input::shell_word(file), seed,
                       input::shell_word(trace), input::shell_word(stem + ".svg")),
           trace});
    };
    if (seeds.empty()) add(scenario, scenario.name, "");
    for (const std::uint64_t seed : seeds) {
      mission::Scenario s = scenario;
      s.config.seed = seed;
      s.name = fmt::format("{} seed {}", scenario.name, seed);
      add(s, fmt::format("{}_seed_{}", scenario.name, seed), fmt::format(" --seed {}", seed));
    }
  }
  return flights;
}

/// Text, reasons and files of every flight; attachments in the way in which Jenkins and GitLab find them.
std::string junit_of(const std::vector<nlohmann::json>& verdicts) {
  const auto failed =
      std::count_if(verdicts.begin(), verdicts.end(), [](const nlohmann::json& v) { return !v["passed"]; });
  double total_s = 0.0;
  for (const nlohmann::json& v : verdicts) total_s += v["mission_time_s"].get<double>();
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"roborun scenario\" tests=\"{}\" "
      "failures=\"{}\" time=\"{:.3f}\">\n",
      verdicts.size(), failed, total_s);
  const auto lines = [](const std::string& text) {  // the escape makes spaces of line ends
    std::string escaped;
    std::size_t at = 0;
    for (std::size_t end = text.find('\n'); end != std::string::npos; at = end + 1, end = text.find('\n', at))
      escaped += report::xml_escape(text.substr(at, end - at)) + "\n";
    return escaped + report::xml_escape(text.substr(at));
  };
  for (const nlohmann::json& v : verdicts) {
    xml += fmt::format("  <testcase classname=\"scenario\" name=\"{}\" time=\"{:.3f}\">\n",
                       report::xml_escape(v["name"]), v["mission_time_s"].get<double>());
    const auto complaints = v["complaints"].get<std::vector<std::string>>();
    if (!complaints.empty())
      xml += fmt::format("    <failure message=\"{}\">{}</failure>\n", report::xml_escape(complaints.front()),
                         lines(fmt::format("{}", fmt::join(complaints, "\n"))));
    std::string output = fmt::format("{}\n{}", v["about"].get<std::string>(), text_of_verdict(v));
    for (const nlohmann::json& file : v["files"])
      output += fmt::format("[[ATTACHMENT|{}]]\n", fs::absolute(file.get<std::string>()).string());
    xml += fmt::format("    <system-out>{}</system-out>\n  </testcase>\n", lines(output));
  }
  return xml + "</testsuite>\n";
}

int run_scenarios(const ScenarioOptions& options) {
  const int jobs = input::jobs_of(options.jobs);
  std::vector<std::string> inputs;
  const std::vector<ScenarioFlight> flights = flights_of(options, inputs);
  check_scenario_outputs(flights, options.outputs, options.junit, inputs);
  const std::vector<nlohmann::json> verdicts =
      fly_scenarios(flights, options.outputs, jobs, [&options](const nlohmann::json& v) {
        print_now(options.json ? v.dump() + "\n" : text_of_verdict(v));
      });
  const auto passed =
      std::count_if(verdicts.begin(), verdicts.end(), [](const nlohmann::json& v) { return v["passed"]; });
  if (!options.json) fmt::print("{} of {} passed\n", passed, verdicts.size());
  if (!options.junit.empty()) input::write_file(options.junit, junit_of(verdicts));
  refuse_lost_logs(verdicts);
  return static_cast<std::size_t>(passed) == verdicts.size() ? kDone : kNotGood;
}

}  // namespace

void add_scenario_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<ScenarioOptions>();
  CLI::App* scenario_app =
      app.add_subcommand("scenario", "Fly scenarios with faults from files, and judge each flight");
  scenario_app->require_subcommand(1);
  add_scenario_matrix_command(*scenario_app, run);
  CLI::App* run_app = scenario_app->add_subcommand("run", "Fly one file, or every scenario of a folder");
  run_app->footer(
      "Examples:\n"
      "  roborun scenario run platform/sitl/scenarios                 the library\n"
      "  roborun scenario run platform/sitl/scenarios/gnss_off.toml\n"
      "  roborun scenario run my_scenarios --junit out/junit.xml --jobs 4\n"
      "  roborun scenario run my_scenarios --filter 'gnss_*,kill_*' --seeds 1,2,3 --out out/failed\n"
      "  roborun scenario run my_scenarios/fog.toml --seed 3 --trace fog.csv --plot fog.svg\n\n"
      "Each verdict is printed as it falls. One that fails says every condition that did not hold: its value "
      "and when,\nwhat it had to be, and why; and the commands that look into it. TOML files of a folder "
      "without [scenario] are\nnamed and skipped.\n\n"
      "A scenario:\n"
      "  [scenario]\n"
      "  about = \"Satellite navigation is lost in cruise: it lands\"\n"
      "  world = \"worlds/yard.toml\"      # relative to this file; or environment = \"14\"\n"
      "  seed = 1                        # design = \"aware\", cost_factor = 1, autopilot = \"px4\" or "
      "\"arducopter\"; [camera] [wind] [fog] "
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
      "  kind = \"off\"                    # stuck garbage wrong slow delayed intermittent on jump drift "
      "...\n"
      "  size = 0.1                      # of wrong slow delayed intermittent jump drift fog wind, in the "
      "kind's unit\n"
      "  instance = 0                    # of depth (0..5), esc and esc_status (0..3); all if left out\n"
      "  phase = \"mission\"               # ground take_off mission hold return land; the start if left "
      "out\n"
      "  at_s = 2.0                      # after the phase began\n"
      "  for_s = 1.0                     # for ever if left out\n"
      "  every_s = 5.0                   # again each so often; once if left out\n"
      "  [[body]]                        # moves; also in a world file\n"
      "  radius = 0.5                    # height = 3: an upright cylinder; a sphere if left out\n"
      "  speed = 2                       # m/s along path, from at_s on\n"
      "  path = [[16, 8, 4], [16, -8, 4]]\n"
      "  [expect]\n"
      "  outcome = \"landed\"              # reached_goal landed holding terminated killed collision ...\n"
      "  action = \"land\"                 # go_on hold return land terminate kill: the last one\n"
      "  condition = \"gnss\"              # that held when an action was decided\n"
      "  within_s = 1.5                  # from the first fault to the first action\n"
      "  touchdown_mps = 1.5             # motors_stop_within_s, home_within_m, goal_within_m, "
      "landing_site_known, sensor\n\n"
      "Exit code: 0 all passed, 1 at least one failed (its line says why), 2 bad input.");
  run_app->add_option("path", options->path, "A scenario file, or a folder of them")->required();
  run_app->add_option("--filter", options->filter,
                      "Only scenarios of these names (* and ? as in a shell), with commas [all]");
  CLI::Option* seed =
      run_app->add_option("--seed", options->seed, "In the place of every scenario's own seed");
  run_app->add_option("--seeds", options->seeds, "Each scenario once with each of these, with commas")
      ->excludes(seed);
  run_app->add_option("--trace", options->outputs.trace,
                      "Write every decision to this CSV file (one scenario, one seed)");
  run_app->add_option("--plot", options->outputs.plot,
                      "Write a picture of the flight to this SVG file (one scenario, one seed)");
  run_app->add_option("--log", options->outputs.log,
                      "Write what the flight read, did and why to this MCAP file (one scenario, one seed)");
  run_app->add_option("--out", options->outputs.folder,
                      "Folder for trace, picture and log of every flight that fails: NAME.csv, .svg, .mcap");
  run_app->add_option("--junit", options->junit,
                      "Write the verdicts to this file as JUnit XML, with text, reasons and files");
  run_app->add_option("--jobs", options->jobs, "Flights at a time, 1 .. 1024")->capture_default_str();
  run_app->add_flag("--json", options->json, "One JSON object per flight on standard output, nothing else");
  run_app->callback([options, &run] { run = [options] { return run_scenarios(*options); }; });
}

}  // namespace roborun::app
