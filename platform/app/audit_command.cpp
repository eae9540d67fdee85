#include "platform/app/audit_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/audit_run.hpp"
#include "platform/mission/settings_file.hpp"
#include "platform/report/trace_csv.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::app {
namespace {

struct AuditOptions {
  double seconds{60.0};
  int rate_Hz{400};
  std::string env{"14"};
  std::uint64_t seed{1};
  std::string profile{"host"};
  std::string vehicle{"paper"};
  std::string settings;
  bool load{false};
  bool json{false};
  bool best_effort{false};
  std::string html;
  std::string trace;
  std::vector<std::string> compare;
  double tolerance_ratio{1.5};
  std::string spin;
  std::vector<std::string> can;
  std::vector<std::string> kill_lines;
  bool active_low{false};
  bool pull_up{false};
  bool props_off{false};
};

int compare(const AuditOptions& options) {
  if (!(options.tolerance_ratio >= 1.0 && options.tolerance_ratio <= 100.0))
    throw InputError(
        fmt::format("--tolerance: {} is out of range: must be from 1 to 100", options.tolerance_ratio));
  constexpr std::string_view kWanted = "a file that roborun audit --json printed";
  const std::string before = input::read_text(options.compare[0], kWanted);
  const std::string after = input::read_text(options.compare[1], kWanted);
  report::Comparison result;
  try {
    result = report::compare_audits(before, after, options.tolerance_ratio);
  } catch (const std::invalid_argument& error) {
    throw InputError(
        fmt::format("--compare: {} or {} {}", options.compare[0], options.compare[1], error.what()));
  }
  fmt::print("{:<34} {:>12} {:>12}\n{}", "", "before", "after", result.table);
  for (const std::string& note : result.notes) fmt::print("note: {}\n", note);
  fmt::print("{}\n",
             result.worse.empty() ? "no regression" : fmt::format("{} regressions", result.worse.size()));
  return result.worse.empty() ? 0 : 1;
}

/// SLOT:MILLISECONDS, in every run of the slot from the 400th of the flight lane or the 5th of others on.
std::optional<mission::Injection> injection_of(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::size_t colon = text.find(':');
  char* end = nullptr;
  const double ms = colon == std::string::npos ? 0.0 : std::strtod(text.c_str() + colon + 1, &end);
  for (const core::SlotSpec& spec : core::kFrameTable) {
    if (colon == std::string::npos || text.substr(0, colon) != spec.name || end == nullptr || *end != '\0' ||
        !(ms > 0.0 && ms <= 3.6e6))
      continue;
    const std::uint64_t from = spec.lane == core::LaneId::kFlight ? 400 : 5;
    return mission::Injection{spec.id, from_seconds(1e-3 * ms), from, UINT64_MAX, false};
  }
  throw InputError(
      fmt::format("--inject-spin: '{}' must be SLOT:MILLISECONDS, with a slot of the frame table", text));
}

int audit(const AuditOptions& options) {
  if (!options.compare.empty()) return compare(options);
  if (!options.can.empty() && !options.props_off)
    throw InputError("--can: real ESCs on that bus would turn: take the propellers off and say --props-off");
  if (!(options.seconds >= 1.0 && options.seconds <= 86400.0))
    throw InputError(fmt::format("--seconds: {} is out of range: must be from 1 to 86400", options.seconds));
  if (!core::is_flight_rate(options.rate_Hz))
    throw InputError(
        fmt::format("--rate: {} Hz: must be 100 to 400 Hz with a minor frame of whole microseconds: 100, "
                    "125, 160, 200, 250, "
                    "320 or 400",
                    options.rate_Hz));
  mission::RealTimeConfig config;
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(options.vehicle);
  mission::set_vehicle(config.mission, vehicle);
  std::vector<std::string> inputs = vehicle.patterns;
  for (const std::string& path : {options.vehicle, options.settings, options.profile}) inputs.push_back(path);
  if (options.profile == "host") inputs.push_back(board::default_host_path({}));
  input::check_outputs({{"--html", options.html}, {"--trace", options.trace}}, inputs);
  if (!options.settings.empty()) mission::load_settings(options.settings, config.mission);
  config.inject = injection_of(options.spin);
  const sitl::NamedEnvironment environment = sitl::environment(options.env);
  const sitl::World world = sitl::generate(environment.knobs, sitl::Mission::kPackageDelivery, options.seed);
  // Last, after everything that may be refused: the first time this measures the machine.
  std::string note;
  const board::Profile profile = options.profile == "host"
                                     ? board::host(board::default_host_path({}), {}, 1.0, note)
                                     : board::load_profile(options.profile, {});
  if (!note.empty()) fmt::print(stderr, "roborun: {}\n", note);
  config.mission.flight.costs = profile.costs;
  config.mission.flight.model = profile.model;
  config.mission.seed = options.seed;
  config.mission.flight.minor_frame = core::minor_frame_of(options.rate_Hz);
  config.seconds = options.seconds;
  config.best_effort = options.best_effort;
  config.load = options.load;
  config.trace = !options.trace.empty();
  if (!options.can.empty()) config.can = {options.can[0], options.can[1]};
  if (!options.kill_lines.empty()) {
    const auto bias = options.pull_up ? firmware_if::GpioBias::kPullUp : firmware_if::GpioBias::kNone;
    config.kill = {gpio::LineConfig{options.kill_lines[0], options.active_low, bias},
                   gpio::LineConfig{options.kill_lines[1], options.active_low, bias}};
  }
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const report::AuditReport result = mission::run_real_time(world, config, [&](double done_s) {
    if (terminal) fmt::print(stderr, "\raudit {:3.0f} of {:.0f} s   ", done_s, options.seconds);
  });
  if (terminal) fmt::print(stderr, "\r{:40}\r", "");
  for (const std::string& why : result.missing) fmt::print(stderr, "roborun: not real time: {}\n", why);
  if (options.json)
    fmt::print("{}\n", report::to_json(result));
  else
    fmt::print("{}", report::audit_table(result));
  if (!options.html.empty()) input::write_file(options.html, report::audit_html(result));
  if (!options.trace.empty()) input::write_file(options.trace, report::perfetto_trace(result));
  const bool clean = result.heap_calls_after_start == 0 && report::minor_faults(result) == 0 &&
                     report::major_faults(result) == 0 && result.stopped_by.empty();
  return clean ? 0 : 1;
}

}  // namespace

