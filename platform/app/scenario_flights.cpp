#include "platform/app/scenario_flights.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <system_error>

#include "platform/app/options.hpp"
#include "platform/evaluation/sweep_store.hpp"
#include "platform/evaluation/worker_processes.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/scene.hpp"
#include "platform/mission/verdict.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/report/svg_plot.hpp"
#include "platform/report/trace_csv.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::app {
namespace {

namespace fs = std::filesystem;

std::string file_in(const std::string& folder, const std::string& stem, const char* ending) {
  return (fs::path(folder) / (stem + ending)).string();
}

std::string picture_of(const mission::Scenario& s, const report::MissionReport& flown,
                       const std::vector<std::string>& complaints) {
  const std::string title = fmt::format("{}, seed {}: {}", s.name, s.config.seed,
                                        complaints.empty() ? "passed" : "failed, " + flown.result.reason);
  const double zone_m = s.world.empty() ? sitl::environment(s.environment).knobs.spread_m : 0.0;
  return report::mission_svg(mission::scene_of(mission::world_of(s), title, zone_m), {&flown, 1},
                             report::PathColour::kSpeed);
}

/// In the flight's own process: everything that is told of it, and its files as text under "trace" and "plot".
nlohmann::json judged(const ScenarioFlight& flight, const ScenarioOutputs& outputs) {
  mission::Scenario s = flight.scenario;
  s.config.log = outputs.log;
  const report::MissionReport flown = mission::fly_scenario(s);
  const std::vector<mission::Check> checks = mission::checks_of(s, flown);
  const std::vector<std::string> complaints = mission::complaints_of(checks);
  nlohmann::json actions = nlohmann::json::array();
  for (const report::FailsafeRecord& r : flown.safety.actions) {
    actions.push_back(
        {{"time_s", r.time_s}, {"action", r.action}, {"phase", r.phase}, {"conditions", r.conditions}});
    if (!r.sensor.empty()) actions.back()["sensor"] = r.sensor;
  }
  nlohmann::json all = nlohmann::json::array();
  for (const mission::Check& c : checks) all.push_back(mission::to_json(c));
  nlohmann::json v{{"name", s.name},
                   {"about", s.about},
                   {"seed", s.config.seed},
                   {"passed", complaints.empty()},
                   {"complaints", complaints},
                   {"checks", all},
                   {"outcome", flown.result.reason},
                   {"collided", flown.result.collided},
                   {"distance_m", flown.result.distance_m},
                   {"decisions", flown.result.decisions},
                   {"deadline_misses", flown.result.deadline_misses},
                   {"actions", actions},
                   {"first_fault_s", flown.safety.first_fault_s},
                   {"last_thrust_s", flown.safety.last_thrust_s},
                   {"touchdown_mps", flown.safety.touchdown_mps},
                   {"landing_site_known", flown.safety.landing_site_was_known},
                   {"mission_time_s", flown.result.mission_time_s},
                   {"goal_error_m", flown.safety.goal_error_m},
                   {"state_hash", flown.result.state_hash}};
  if (!complaints.empty()) v["moment_s"] = mission::moment_of(checks, flown);
  const bool keeps = !complaints.empty() && !outputs.folder.empty();
  if (keeps || !outputs.trace.empty()) v["trace"] = report::trace_csv({&flown, 1});
  if (keeps || !outputs.plot.empty()) v["plot"] = picture_of(s, flown, complaints);
  std::string log_error = flown.log_error;
  if (keeps) {  // the same flight again, bit for bit: a log is written while it is flown
    s.config.log = file_in(outputs.folder, flight.stem, ".mcap");
    log_error += mission::fly_scenario(s).log_error;
  }
  if (!log_error.empty()) v["log_error"] = log_error;
  v["decided"] = !flown.decisions.empty();
  return v;
}

/// Writes the files of a flight, and puts their names and the commands in the place of their text.
void write_down(const ScenarioFlight& flight, const ScenarioOutputs& outputs, nlohmann::json& v) {
  nlohmann::json files = nlohmann::json::array();
  std::string trace = flight.trace;
  const auto write = [&](const std::string& path, const char* key) {
    input::write_file(path, v[key].get_ref<const std::string&>());
    files.push_back(path);
    if (std::string_view(key) == "trace") trace = path;
  };
  if (!outputs.trace.empty()) write(outputs.trace, "trace");
  if (!outputs.plot.empty()) write(outputs.plot, "plot");
  const bool passed = v["passed"];
  if (!passed && !outputs.folder.empty()) {
    write(file_in(outputs.folder, flight.stem, ".csv"), "trace");
    write(file_in(outputs.folder, flight.stem, ".svg"), "plot");
    files.push_back(file_in(outputs.folder, flight.stem, ".mcap"));
  }
  if (!outputs.log.empty()) files.push_back(outputs.log);
  v.erase("trace");
  v.erase("plot");
  v["files"] = files;
  if (!passed) {
    v["commands"] = {flight.again};
    if (!outputs.folder.empty())
      v["commands"].push_back("roborun report " +
                              input::shell_word(file_in(outputs.folder, flight.stem, ".mcap")));
    if (v["decided"])
      v["commands"].push_back(fmt::format("roborun explain {} --at {:.2f}", input::shell_word(trace),
                                          v["moment_s"].get<double>()));
  }
  v.erase("decided");
}

}  // namespace

