#include "platform/app/fly_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "platform/app/board_profile.hpp"
#include "platform/app/mission.hpp"
#include "platform/app/progress_line.hpp"
#include "platform/app/settings_file.hpp"
#include "platform/report/svg_plot.hpp"
#include "platform/report/table.hpp"
#include "platform/report/trace_csv.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/input_error.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::app {
namespace {

using sitl::InputError;

struct Options {
  std::string env{"14"};
  std::string mission{"package_delivery"};
  std::string design{"aware"};
  std::string profile{"paper"};
  std::string seed{"1"};
  std::string map{"own"};
  std::string planner{"own"};
  std::string world;
  std::string start;
  std::string goal;
  std::string settings;
  std::string host_file;
  double host_factor{1.0};
  std::string trace;
  std::string plot;
  std::string colour{"speed"};
  bool json{false};
};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  if (text.empty() || text.back() == ',') parts.emplace_back();  // getline drops an empty last one
  return parts;
}

governor::Design design_of(const std::string& name) {
  for (const auto design :
       {governor::Design::kAware, governor::Design::kStatic, governor::Design::kStaticFair}) {
    if (name == governor::to_string(design)) return design;
  }
  throw InputError(fmt::format(
      "--design: unknown design '{}': must be aware, static, static-fair, or several with commas between",
      name));
}

sitl::Mission mission_of(const std::string& name) {
  if (name == "package_delivery") return sitl::Mission::kPackageDelivery;
  if (name == "search_and_rescue") return sitl::Mission::kSearchAndRescue;
  throw InputError(
      fmt::format("--mission: unknown mission '{}': must be package_delivery or search_and_rescue", name));
}