void add_audit_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<AuditOptions>();
  CLI::App* command = app.add_subcommand(
      "audit", "Fly in real time on simulated sensors, and report time and memory, slot by slot");
  command->footer(
      "Examples:\n"
      "  roborun audit                                  60 s, a table\n"
      "  roborun audit --seconds 600 --load --html audit.html --trace audit.json\n"
      "  roborun audit --json > today.json; roborun audit --compare yesterday.json today.json\n\n"
      "Exit code: 0 no heap call and no page fault in the real-time lanes (with --compare: no regression), 1 "
      "there "
      "was one, 2 bad input, or no real time to be had here.");
  command->add_option("--seconds", options->seconds, "How long, 1 .. 86400")->capture_default_str();
  command
      ->add_option("--rate", options->rate_Hz, "Of the flight lane, Hz: 100, 125, 160, 200, 250, 320 or 400")
      ->capture_default_str();
  command->add_option("--env", options->env, "Environment to fly in: 1 .. 27, or a name")
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of world, noise, wind and planner")
      ->capture_default_str();
  command
      ->add_option("--profile", options->profile,
                   "What the governor expects stages to cost: paper, host (measured once), or a file of "
                   "roborun calibrate")
      ->capture_default_str();
  command
      ->add_option("--vehicle", options->vehicle,
                   "Vehicle: a shipped one (roborun vehicle list), or a vehicle file")
      ->capture_default_str();
  command->add_option("--settings", options->settings,
                      "TOML file: cameras, wind, battery, fence (see platform/README.md)");
  command->add_flag("--load", options->load, "With stress-ng on all CPUs meanwhile");
  command->add_flag("--best-effort", options->best_effort,
                    "Where real time is not to be had, run on without, and say so in the report");
  command->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  command->add_option("--html", options->html, "Write the report as one HTML file with plots");
  command->add_option("--trace", options->trace,
                      "Write every slot of every frame for Perfetto (ui.perfetto.dev)");
  command->add_option("--compare", options->compare, "Two JSON files, before and after: what became worse")
      ->expected(2);
  command
      ->add_option("--tolerance", options->tolerance_ratio,
                   "With --compare: worse is more than so many times")
      ->capture_default_str();
  command
      ->add_option(
          "--can", options->can,
          "Two CAN interfaces on one wire: motor commands go from the first one to simulated ESCs on the "
          "second one")
      ->expected(2)
      ->delimiter(',');
  command->add_flag("--props-off", options->props_off,
                    "With --can: no propeller is on any motor of that bus");
  auto* kill_lines = command->add_option(
      "--kill-lines", options->kill_lines,
      "A kill switch on lines of this machine: normally open and normally closed contact, each a name or "
      "CHIP:OFFSET. Does not begin unless it stands on run; stops the motors when it does not any more");
  kill_lines->expected(2)->delimiter(',');
  command
      ->add_flag("--active-low", options->active_low,
                 "With --kill-lines: a closed contact pulls its line low")
      ->needs(kill_lines);
  command->add_flag("--pull-up", options->pull_up, "With --kill-lines: switch on the pull-up of the lines")
      ->needs(kill_lines);
  command->add_option("--inject-spin", options->spin,
                      "A fault: SLOT:MILLISECONDS, busy in every run of that slot from the 400th (flight "
                      "lane) or the 5th on");
  command->callback([options, &run] { run = [options] { return audit(*options); }; });
}

}  // namespace roborun::app