std::vector<std::uint64_t> seeds_of(const std::string& seed, const std::string& seeds) {
  std::vector<std::uint64_t> all;
  if (!seed.empty()) all.push_back(input::seed_of("--seed", seed));
  if (seeds.empty()) return all;
  for (const std::string& one : input::split(seeds)) all.push_back(input::seed_of("--seeds", one));
  refuse_twice("--seeds", all);
  return all;
}

void check_scenario_outputs(std::span<const ScenarioFlight> flights, const ScenarioOutputs& outputs,
                            const std::string& junit, const std::vector<std::string>& inputs) {
  for (const auto& [option, path] : {std::pair{"--trace", outputs.trace}, std::pair{"--plot", outputs.plot},
                                     std::pair{"--log", outputs.log}}) {
    if (!path.empty() && flights.size() != 1)
      throw InputError(
          fmt::format("{}: {} flights: must go with one scenario and one seed; --out FOLDER keeps "
                      "trace, picture and log of every one that fails",
                      option, flights.size()));
  }
  std::vector<input::NamedOutput> all{
      {"--junit", junit}, {"--trace", outputs.trace}, {"--plot", outputs.plot}, {"--log", outputs.log}};
  if (!outputs.folder.empty()) {
    evaluation::check_folder(outputs.folder, inputs);
    std::error_code error;
    fs::create_directories(outputs.folder, error);
    if (error)
      throw InputError(fmt::format("--out: {}: cannot be made: {}", outputs.folder, error.message()));
    all.push_back({"--out", file_in(outputs.folder, flights.front().stem, ".csv")});
  }
  input::check_outputs(all, inputs);
}

std::vector<nlohmann::json> fly_scenarios(std::span<const ScenarioFlight> flights,
                                          const ScenarioOutputs& outputs, int jobs,
                                          const std::function<void(const nlohmann::json&)>& told) {
  std::vector<nlohmann::json> verdicts(flights.size());
  std::vector<std::size_t> tasks(flights.size());
  std::iota(tasks.begin(), tasks.end(), std::size_t{0});
  std::size_t done = 0;
  std::size_t failed = 0;
  const input::StopOnSignal stop;
  report::ProgressLine line;
  evaluation::WorkerCalls calls;
  calls.work = [&](std::size_t i) {
    return judged(flights[i], outputs).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  };
  calls.answered = [&](std::size_t i, const std::string& answer) {
    verdicts[i] = nlohmann::json::parse(answer);
    write_down(flights[i], outputs, verdicts[i]);
    ++done;
    failed += verdicts[i]["passed"] ? 0U : 1U;
    line.clear();
    told(verdicts[i]);
    if (line.due()) line.show(fmt::format("{} of {} scenarios flown", done, flights.size()));
  };
  calls.died = [&](std::size_t i) {
    throw InputError(fmt::format("{}: the flight's process died", flights[i].scenario.name));
  };
  calls.go_on = [] { return !input::StopOnSignal::requested(); };
  if (!evaluation::run_in_processes(tasks, jobs, calls))
    throw input::Interrupted(fmt::format("{} of {} scenarios flown, {} of them failed; {}", done,
                                         flights.size(), failed,
                                         !outputs.folder.empty() ? "their files are in " + outputs.folder
                                         : outputs.log.empty()   ? "no file was written"
                                                                 : "the log ends there"));
  return verdicts;
}

std::string text_of_verdict(const nlohmann::json& v) {
  std::vector<std::string> actions;
  for (const nlohmann::json& a : v["actions"]) {
    const auto conditions = a["conditions"].get<std::vector<std::string>>();
    actions.push_back(
        fmt::format("{} {:.1f} s{}", a["action"].get<std::string>(), a["time_s"].get<double>(),
                    conditions.empty() ? "" : fmt::format(" ({})", fmt::join(conditions, ", "))));
  }
  std::string text = fmt::format("{}  {:<34} {:<12} {:6.1f} s  {}\n", v["passed"] ? "pass" : "FAIL",
                                 v["name"].get<std::string>(), v["outcome"].get<std::string>(),
                                 v["mission_time_s"].get<double>(), fmt::join(actions, " > "));
  for (const nlohmann::json& c : v["complaints"]) text += fmt::format("      {}\n", c.get<std::string>());
  if (!v["files"].empty())
    text += fmt::format("      written: {}\n", fmt::join(v["files"].get<std::vector<std::string>>(), " "));
  if (v.contains("commands"))
    for (const nlohmann::json& c : v["commands"]) text += fmt::format("      $ {}\n", c.get<std::string>());
  return text;
}

void refuse_lost_logs(const std::vector<nlohmann::json>& verdicts) {
  for (const nlohmann::json& v : verdicts)
    if (v.contains("log_error")) throw InputError(v["log_error"].get<std::string>());
}

void print_now(const std::string& text) {
  fmt::print("{}", text);
  if (std::fflush(stdout) != 0) throw std::system_error(errno, std::generic_category());
}

}  // namespace roborun::app