std::uint64_t seed_of(const std::string& text) {
  std::size_t used = 0;
  std::uint64_t seed = 0;
  try {
    if (!text.empty() && text[0] >= '0' && text[0] <= '9') seed = std::stoull(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size())
    throw InputError(fmt::format(
        "--seed: '{}' is not a seed: must be a whole number from 0 to 18446744073709551615", text));
  return seed;
}

std::optional<Vector3> point_of(const char* option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::vector<std::string> parts = split(text);
  Vector3 p_W = Vector3::Zero();
  bool ok = parts.size() == 3;
  for (std::size_t i = 0; ok && i < 3; ++i) {
    char* end = nullptr;
    p_W[static_cast<Eigen::Index>(i)] = std::strtod(parts[i].c_str(), &end);
    ok = !parts[i].empty() && *end == '\0';
  }
  if (!ok || !is_finite(p_W))
    throw InputError(fmt::format("{}: '{}' is not a point: must be X,Y,Z in metres", option, text));
  return p_W;
}

Profile profile_of(const Options& options) {
  if (!(options.host_factor > 0.0 && options.host_factor <= 1000.0)) {
    throw InputError(
        fmt::format("--host-factor: {} is out of range: must be above 0, at most 1000", options.host_factor));
  }
  if (options.profile != "host") return load_profile(options.profile);
  std::string note;
  const Profile profile =
      host(options.host_file.empty() ? default_host_path() : options.host_file, options.host_factor, note);
  if (!note.empty()) fmt::print(stderr, "roborun: {}\n", note);
  return profile;
}

report::Scene scene_of(const sitl::World& world, const std::string& title, double zone_m) {
  report::Scene scene;
  scene.title = title;
  scene.bounds_W = world.bounds_W();
  scene.start_W = world.start_W();
  scene.goal_W = world.goal_W();
  for (const sitl::Pillar& p : world.pillars()) scene.circles.push_back({p.x_m, p.y_m, p.radius_m});
  for (const Aabb& b : world.boxes())
    scene.rects.push_back({b.min_W.x(), b.min_W.y(), b.size().x(), b.size().y()});
  if (zone_m > 0.0) scene.zone_borders_m = {world.start_W().x() + zone_m, world.goal_W().x() - zone_m};
  const sitl::VoxelGrid& voxels = world.voxels();
  if (!voxels.empty()) {
    // Columns with something at flight height, as runs along x.
    const Aabb box = voxels.bounds_W();
    const double step_m = std::max(voxels.cell_m(), box.size().x() / 400.0);
    for (double y_m = box.min_W.y() + 0.5 * step_m; y_m < box.max_W.y(); y_m += step_m) {
      double run_m = 0.0;
      for (double x_m = box.min_W.x() + 0.5 * step_m; x_m < box.max_W.x() + step_m; x_m += step_m) {
        if (voxels.occupied(Vector3(x_m, y_m, world.start_W().z()))) {
          run_m += step_m;
        } else if (run_m > 0.0) {
          scene.rects.push_back({x_m - 0.5 * step_m - run_m, y_m - 0.5 * step_m, run_m, step_m});
          run_m = 0.0;
        }
      }
    }
    return scene;
  }
  const Vector3 size = scene.bounds_W.size();
  scene.heat_cell_m = std::max(10.0, size.x() / 150.0);
  scene.heat_columns = static_cast<int>(size.x() / scene.heat_cell_m);
  scene.heat_rows = static_cast<int>(size.y() / scene.heat_cell_m);
  for (int k = 0; k < scene.heat_rows; ++k) {
    for (int i = 0; i < scene.heat_columns; ++i) {
      scene.heat_ratio.push_back(
          world.congestion_ratio(scene.bounds_W.min_W.x() + (i + 0.5) * scene.heat_cell_m,
                                 scene.bounds_W.min_W.y() + (k + 0.5) * scene.heat_cell_m));
    }
  }
  return scene;
}

int fly(const Options& options) {
  // Everything is checked before the first metre is flown.
  std::vector<governor::Design> designs;
  for (const std::string& name : split(options.design)) designs.push_back(design_of(name));
  const sitl::Mission mission = mission_of(options.mission);
  const std::uint64_t seed = seed_of(options.seed);
  if (options.colour != "speed" && options.colour != "precision") {
    throw InputError(fmt::format("--color: unknown colour '{}': must be speed or precision", options.colour));
  }
  for (const std::string& path : {options.trace, options.plot}) {
    const std::string error = report::cannot_write(path);
    if (!error.empty()) throw InputError(error);
  }
  MissionConfig config;
  if (!options.settings.empty()) load_settings(options.settings, config);
  const sitl::Endpoints endpoints{point_of("--start", options.start), point_of("--goal", options.goal)};
  std::string env;
  std::string title;
  double zone_m = 0.0;
  std::unique_ptr<sitl::World> world;
  if (!options.world.empty()) {
    world = std::make_unique<sitl::World>(sitl::load_world(options.world, endpoints));
    env = options.world;
    title = fmt::format("{}, seed {}", options.world, seed);
  } else {
    if (endpoints.start_W || endpoints.goal_W)
      throw InputError("--start and --goal go with --world FILE: the environments have their own");
    const sitl::NamedEnvironment named = sitl::environment(options.env);
    world = std::make_unique<sitl::World>(sitl::generate(named.knobs, mission, seed));
    env = fmt::format("{}", named.number);
    zone_m = named.knobs.spread_m;
    title = fmt::format("Environment {} ({}), {}, seed {}", named.number, named.name, options.mission, seed);
  }
  const Profile profile = profile_of(options);
  title += fmt::format(", cost profile {}", options.profile);

  config.profile_name = options.profile;
  config.costs = profile.costs;
  config.model = profile.model;
  config.seed = seed;
  config.map_backend = options.map;
  config.planner_backend = options.planner;
  std::vector<report::MissionReport> reports;
  bool all_reached = true;
  for (const governor::Design design : designs) {
    config.design = design;
    ProgressLine line;
    reports.push_back(fly_mission(*world, config, [&line, design](const Progress& p) {
      if (!line.due()) return;
      line.show(fmt::format("{:<12} {:3.0f} % of the way, {:6.0f} s flown, {:4.1f} m/s, {:3.0f} x real time",
                            governor::to_string(design), 100.0 * p.done_ratio, p.time_s, p.speed_mps,
                            p.time_s / line.elapsed_s()));
    }));
    report::MissionResult& result = reports.back().result;
    result.env = env;
    result.mission = options.world.empty() ? options.mission : "world_file";
    all_reached = all_reached && result.reached_goal && !result.collided;
  }

  if (options.json) {
    for (const report::MissionReport& r : reports) fmt::print("{}\n", report::to_json(r.result));
  } else {
    std::vector<report::MissionResult> results;
    results.reserve(reports.size());
    for (const report::MissionReport& r : reports) results.push_back(r.result);
    fmt::print("{}\n\n{}", title, report::comparison_table(results));
    for (const report::MissionResult& r : results)
      fmt::print("{:<12} state_hash {}, {:.0f} x real time\n", r.design, r.state_hash, r.real_time_factor);
  }
  const auto colour = options.colour == "speed" ? report::PathColour::kSpeed : report::PathColour::kPrecision;
  std::string error;
  if (!options.trace.empty()) error = report::write_trace_csv(options.trace, reports);
  if (error.empty() && !options.plot.empty())
    error = report::write_file(options.plot,
                               report::mission_svg(scene_of(*world, title, zone_m), reports, colour));
  if (!error.empty()) throw InputError(error);
  if (!options.json && !options.plot.empty()) fmt::print("picture: {}\n", options.plot);
  if (!options.json && !options.trace.empty()) fmt::print("trace: {}\n", options.trace);
  return all_reached ? 0 : 1;
}

}  // namespace

