#include "platform/app/sweep_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <thread>

#include "core/record/state_hash.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/board/backends.hpp"
#include "platform/evaluation/suite.hpp"
#include "platform/evaluation/sweep_run.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/settings_file.hpp"
#include "platform/report/build_identity.hpp"
#include "platform/report/evaluation_table.hpp"
#include "platform/report/suite_summary.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::app {
namespace {

struct SweepOptions {
  std::string suite{"paper27"};
  std::string environments;
  std::string mission{"package_delivery"};
  std::string worlds;
  std::optional<std::string> designs;
  std::optional<std::string> profiles;
  std::string seeds{"1"};
  std::string map{"own"};
  std::string planner{"own"};
  std::optional<std::string> vehicles;
  std::string settings;
  std::string aim;
  std::string jobs{std::to_string(std::max(1U, std::thread::hardware_concurrency()))};
  std::string shard{"1/1"};
  std::string out{"out/sweep"};
  bool json{false};
  std::vector<std::string> merged;
};

std::string profile_digest(const board::Profile& profile) {
  core::StateHash hash;
  for (const core::StageCost& cost : profile.costs.stage) {
    for (const double s : cost.fixed_s) hash.add(s);
    for (const double s : cost.per_m3_s) hash.add(s);
    hash.add(cost.per_unit_s);
  }
  for (const governor::LatencyModel& model : profile.model) {
    for (const double s : model.fixed_s) hash.add(s);
    for (const double s : model.slope_s_per_m3) hash.add(s);
  }
  return fmt::format("{:016x}", hash.value());
}

constexpr std::size_t kMostProgram_bytes = 1U << 30U;

std::string program_digest() {
  return evaluation::digest_of(input::read_text("/proc/self/exe", "this program", kMostProgram_bytes));
}

void set_shard(const std::string& text, evaluation::SweepPlan& plan) {
  constexpr int kMost = 10000;
  const std::size_t slash = text.find('/');
  const auto count =
      slash == std::string::npos ? std::nullopt : input::whole_number(text.substr(slash + 1), 1, kMost);
  const auto index = count ? input::whole_number(text.substr(0, slash), 1, *count) : std::nullopt;
  if (!index)
    throw InputError(fmt::format(
        "--shard: '{}' is not a shard: must be I/N with 1 <= I <= N <= {}, as in 2/4", text, kMost));
  plan.shard = *index;
  plan.shards = *count;
}

std::vector<std::string> parts_of(const std::string& text) {
  return text.empty() ? std::vector<std::string>{} : input::split(text);
}

/// Environments of the suite, and what flies in them.
void set_environments(const SweepOptions& options, evaluation::SweepPlan& plan,
                      evaluation::SweepInputs& inputs) {
  const bool suite = evaluation::is_suite(options.suite);
  if (!suite && options.suite != plan.suite)
    throw InputError(
        fmt::format("--suite: unknown suite '{}': must be paper27, hard or foreign", options.suite));
  if ((options.suite == "foreign") != !options.worlds.empty())
    throw InputError("--worlds: must be the folder of the files of --suite foreign, and goes with it alone");
  plan.suite = options.suite;
  inputs.worlds = options.worlds;
  std::vector<std::string> vehicles;
  if (options.vehicles) vehicles = input::split(*options.vehicles);
  refuse_twice("--vehicle", vehicles);
  if (suite) {
    plan.mission = "world";
    plan.environments = evaluation::suite_environments(plan.suite, parts_of(options.environments), vehicles);
    vehicles.clear();
    for (const std::string& e : plan.environments) vehicles.push_back(evaluation::vehicle_of_environment(e));
    std::sort(vehicles.begin(), vehicles.end());
    vehicles.erase(std::unique(vehicles.begin(), vehicles.end()), vehicles.end());
    std::string digests;
    for (const std::string& file : evaluation::suite_files(plan.suite, inputs.worlds, plan.environments)) {
      digests += evaluation::digest_of(input::read_text(file, "a world of the suite"));
      inputs.files.push_back(file);
    }
    if (!digests.empty()) plan.worlds = evaluation::digest_of(digests);
  } else {
    (void)sitl::mission_of(options.mission);
    plan.mission = options.mission;
    std::vector<int> numbers;
    for (const std::string& name : parts_of(options.environments))
      numbers.push_back(sitl::environment(name).number);
    for (int number = 1; options.environments.empty() && number <= 27; ++number) numbers.push_back(number);
    std::sort(numbers.begin(), numbers.end());
    for (const int number : numbers) plan.environments.push_back(std::to_string(number));
    if (vehicles.empty()) vehicles.emplace_back("paper");
    if (vehicles.size() > 1)
      throw InputError(fmt::format("--vehicle: '{}': must be one: several go with --suite hard or foreign",
                                   *options.vehicles));
  }
  for (const std::string& name : vehicles) {
    const vehicle::Vehicle vehicle = vehicle::load_vehicle(name);
    mission::MissionConfig& base = inputs.base[suite ? name : std::string{}];
    mission::set_vehicle(base, vehicle);
    if (!options.settings.empty()) mission::load_settings(options.settings, base);
    if (!options.aim.empty()) base.flight.aim = mission::aim_of("--aim", options.aim);
    plan.vehicle += fmt::format("{}{} {}", plan.vehicle.empty() ? "" : ", ", vehicle.name, vehicle.digest);
    inputs.files.insert(inputs.files.end(), vehicle.patterns.begin(), vehicle.patterns.end());
    inputs.files.push_back(name);
  }
  plan.aim = options.aim;
  inputs.files.push_back(options.settings);
  if (!options.settings.empty())
    plan.settings = evaluation::digest_of(input::read_text(options.settings, "a readable TOML file"));
}

evaluation::SweepPlan plan_of(const SweepOptions& options, evaluation::SweepInputs& inputs) {
  evaluation::SweepPlan plan;
  set_environments(options, plan, inputs);
  const bool suite = evaluation::is_suite(plan.suite);
  plan.designs = input::split(options.designs.value_or(suite ? "aware" : "aware,static,static-fair"));
  for (const std::string& name : plan.designs) (void)mission::design_of("--designs", name);
  for (const std::string& text : input::split(options.seeds))
    plan.seeds.push_back(input::seed_of("--seeds", text));
  refuse_twice("--environments", plan.environments);
  refuse_twice("--designs", plan.designs);
  refuse_twice("--seeds", plan.seeds);
  set_shard(options.shard, plan);
  plan.map = options.map;
  plan.planner = options.planner;
  if (board::uses_plugin({plan.map, plan.planner}))
    throw InputError(
        "--map, --planner: a sweep goes on later, when a plugin may be another: must be those that ship");
  std::vector<std::string> names;
  for (const std::string& text : input::split(options.profiles.value_or(suite ? "host" : "paper"))) {
    const board::Profile profile = board::load_profile(text, {plan.map, plan.planner});
    inputs.files.push_back(text);
    // Machines of a cluster keep the same file in different folders.
    const std::string name = std::filesystem::path(text).stem().string();
    names.push_back(name);
    plan.profiles.push_back({name, profile_digest(profile)});
    inputs.profile[name] = profile;
  }
  refuse_twice("--profile", names);
  plan.commit = report::build_identity().commit;
  plan.build = program_digest();
  return plan;
}

/// What is below the table: how many are missing, and where the report is.
void tell_rest(const evaluation::SweepStore& store, std::size_t done, const char* what, bool report) {
  const std::size_t all = store.missions().size();
  if (!store.complete()) fmt::print("{} of {} {} are missing\n", all - done, all, what);
  if (report) fmt::print("report: {}/report.html\n", store.folder());
}

/// With commands that name the folder of the worlds.
void tell_suite(const evaluation::SweepStore& store, const SweepOptions& options) {
  const evaluation::SweepPlan& plan = store.plan();
  std::vector<report::MissionResult> flights = store.results();
  const bool report = plan.shards == 1 && !flights.empty();
  if (report) evaluation::write_suite_report(store, flights);
  for (report::MissionResult& r : flights) {
    const std::size_t at = r.suite->command.find(evaluation::kFolderMark);
    if (at == std::string::npos || options.worlds.empty()) continue;
    r.suite->command.replace(at, std::string_view(evaluation::kFolderMark).size(), options.worlds + "/");
  }
  if (options.json) {
    fmt::print("{}\n", report::suite_json(plan.suite, flights, store.complete()));
    return;
  }
  fmt::print("{}", report::suite_table(flights));
  tell_rest(store, flights.size(), "flights", report);
}

void tell(const evaluation::SweepStore& store, const SweepOptions& options) {
  if (evaluation::is_suite(store.plan().suite)) {
    tell_suite(store, options);
    return;
  }
  const std::vector<report::SweepRow> rows = evaluation::rows_of(store);
  const evaluation::SweepPlan& plan = store.plan();
  // The report is of the whole sweep: `merge` writes it for shards.
  const bool report = plan.shards == 1 && !rows.empty();
  if (report) evaluation::write_sweep_report(store);
  if (options.json) {
    fmt::print("{}\n", report::sweep_json(plan.suite, rows, store.complete()));
    return;
  }
  fmt::print("{}", report::sweep_table(rows));
  tell_rest(store, rows.size(), "missions", report);
}

int sweep(const SweepOptions& options) {
  evaluation::SweepInputs inputs;
  const evaluation::SweepPlan plan = plan_of(options, inputs);
  const int jobs = input::jobs_of(options.jobs);
  evaluation::try_sweep(plan, inputs);
  evaluation::check_folder(options.out, inputs.files);
  evaluation::SweepStore store(options.out, plan);
  const bool complete = evaluation::fly_sweep(store, inputs, jobs);
  tell(store, options);
  constexpr const char* kKept = "what was flown is kept: the same command goes on from there";
  if (input::StopOnSignal::requested()) throw input::Interrupted(kKept);
  if (!complete) fmt::print(stderr, "roborun: not all was flown; {}\n", kKept);
  return complete ? kDone : kNotGood;
}

int merge(const SweepOptions& options) {
  // The report is made here: it must come from the sources that flew. A commit names them if nothing was changed;
  // then another machine's program may have flown.
  const evaluation::SweepPlan flown = evaluation::plan_of_folder(options.merged.front());
  const bool named = flown.commit.size() == 40;
  if (flown.commit != report::build_identity().commit || (!named && flown.build != program_digest()))
    throw InputError(fmt::format(
        "{}: was flown by commit {}, program {}; this is of {}, {}: must be merged by the program that flew",
        options.merged.front(), flown.commit.empty() ? "unknown" : flown.commit, flown.build,
        report::build_identity().commit, program_digest()));
  evaluation::merge_shards(options.merged, options.out);
  const evaluation::SweepStore store(options.out, evaluation::plan_of_folder(options.out));
  tell(store, options);
  return store.complete() ? kDone : kNotGood;
}

int compare(const SweepOptions& options) {
  std::vector<report::SweepRow> rows;
  std::string sources;
  for (const std::string& folder : options.merged) {
    const evaluation::SweepStore store(folder, evaluation::plan_of_folder(folder));
    if (evaluation::is_suite(store.plan().suite))
      throw InputError(fmt::format("{}: is of the suite {}: must be of paper27", folder, store.plan().suite));
    const std::string& commit = store.plan().commit;
    sources += fmt::format("{}: commit {}, program {}\n", folder, commit.empty() ? "unknown" : commit,
                           store.plan().build);
    for (report::SweepRow& row : evaluation::rows_of(store)) rows.push_back(std::move(row));
  }
  fmt::print("{}\n{}", report::kernel_table(rows), sources);
  return kDone;
}

void add_compare_command(CLI::App& sweep_app, const std::shared_ptr<SweepOptions>& options,
                         std::function<int()>& run) {
  CLI::App* compare_app = sweep_app.add_subcommand(
      "compare", "Tell what awareness gains from what faster code gains: one table of several sweeps");
  compare_app->footer(
      "Example:\n"
      "  roborun sweep --designs static-fair,aware --profile paper,cortex-a72,host --out out/own\n"
      "  roborun sweep --designs static-fair,aware --profile paper,cortex-a72,host --map octomap \\\n"
      "                --planner ompl:RRTstar --out out/stock\n"
      "  roborun sweep compare out/stock out/own");
  compare_app->add_option("folders", options->merged, "Folders of sweeps")->required();
  compare_app->callback([options, &run] { run = [options] { return compare(*options); }; });
}

void add_merge_command(CLI::App& sweep_app, const std::shared_ptr<SweepOptions>& options,
                       std::function<int()>& run) {
  CLI::App* merge_app =
      sweep_app.add_subcommand("merge", "Make one sweep of the folders that --shard runs wrote");
  merge_app->footer(
      "Example:\n"
      "  roborun sweep merge out/shard-1 out/shard-2 --out out/whole\n\n"
      "The folder --out is what one run without --shard would have written, byte for byte; missions that no "
      "shard\nhas are flown by that run with the same --out. Exit code: 0 complete, 1 missions missing, 2 "
      "bad "
      "input.");
  merge_app->add_option("folders", options->merged, "Folders of the shards")->required();
  merge_app->add_option("--out", options->out, "Folder of the whole")->required();
  merge_app->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  merge_app->callback([options, &run] { run = [options] { return merge(*options); }; });
}

}  // namespace

