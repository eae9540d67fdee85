#include "platform/app/audit_command.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/audit_run.hpp"
#include "platform/mission/settings_file.hpp"
#include "platform/report/audit_compare.hpp"
#include "platform/report/audit_verdict.hpp"
#include "platform/report/instruction_counts.hpp"
#include "platform/report/sha256.hpp"
#include "platform/rt/confinement.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::app {
namespace {

struct AuditOptions {
  double seconds{60.0};
  int rate_Hz{400};
  std::string env{"14"};
  std::string seed{"1"};
  std::string profile{"host"};
  std::string vehicle{"paper"};
  std::string settings;
  bool load{false};
  bool json{false};
  bool best_effort{false};
  std::string html;
  std::string trace;
  std::string log;
  std::string samples;
  std::string instructions;
  std::vector<std::string> require;
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
  const auto side = [](const std::string& names) {
    std::vector<std::string> texts;
    for (const std::string& name : input::split(names))
      texts.push_back(input::read_text(name, "a file that roborun audit --json printed"));
    return texts;
  };
  report::Comparison result;
  try {
    result =
        report::compare_audits(side(options.compare[0]), side(options.compare[1]), options.tolerance_ratio);
  } catch (const std::invalid_argument& error) {
    throw InputError(
        fmt::format("--compare: {} or {} {}", options.compare[0], options.compare[1], error.what()));
  }
  if (!result.not_comparable.empty())
    throw InputError(fmt::format(
        "--compare: not of the same flight or program: {}: must be audits that differ in what is to be "
        "compared alone",
        fmt::join(result.not_comparable, "; ")));
  fmt::print("{}", result.table);
  for (const std::string& note : result.notes) fmt::print("note: {}\n", note);
  fmt::print("{}\n",
             result.worse.empty() ? "no regression" : fmt::format("{} regressions", result.worse.size()));
  return result.worse.empty() ? kDone : kNotGood;
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

std::vector<report::Requirement> requirements(const AuditOptions& options) {
  std::vector<std::string> texts;
  for (const std::string& list : options.require) {
    for (std::string& text : input::split(list)) texts.push_back(std::move(text));
  }
  try {
    return report::requirements_of(texts);
  } catch (const std::invalid_argument& error) {
    throw InputError(fmt::format("--require: {}", error.what()));
  }
}

/// As it was typed.
std::string command_line() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::string line;
  for (std::string word; std::getline(file, word, '\0');)
    line += (line.empty() ? "" : " ") + input::shell_word(word);
  return line;
}

/// What flies the same again, but for its length and what is written.
std::string same_flight(const AuditOptions& o) {
  std::string line = fmt::format("roborun audit --env {} --seed {} --rate {} --profile {} --vehicle {}",
                                 input::shell_word(o.env), o.seed, o.rate_Hz, input::shell_word(o.profile),
                                 input::shell_word(o.vehicle));
  if (!o.settings.empty()) line += " --settings " + input::shell_word(o.settings);
  if (o.load) line += " --load";
  if (o.best_effort) line += " --best-effort";
  if (!o.can.empty())
    line += fmt::format(" --can {},{} --props-off", input::shell_word(o.can[0]), input::shell_word(o.can[1]));
  if (!o.kill_lines.empty())
    line += fmt::format(" --kill-lines {},{}{}{}", input::shell_word(o.kill_lines[0]),
                        input::shell_word(o.kill_lines[1]), o.active_low ? " --active-low" : "",
                        o.pull_up ? " --pull-up" : "");
  if (!o.spin.empty()) line += " --inject-spin " + input::shell_word(o.spin);
  return line;
}

std::string digest_of_file(const std::string& path) { return "sha256 " + report::sha256_of_file(path); }

/// What was asked for, in front of what the run says of itself.
void identify(const AuditOptions& options, const sitl::NamedEnvironment& environment,
              const vehicle::Vehicle& vehicle, report::AuditReport& result) {
  const bool is_shipped = vehicle::ships(options.vehicle);
  const bool in_program = options.profile == "paper" || options.profile == "cortex-a72";
  const std::string profile = options.profile == "host" ? board::default_host_path({}) : options.profile;
  std::vector<std::pair<std::string, std::string>> asked{
      {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
      {"command", command_line()},
      {"environment", fmt::format("{} {}", environment.number, environment.name)},
      {"profile", options.profile},
      {"profile_digest", in_program ? "in the program" : digest_of_file(profile)},
      {"vehicle", vehicle.name},
      {"vehicle_digest", is_shipped ? "in the program, " + vehicle.digest : digest_of_file(options.vehicle)},
      {"settings", options.settings.empty() ? "defaults" : options.settings},
      {"settings_digest", options.settings.empty() ? "in the program" : digest_of_file(options.settings)}};
  result.identity.insert(result.identity.begin(), asked.begin(), asked.end());
}

/// Everything that can be refused without a look at the machine.
void check(const AuditOptions& options) {
  if (!options.can.empty() && !options.props_off)
    throw InputError("--can: real ESCs on that bus would turn: take the propellers off and say --props-off");
  if (!core::is_flight_rate(options.rate_Hz))
    throw InputError(
        fmt::format("--rate: {} Hz: must be 100 to 400 Hz with a minor frame of whole microseconds: 100, "
                    "125, 160, 200, 250, "
                    "320 or 400",
                    options.rate_Hz));
}

std::optional<report::InstructionCounts> instructions_of(const std::string& path) {
  if (path.empty()) return std::nullopt;
  try {
    return report::instruction_counts(input::read_text(path, "counts of toolchain/bench/run instructions"));
  } catch (const std::invalid_argument& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
}

/// Puts the counts beside the measured times.
void add(const report::InstructionCounts& counts, const std::string& path, report::AuditReport& result) {
  result.identity.emplace_back("instructions",
                               fmt::format("{} of commit {}, {}", path, counts.commit, digest_of_file(path)));
  for (report::AuditSlot& slot : result.slots)
    if (const auto found = counts.worst.find(slot.name); found != counts.worst.end())
      slot.instructions = found->second;
}

void write_files(const AuditOptions& options, const report::AuditReport& result) {
  if (!options.html.empty()) input::write_file(options.html, report::audit_html(result));
  if (!options.trace.empty()) input::write_file(options.trace, report::perfetto_trace(result));
  if (!options.samples.empty()) input::write_file(options.samples, report::sample_file(result));
}

int audit(const AuditOptions& options) {
  if (!options.compare.empty()) return compare(options);
  check(options);
  const std::vector<report::Requirement> required = requirements(options);
  const std::optional<report::InstructionCounts> counts = instructions_of(options.instructions);
  mission::RealTimeConfig config;
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(options.vehicle);
  mission::set_vehicle(config.mission, vehicle);
  std::vector<std::string> inputs = vehicle.patterns;
  for (const std::string& path : {options.vehicle, options.settings, options.profile, options.instructions})
    inputs.push_back(path);
  if (options.profile == "host") inputs.push_back(board::default_host_path({}));
  input::check_outputs({{"--html", options.html},
                        {"--trace", options.trace},
                        {"--samples", options.samples},
                        {"--log", options.log}},
                       inputs);
  if (!options.settings.empty()) mission::load_settings(options.settings, config.mission);
  config.inject = injection_of(options.spin);
  const sitl::NamedEnvironment environment = sitl::environment(options.env);
  const std::uint64_t seed = input::seed_of("--seed", options.seed);
  const sitl::World world = sitl::generate(environment.knobs, sitl::Mission::kPackageDelivery, seed);
  config.mission.seed = seed;
  config.mission.log = options.log;
  config.mission.profile_name = options.profile;
  config.mission.flight.minor_frame = core::minor_frame_of(options.rate_Hz);
  config.seconds = options.seconds;
  config.best_effort = options.best_effort;
  config.load = options.load;
  config.trace = !options.trace.empty() || !options.samples.empty();
  if (config.trace && mission::traced_bytes(config) > mission::kMostTraced_bytes)
    throw InputError(fmt::format(
        "--seconds: {} s take {} MiB of --trace or --samples: must be {} MiB at most", options.seconds,
        mission::traced_bytes(config) >> 20U, mission::kMostTraced_bytes >> 20U));
  // Last, after everything that may be refused: the first time this measures the machine.
  std::string note;
  const board::Profile profile = options.profile == "host"
                                     ? board::host(board::default_host_path({}), {}, 1.0, note)
                                     : board::load_profile(options.profile, {});
  if (!note.empty()) fmt::print(stderr, "roborun: {}\n", note);
  config.mission.flight.costs = profile.costs;
  config.mission.flight.model = profile.model;
  if (!options.can.empty()) config.can = {options.can[0], options.can[1]};
  if (!options.kill_lines.empty()) {
    const auto bias = options.pull_up ? firmware_if::GpioBias::kPullUp : firmware_if::GpioBias::kNone;
    config.kill = {gpio::LineConfig{options.kill_lines[0], options.active_low, bias},
                   gpio::LineConfig{options.kill_lines[1], options.active_low, bias}};
  }
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const input::StopOnSignal stop;
  (void)std::signal(SIGPIPE, SIG_IGN);  // who reads what is said may go: the flight does not end for it
  config.stop = &input::StopOnSignal::requested;
  if (const std::string kept = rt::drop_capabilities(); !kept.empty())
    fmt::print(stderr, "roborun: {}\n", kept);
  config.confine = rt::confine;
  report::AuditReport result = mission::run_real_time(world, config, [&](double done_s) {
    if (terminal) fmt::print(stderr, "\raudit {:3.0f} of {:.0f} s   ", done_s, options.seconds);
  });
  if (terminal) fmt::print(stderr, "\r{:40}\r", "");
  for (const std::string& why : result.missing) fmt::print(stderr, "roborun: not real time: {}\n", why);
  identify(options, environment, vehicle, result);
  if (counts) add(*counts, options.instructions, result);
  result.requirements = report::judge(result, required);
  const std::string again = same_flight(options);
  for (report::AuditSlot& slot : result.slots)
    if (slot.time.count > 0)
      slot.longest.again = fmt::format("{} --seconds {:.0f} --trace worst.json", again,
                                       std::ceil(seconds(slot.longest.cause.at.time_since_epoch())) + 1.0);
  if (options.json)
    fmt::print("{}\n", report::to_json(result));
  else
    fmt::print("{}", report::audit_table(result));
  write_files(options, result);
  if (result.interrupted)
    throw input::Interrupted(fmt::format("audit after {:.0f} of {:.0f} s; the report is of that time",
                                         result.seconds, options.seconds));
  return report::passes(result) ? kDone : kNotGood;
}

}  // namespace

void add_audit_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<AuditOptions>();
  CLI::App* command = app.add_subcommand(
      "audit", "Fly in real time on simulated sensors, and report time and memory, slot by slot");
  command->footer(
      "Examples:\n"
      "  roborun audit                                  60 s, a verdict and tables\n"
      "  roborun audit --require flight.misses=2,jitter_p999_us=100\n"
      "  roborun audit --seconds 600 --load --html audit.html --trace audit.json --samples audit.npy\n"
      "  roborun audit --json > today.json; roborun audit --compare yesterday.json today.json\n"
      "  roborun audit --compare a1.json,a2.json,a3.json b1.json,b2.json,b3.json\n\n" +
      report::requirement_help() +
      "\nWhat cannot be shown (a percentile of too few frames, a run without what real time needs) is a "
      "FAIL.\n"
      "Exit code: 0 PASS (with --compare: no regression), 1 FAIL (a regression), 2 bad input, or no real "
      "time to be had here,\n130 Ctrl-C, SIGTERM or a closed terminal: the report is of the time until "
      "then.");
  add_number(*command, "--seconds", options->seconds, 1.0, 86400.0, "How long, 1 .. 86400");
  command
      ->add_option("--rate", options->rate_Hz,
                   "Rate of the flight lane, Hz: 100, 125, 160, 200, 250, 320 or 400")
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
                    "Run also where real time cannot be had, and say so in the report");
  command->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  command->add_option("--html", options->html, "Write the report as one HTML file with plots");
  command->add_option("--trace", options->trace,
                      "Write every slot of every frame for Perfetto (ui.perfetto.dev)");
  command->add_option("--log", options->log,
                      "Write the flight, too, as an MCAP file: roborun report, Foxglove, PlotJuggler");
  command->add_option("--samples", options->samples,
                      "Write every frame and slot as an array of NumPy (numpy.load)");
  command->add_option("--instructions", options->instructions,
                      "Show these counts beside the times: a file of toolchain/bench/run instructions");
  command->add_option("--require", options->require,
                      "NAME=LIMIT,...: FAIL if the value is above the limit (see below)");
  command
      ->add_option(
          "--compare", options->compare,
          "JSON files, before and after: what became worse; three or more per side (A1,A2,A3 B1,B2,B3) tell "
          "it from noise")
      ->expected(2);
  CLI::Option* tolerance =
      add_number(*command, "--tolerance", options->tolerance_ratio, 1.0, 100.0,
                 "With --compare: more than this many times the value before counts as worse");
  command
      ->add_option(
          "--can", options->can,
          "Two CAN interfaces on one wire: motor commands go from the first one to simulated ESCs on the "
          "second one")
      ->expected(2)
      ->delimiter(',');
  CLI::Option* props_off = command->add_flag("--props-off", options->props_off,
                                             "With --can: no propeller is on any motor of that bus");
  auto* kill_lines = command->add_option(
      "--kill-lines", options->kill_lines,
      "A kill switch on lines of this machine: normally open and normally closed contact, each a name or "
      "CHIP:OFFSET. The run does not begin unless the switch stands on run, and stops the motors when it no "
      "longer does");
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
  command->callback([command, options, tolerance, props_off, &run] {
    run = [=] {
      const bool compares = !options->compare.empty();
      refuse_alone(*tolerance, compares, "--compare");
      refuse_alone(*props_off, !options->can.empty(), "--can");
      for (const CLI::Option* option : command->get_options())
        if (option->get_single_name() != "compare" && option != tolerance)
          refuse_alone(*option, !compares, "a flight, not with --compare");
      return audit(*options);
    };
  });
}

}  // namespace roborun::app