void add_fly_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<Options>();
  CLI::App* fly_app = app.add_subcommand(
      "fly", "Fly a mission in simulation: depth images, map, planner, dynamics, all real");
  fly_app->footer(
      "Examples:\n"
      "  roborun fly                                   environment 14 with the aware design\n"
      "  roborun fly --design aware,static,static-fair --plot flight.svg\n"
      "  roborun fly --env 27 --seed 3 --profile host --json\n"
      "  roborun fly --world house.bt --start 1,2,1.5 --goal 9,4,1.5\n\n"
      "Exit code: 0 every design reached the goal, 1 at least one did not (the table says why), 2 bad "
      "input.");
  fly_app
      ->add_option("--env", options->env,
                   "Environment: 1 .. 27, or a name like density0.45-spread80-distance900")
      ->capture_default_str();
  fly_app->add_option("--mission", options->mission, "package_delivery or search_and_rescue")
      ->capture_default_str();
  fly_app
      ->add_option("--design", options->design,
                   "aware, static (0.5 m/s as published), static-fair; several with commas")
      ->capture_default_str();
  fly_app
      ->add_option("--profile", options->profile,
                   "What computing costs: paper (the authors' machine), host (this one), or a file of "
                   "roborun calibrate")
      ->capture_default_str();
  fly_app
      ->add_option("--host-factor", options->host_factor,
                   "With --profile host: a machine this many times slower")
      ->capture_default_str();
  fly_app->add_option("--host-file", options->host_file,
                      "With --profile host: where the measured costs are kept [~/.cache/roborun/host.toml]");
  fly_app->add_option("--seed", options->seed, "Seed of world, noise, wind and planner")
      ->capture_default_str();
  fly_app->add_option("--map", options->map, "own or octomap")->capture_default_str();
  fly_app
      ->add_option("--planner", options->planner,
                   "own, or ompl:NAME with any of OMPL's geometric planners, such as ompl:RRTstar")
      ->capture_default_str();
  fly_app->add_option("--world", options->world, "World from a file instead: .toml, or OctoMap .bt / .ot");
  fly_app->add_option("--start", options->start, "With --world: X,Y,Z in metres");
  fly_app->add_option("--goal", options->goal, "With --world: X,Y,Z in metres");
  fly_app->add_option("--settings", options->settings,
                      "Cameras, wind, battery, speed from a TOML file (see platform/README.md)");
  fly_app->add_option("--trace", options->trace, "Write every decision to this CSV file");
  fly_app->add_option("--plot", options->plot, "Write a picture of the mission to this SVG file");
  fly_app->add_option("--color", options->colour, "Colour of the paths: speed or precision")
      ->capture_default_str();
  fly_app->add_flag("--json", options->json, "One JSON object a design on standard output, nothing else");
  fly_app->callback([options, &run] { run = [options] { return fly(*options); }; });
}

}  // namespace roborun::app
