#include "platform/app/fly_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "platform/app/exit_code.hpp"
#include "platform/app/flight_source.hpp"
#include "platform/app/options.hpp"
#include "platform/app/plan_argument.hpp"
#include "platform/app/world_arguments.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/board/plugin_loader.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/scene.hpp"
#include "platform/mission/settings_file.hpp"
#include "platform/mission/work_check.hpp"
#include "platform/report/known_picture.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/report/svg_plot.hpp"
#include "platform/report/table.hpp"
#include "platform/report/trace_csv.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::app {
namespace {

struct FlyOptions {
  FlightSource source;
  std::string design{"aware"};
  std::string seed{"1"};
  std::string map{"own"};
  std::string planner{"own"};
  std::string ways{"own"};
  std::string autopilot{"none"};
  std::string plan;
  std::string host_file;
  double host_factor{1.0};
  std::string log;
  std::string trace;
  std::string plot;
  std::string colour{"speed"};
  bool tune{false};
  bool json{false};
};

std::string host_file_of(const FlyOptions& options) {
  return options.host_file.empty() ? board::default_host_path({options.map, options.planner})
                                   : options.host_file;
}

board::Profile profile_of(const FlyOptions& options) {
  const board::BackendNames backends{options.map, options.planner};
  if (options.source.profile != "host") return board::load_profile(options.source.profile, backends);
  std::string note;
  const board::Profile profile = board::host(host_file_of(options), backends, options.host_factor, note);
  if (!note.empty()) fmt::print(stderr, "roborun: {}\n", note);
  return profile;
}

/// Says where what a part counted of its work is worth less than the time it took (mission/work_check.hpp). False
/// if that part is a plugin: then the flight does not count.
bool believes(const FlyOptions& options, const report::MissionReport& flown) {
  bool believed = true;
  for (const report::WorkRecord& w : flown.work) {
    if (mission::is_believable(w)) continue;
    const std::string& part = w.stage == "planner" ? options.planner : options.map;
    const bool plugin = board::is_plugin(part);
    fmt::print(
        stderr,
        "roborun: {}, {} ({}): took {:.2f} s of this processor, the work that it counted is worth {:.2f} s: "
        "must be at least 1/{:g} of it{}\n",
        flown.result.design, w.stage, part, w.measured_s, w.counted_s, mission::kMostUnderstated,
        plugin ? "; the flight does not count" : "");
    believed = believed && !plugin;
  }
  return believed;
}

/// Lines on what was seen and not believed; none if all was.
std::string words_of_refused(const report::MissionResult& r) {
  std::string text;
  std::string sensor;
  for (const report::RefusedRecord& one : r.refused) {
    text += one.sensor == sensor ? "," : fmt::format("{}  {}:", sensor.empty() ? "" : ";", one.sensor);
    text += fmt::format(" {} {}", one.images, one.reason);
    sensor = one.sensor;
  }
  if (!text.empty()) text = fmt::format("{:<12} refused images{}\n", r.design, text);
  if (r.near_brakes > 0)
    text += fmt::format("{:<12} braked {} times between two decisions for what was near in the way\n",
                        r.design, r.near_brakes);
  if (r.map_drops > 0) text += fmt::format("{:<12} dropped its map {} times\n", r.design, r.map_drops);
  return text;
}

/// Lines on what the failsafe did, if it did anything.
std::string words_of_failsafe(const report::MissionReport& r) {
  std::string text;
  for (const report::FailsafeRecord& action : r.safety.actions)
    text += fmt::format("{:<12} {:.1f} s: {} ({}{}{})\n", r.result.design, action.time_s, action.action,
                        fmt::join(action.conditions, ", "), action.sensor.empty() ? "" : "; ", action.sensor);
  return text;
}

int fly(const FlyOptions& options) {
  // Everything is checked before the first metre is flown.
  std::vector<governor::Design> designs;
  for (const std::string& name : input::split(options.design))
    designs.push_back(mission::design_of("--design", name));
  const auto autopilot = mission::autopilot_of("--autopilot", options.autopilot);
  const std::uint64_t seed = input::seed_of("--seed", options.seed);
  const auto colour =
      std::find(report::kPathColourName.begin(), report::kPathColourName.end(), options.colour);
  const bool maps = options.colour == "all";
  const bool known = options.colour == "known";
  if (colour == report::kPathColourName.end() && !maps && !known)
    throw InputError(fmt::format("--color: unknown colour '{}': must be {}, all or known", options.colour,
                                 fmt::join(report::kPathColourName, ", ")));
  if (!options.log.empty() && designs.size() != 1)
    throw InputError("--log: one flight per file: must go with one --design");
  PreparedFlight flight = prepare(options.source, seed);
  mission::MissionConfig& config = flight.config;
  const sitl::World& world = *flight.world;
  std::vector<std::string> inputs = flight.inputs;
  inputs.push_back(options.plan);
  if (options.source.profile == "host") inputs.push_back(host_file_of(options));
  for (const std::string& name : {options.map, options.planner, options.ways})
    inputs.push_back(name.substr(name.find(':') + 1));  // of a plugin
  input::check_outputs({{"--log", options.log}, {"--trace", options.trace}, {"--plot", options.plot}},
                       inputs);
  if (!options.plan.empty() && !config.goals.empty()) throw InputError("--goal, --plan: must be one of both");
  if (autopilot) config.autopilot = mission::AutopilotChoice{*autopilot, options.tune};
  if (!options.plan.empty()) take_plan(options.plan, config);
  for (const std::string& line : mission::beyond_reach(world, config))
    fmt::print(stderr, "roborun: {}\n", line);
  const board::Profile profile = profile_of(options);
  std::string title = flight.title;
  if (options.source.vehicle != "paper") title += fmt::format(", vehicle {}", options.source.vehicle);
  title += fmt::format(", cost profile {}", options.source.profile);
  if (config.flight.aim == governor::Aim::kEnergy) title += ", aim energy";

  if (options.tune && !autopilot)
    throw InputError("--autopilot-tune: must go with --autopilot px4 or arducopter");
  if (autopilot) title += fmt::format(", flown by a fake {}", options.autopilot);

  config.profile_name = options.source.profile;
  config.flight.costs = profile.costs;
  config.flight.model = profile.model;
  if (options.source.profile == "host")
    config.host_factor = options.host_factor;
  else
    config.host_costs = board::known_host_costs({options.map, options.planner});
  config.keep_known = known;
  config.log = options.log;
  config.backends.map = options.map;
  config.backends.planner = options.planner;
  config.backends.ways = options.ways;
  std::vector<report::MissionReport> reports;
  bool all_reached = true;
  bool all_believed = true;
  const input::StopOnSignal stop;
  for (const governor::Design design : designs) {
    config.flight.design = design;
    report::ProgressLine line;
    config.each_frame = [&](const mission::FrameRecord& frame) {
      if (!input::StopOnSignal::requested()) return;
      throw input::Interrupted(
          fmt::format("{} after {:.0f} s of flight, {:.0f} m from the goal; {} of {} designs flown; {}",
                      governor::to_string(design), seconds(frame.now.time_since_epoch()),
                      (world.goal_W() - frame.truth.p_WB).norm(), reports.size(), designs.size(),
                      options.log.empty() ? "no file was written" : "the log ends there"));
    };
    reports.push_back(mission::fly_mission(world, config, [&line, design](const mission::Progress& p) {
      if (!line.due()) return;
      line.show(fmt::format("{:<12} {:3.0f} % of the way, {:6.0f} s flown, {:4.1f} m/s, {:3.0f} x real time",
                            governor::to_string(design), 100.0 * p.done_ratio, p.time_s, p.speed_mps,
                            p.time_s / line.elapsed_s()));
    }));
    report::MissionResult& result = reports.back().result;
    result.env = flight.env;
    result.mission = options.source.world.empty() ? options.source.mission : "world_file";
    all_reached = all_reached && result.reached_goal && !result.collided;
    result.believed = believes(options, reports.back());
    all_believed = all_believed && result.believed;
  }
  if (options.source.profile != "host" && !config.host_costs &&
      board::uses_plugin({options.map, options.planner}))
    fmt::print(
        stderr,
        "roborun: this machine is not measured: what the plugin counts was compared with the profile {} "
        "alone (once roborun fly --profile host: with this machine too)\n",
        options.source.profile);

  if (options.json) {
    for (const report::MissionReport& r : reports) fmt::print("{}\n", report::to_json(r.result));
  } else {
    std::vector<report::MissionResult> results;
    results.reserve(reports.size());
    for (const report::MissionReport& r : reports) results.push_back(r.result);
    fmt::print("{}\n\n{}", title, report::comparison_table(results));
    for (const report::MissionReport& r : reports)
      fmt::print("{:<12} state_hash {}, {:.0f} x real time\n{}{}", r.result.design, r.result.state_hash,
                 r.result.real_time_factor, words_of_failsafe(r), words_of_refused(r.result));
  }
  if (!options.trace.empty()) input::write_file(options.trace, report::trace_csv(reports));
  if (!options.plot.empty()) {
    const report::Scene scene = mission::scene_of(world, title, flight.zone_m);
    const auto by = static_cast<report::PathColour>(colour - report::kPathColourName.begin());
    input::write_file(options.plot, known  ? report::known_svg(scene, reports)
                                    : maps ? report::maps_svg(scene, reports)
                                           : report::mission_svg(scene, reports, by));
  }
  if (!options.json && !options.plot.empty()) fmt::print("picture: {}\n", options.plot);
  if (!options.json && !options.trace.empty()) fmt::print("trace: {}\n", options.trace);
  if (!options.json && !options.log.empty()) fmt::print("log: {}\n", options.log);
  for (const report::MissionReport& r : reports)
    if (!r.log_error.empty()) throw InputError(r.log_error);
  return all_reached && all_believed ? kDone : kNotGood;
}

}  // namespace