void add_sweep_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<SweepOptions>();
  CLI::App* sweep_app = app.add_subcommand("sweep",
                                           "Fly the paper's whole evaluation, or a suite of worlds: "
                                           "environments x profiles x designs x seeds, in parallel");
  sweep_app->footer(
      "Examples:\n"
      "  roborun sweep                                      27 environments, three designs, one seed\n"
      "  roborun sweep --seeds 1,2,3,4 --designs aware      collisions and intervals of one design\n"
      "  roborun sweep --environments 1,14,27 --profile paper,out/board.toml\n"
      "  roborun sweep --shard 2/4 --out out/shard-2        the second quarter, on another machine\n"
      "  roborun sweep merge out/shard-* --out out/whole\n"
      "  roborun sweep compare out/stock out/own            what awareness gains, and what faster code "
      "gains\n"
      "  roborun sweep --suite hard --seeds 1,2,3 --json    mazes, traps, forests, ...: who arrives, by how "
      "long a "
      "way\n"
      "  roborun sweep --suite foreign --worlds DIR --environments eth-0,eth-1 --seeds 1,2,3,4,5\n\n"
      "Suite hard makes its worlds from the seed. Suite foreign flies files of MIGHTY, FASTER and ETH "
      "(platform/sitl/README.md);\n"
      "seed N takes the N-th pair of start and goal that a world has, and begins again after the last.\n\n"
      "The folder --out holds request.json, results.jsonl (one line per mission) and report.html (tables "
      "and\n"
      "pictures, opens offline). Stopped by Ctrl-C or power loss, the same command goes on. Results do not\n"
      "depend on --jobs, machine or order. A folder holds the flights of one commit: another one is "
      "refused.\n"
      "Exit code: 0 every mission was flown (whether it reached the goal is in the table), 1 a flight's "
      "process died,\n2 bad input, 130 stopped.");
  sweep_app->add_option("--suite", options->suite, "Set of environments: paper27, hard or foreign")
      ->capture_default_str();
  sweep_app->add_option("--worlds", options->worlds, "Folder of the files of --suite foreign");
  sweep_app->add_option("--environments", options->environments,
                        "Only these of the suite, by number or name, with commas [all]");
  CLI::Option* mission =
      sweep_app
          ->add_option("--mission", options->mission, "With paper27: package_delivery or search_and_rescue")
          ->capture_default_str();
  sweep_app->add_option("--designs", options->designs,
                        "Any of aware, static, static-fair, with commas [all; of hard and foreign: aware]");
  sweep_app->add_option(
      "--profile", options->profiles,
      "What computing costs: paper (the authors' machine), host (this one), cortex-a72 (an "
      "estimate), or files of roborun calibrate; several with commas [paper; of hard and foreign: host]");
  sweep_app->add_option("--seeds", options->seeds, "Whole numbers with commas")->capture_default_str();
  sweep_app->add_option("--map", options->map, "own or octomap")->capture_default_str();
  sweep_app
      ->add_option("--planner", options->planner,
                   "own, ompl:RRTstar, ompl:InformedRRTstar, ompl:RRTConnect, ompl:BITstar")
      ->capture_default_str();
  sweep_app->add_option(
      "--vehicle", options->vehicles,
      "A shipped vehicle (roborun vehicle list; NAME-six: with six cameras all round), or a vehicle file; of "
      "hard "
      "and foreign several with commas [paper; hard: paper,micro-six; foreign: of the authors' size]");
  sweep_app->add_option("--settings", options->settings,
                        "Cameras, wind, battery, speed from a TOML file (see platform/README.md)");
  sweep_app->add_option("--aim", options->aim, fmt::format("{} [that of --settings, or time]", kAimText));
  sweep_app->add_option("--jobs", options->jobs, "Missions at a time, 1 .. 1024")->capture_default_str();
  sweep_app->add_option("--shard", options->shard, "I/N: only the I-th of N equal parts")
      ->capture_default_str();
  sweep_app->add_option("--out", options->out, "Folder of the results")->capture_default_str();
  sweep_app->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  add_merge_command(*sweep_app, options, run);
  add_compare_command(*sweep_app, options, run);
  sweep_app->callback([options, &run, sweep_app, mission] {
    refuse_alone(*mission, options->suite == "paper27", "--suite paper27");
    if (sweep_app->get_subcommands().empty()) run = [options] { return sweep(*options); };
  });
}

}  // namespace roborun::app