void add_fly_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<FlyOptions>();
  CLI::App* fly_app = app.add_subcommand(
      "fly",
      "Fly a mission in simulation: its sensors, vehicle and bus are simulated, what flies them is not");
  fly_app->footer(
      "Examples:\n"
      "  roborun fly                                   environment 14 with the aware design\n"
      "  roborun fly --design aware,static,static-fair --plot flight.svg\n"
      "  roborun fly --env 27 --seed 3 --profile host --json\n"
      "  roborun fly --world house.bt --start 1,2,1.5 --goal 9,4,1.5 --goal 2,7,1.5    one goal after the "
      "other\n\n"
      "Exit code: 0 every design reached the goal, 1 at least one did not (the table says why), or a plugin "
      "took more\ntime than the work that it counts is worth, 2 bad input.");
  CLI::Option* env = fly_app
                         ->add_option("--env", options->source.env,
                                      "Environment: 1 .. 27, or a name like density0.45-spread80-distance900")
                         ->capture_default_str();
  CLI::Option* mission =
      fly_app->add_option("--mission", options->source.mission, "package_delivery or search_and_rescue")
          ->capture_default_str();
  fly_app
      ->add_option("--design", options->design,
                   "aware, static (0.5 m/s as published), static-fair; several with commas")
      ->capture_default_str();
  fly_app
      ->add_option("--profile", options->source.profile,
                   "What computing costs: paper (the authors' machine), host (this one), cortex-a72 (an "
                   "estimate), or a file of roborun calibrate")
      ->capture_default_str();
  CLI::Option* host_factor =
      add_number(*fly_app, "--host-factor", options->host_factor, 0.001, 1000.0,
                 "With --profile host: a machine this many times slower, 0.001 .. 1000");
  CLI::Option* host_file =
      fly_app->add_option("--host-file", options->host_file,
                          "With --profile host: where the measured costs are kept [~/.cache/roborun/]");
  fly_app->add_option("--seed", options->seed, "Seed of world, noise, wind and planner")
      ->capture_default_str();
  fly_app->add_option("--map", options->map, "own, octomap, or plugin:FILE.so")->capture_default_str();
  fly_app
      ->add_option("--planner", options->planner,
                   "own, ompl:NAME with any of OMPL's geometric planners, such as ompl:RRTstar, or "
                   "plugin:FILE.so (see platform/board/plugin.hpp)")
      ->capture_default_str();
  fly_app
      ->add_option("--ways", options->ways,
                   "Memory of the ways to the goal, of design aware: own, or plugin:FILE.so")
      ->capture_default_str();
  fly_app
      ->add_option(
          "--world", options->source.world,
          "World from a file instead: .toml, OctoMap .bt / .ot, SDF .world / .sdf, points .pcd / .ply "
          "/ .las, meshes .stl / .obj / .dae")
      ->excludes(env)
      ->excludes(mission);
  add_world_arguments(*fly_app, options->source.in_file);
  fly_app
      ->add_option("--vehicle", options->source.vehicle,
                   "Vehicle: a shipped one (roborun vehicle list), or a vehicle file")
      ->capture_default_str();
  fly_app->add_option("--plan", options->plan,
                      "Mission of a .plan or .waypoints file, whose home is (0, 0, 0), with its fence: "
                      "way-points, holds, speeds, returns, "
                      "releases; it ends over the place of the landing");
  fly_app
      ->add_option("--autopilot", options->autopilot,
                   "Who flies the vehicle: none (the runtime itself, to the motors), or px4, arducopter: a "
                   "fake one that "
                   "obeys its rules, over MAVLink (platform/sitl/README.md)")
      ->capture_default_str();
  fly_app->add_flag(
      "--autopilot-tune", options->tune,
      "Set the autopilot's limits of acceleration and jerk to the vehicle's before the take-off; default: "
      "the plans keep to its own");
  fly_app->add_option("--settings", options->source.settings,
                      "Cameras, wind, battery, speed from a TOML file (see platform/README.md)");
  fly_app->add_option("--aim", options->source.aim,
                      fmt::format("{} [that of --settings, or time]", kAimText));
  fly_app->add_option(
      "--log", options->log,
      "Write what the flight read, did and why to this MCAP file, for roborun replay, Foxglove and "
      "PlotJuggler");
  fly_app->add_option("--trace", options->trace, "Write every decision to this CSV file");
  fly_app->add_option("--plot", options->plot, "Write a picture of the mission to this SVG file");
  CLI::Option* colour =
      fly_app
          ->add_option(
              "--color", options->colour,
              "What colours the paths of --plot: speed, precision, volume, latency, visibility, deadline; "
              "all: a map of each; known: speed, over what the map knew at the end")
          ->capture_default_str();
  fly_app->add_flag("--json", options->json, "One JSON object per design on standard output, nothing else");
  fly_app->callback([=, &run] {
    const bool host = options->source.profile == "host";
    refuse_alone(*host_factor, host, "--profile host");
    refuse_alone(*host_file, host, "--profile host");
    refuse_alone(*colour, !options->plot.empty(), "--plot FILE");
    run = [options] { return fly(*options); };
  });
}

}  // namespace roborun::app
