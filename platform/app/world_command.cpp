#include "platform/app/world_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/world_arguments.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/way_picture.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/sitl/judge/way_judge.hpp"
#include "platform/sitl/world/world_maker.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::app {
namespace {

struct CheckOptions {
  std::string world;
  WorldArguments in_file;
  std::string vehicle{"paper"};
  double margin_m{0.2};
  double resolution_m{0.0};
  std::string plot;
  bool json{false};
};

struct MakeOptions {
  std::string kind;
  std::string seed{"1"};
  std::string vehicle{"paper"};
  sitl::WorldMakerOptions maker;
  std::string out;
};

nlohmann::ordered_json point_json(const Vector3& p) { return {p.x(), p.y(), p.z()}; }

int check(const CheckOptions& options) {
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(options.vehicle);
  input::check_outputs({{"--plot", options.plot}}, {options.world, options.vehicle});
  const double body_m = vehicle.model.radius_m;
  if (options.in_file.goals.size() > 1) throw InputError("--goal: must be one: a way leads to one goal");
  const sitl::World world = sitl::load_world(options.world, world_options(options.in_file, body_m));
  sitl::WayQuestion question;
  question.radius_m = body_m + options.margin_m;
  question.resolution_m = options.resolution_m;
  sitl::WayVerdict verdict;
  {
    report::ProgressLine line;
    question.progress = [&line](std::uint64_t places) {
      if (line.due())
        line.show(fmt::format("{:.1f} million places looked at, {:.0f} s", 1e-6 * static_cast<double>(places),
                              line.elapsed_s()));
    };
    verdict = sitl::judge_way(world, question);
  }
  if (!options.plot.empty())
    input::write_file(options.plot, mission::way_svg(world, question.radius_m, verdict, options.world));
  const double straight_m = (world.goal_W() - world.start_W()).norm();
  if (options.json) {
    nlohmann::ordered_json json;
    json["way"] = verdict.way;
    json["narrowest_m"] = verdict.narrowest_m;
    if (verdict.way) {
      json["shortest_m"] = verdict.shortest_m;
    } else {
      json["shortest_m"] = nullptr;
    }
    json["straight_m"] = straight_m;
    json["radius_m"] = body_m;
    json["margin_m"] = options.margin_m;
    json["resolution_m"] = verdict.resolution_m;
    json["narrowest_at"] = point_json(verdict.narrowest_W);
    json["start"] = point_json(world.start_W());
    json["goal"] = point_json(world.goal_W());
    json["bounds"] = {point_json(world.bounds_W().min_W), point_json(world.bounds_W().max_W)};
    json["places"] = verdict.places;
    fmt::print("{}\n", json.dump());
    return verdict.way ? kDone : kNotGood;
  }
  fmt::print("{}, vehicle {}, {:.2f} m radius and {:.2f} m margin, looked at every {:.2f} m\n", options.world,
             options.vehicle, body_m, options.margin_m, verdict.resolution_m);
  if (verdict.way) {
    fmt::print("way        yes, {:.1f} m; straight {:.1f} m\n", verdict.shortest_m, straight_m);
  } else {
    fmt::print("way        none; straight {:.1f} m\n", straight_m);
  }
  const Vector3& p = verdict.narrowest_W;
  if (verdict.narrowest_m >= 2.0 * sitl::kWidest_m) {
    fmt::print("narrowest  {:.0f} m or more\n", verdict.narrowest_m);
  } else if (verdict.narrowest_m > 0.0) {
    fmt::print("narrowest  {:.2f} m, at ({:.1f}, {:.1f}, {:.1f})\n", verdict.narrowest_m, p.x(), p.y(),
               p.z());
  } else {
    fmt::print("narrowest  closed\n");
  }
  if (!options.plot.empty()) fmt::print("picture    {}\n", options.plot);
  return verdict.way ? kDone : kNotGood;
}

int make(const MakeOptions& options) {
  const sitl::WorldKind kind = sitl::world_kind_of(options.kind);
  const std::uint64_t seed = input::seed_of("--seed", options.seed);
  sitl::WorldMakerOptions o = options.maker;
  o.radius_m = vehicle::load_vehicle(options.vehicle).model.radius_m;
  input::check_outputs({{"--out", options.out}}, {options.vehicle});
  const sitl::WorldDescription world = sitl::make_world(kind, seed, o);
  std::string comment =
      fmt::format("roborun world make {} --seed {} --vehicle {}", options.kind, seed, options.vehicle);
  if (o.width_m) comment += fmt::format(" --width {}", *o.width_m);
  if (o.spacing_m) comment += fmt::format(" --spacing {}", *o.spacing_m);
  if (o.size_m) comment += fmt::format(" --size {}", *o.size_m);
  if (o.closed) comment += " --closed";
  const std::string text = sitl::world_toml(world, comment);
  if (options.out.empty()) {
    fmt::print("{}", text);
  } else {
    input::write_file(options.out, text);
  }
  return kDone;
}

void add_check(CLI::App& world, std::function<int()>& run) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* command =
      world.add_subcommand("check", "whether there is a way from start to goal, how wide and how long");
  command->footer(
      "It knows the true world and shares no code with what flies. A way that it finds is one, and it is at "
      "most a few\n"
      "percent longer than the shortest; one that is wider than needed by less than the resolution may be "
      "missed.\n"
      "narrowest: the diameter of the largest ball that gets through at all, at most 6 m.\n\n"
      "Examples:\n"
      "  roborun world check maze.toml --vehicle micro --json\n"
      "  roborun world check forest.world --start 0,0,3 --goal 305,0,3 --plot forest.svg\n"
      "  roborun world check street.las --cell 0.1 --bounds 0,0,1,120,40,12 --start 5,5,3 --goal 110,30,3\n\n"
      "Exit code: 0 there is a way, 1 there is none, 2 bad input.");
  command
      ->add_option("WORLD", options->world,
                   "a .toml, .bt, .ot, .world, .sdf, .pcd, .ply, .las, .stl, .obj or .dae file")
      ->required();
  add_world_arguments(*command, options->in_file);
  command
      ->add_option("--vehicle", options->vehicle,
                   "a shipped vehicle (roborun vehicle list), or a vehicle file")
      ->capture_default_str();
  add_number(*command, "--margin", options->margin_m, 0.0, 2.0,
             "free space around the vehicle, metres, 0 .. 2");
  command->add_option("--resolution", options->resolution_m,
                      "of what is looked at, metres [0.2, or a third of the radius]");
  command->add_option("--plot", options->plot, "write a picture to this SVG file");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->callback([options, &run] { run = [options] { return check(*options); }; });
}

void add_make(CLI::App& world, std::function<int()>& run) {
  const auto options = std::make_shared<MakeOptions>();
  CLI::App* command = world.add_subcommand("make", "write a hard world, the same for the same seed");
  command->footer(
      "  forest    a tree per square of --spacing (3.5 m)\n"
      "  maze      8 x 8 cells, corridors of --width (5.6 m)\n"
      "  trap      a U of --size depth (20 to 60 m), open to the start\n"
      "  walls     one to three walls of --size width (14 to 60 m) across the way\n"
      "  gaps      three walls from side to side with a gap of --width (2 radius + 0.4 m)\n"
      "  windows   the same with windows\n"
      "  poles     of 2, 5 and 10 cm, one per square of --spacing (4 m)\n"
      "  wires     level ones across the way, of 2, 5 and 10 cm, one every --spacing (4 m)\n"
      "  office    rooms along a corridor, doors of --width (2 radius + 0.4 m)\n"
      "  cave      a winding tunnel of at least --width (2 radius + 2 m), with dead ends\n\n"
      "Example: roborun world make maze --seed 7 --out maze.toml && roborun fly --world maze.toml");
  command->add_option("KIND", options->kind, fmt::format("{}", fmt::join(sitl::kWorldKindName, ", ")))
      ->required();
  command->add_option("--seed", options->seed, "of everything random in it")->capture_default_str();
  command->add_option("--vehicle", options->vehicle, "whose radius default widths follow")
      ->capture_default_str();
  command->add_option("--width", options->maker.width_m, "of openings, corridors, tunnels, metres");
  command->add_option("--spacing", options->maker.spacing_m, "of trees, poles, wires, metres");
  command->add_option("--size", options->maker.size_m, "of traps and walls, metres");
  command->add_flag("--closed", options->maker.closed, "walls stand around the goal: there is no way");
  command->add_option("--out", options->out, "a .toml file [standard output]");
  command->callback([options, &run] { run = [options] { return make(*options); }; });
}

}  // namespace

void add_world_command(CLI::App& app, std::function<int()>& run) {
  CLI::App* world = app.add_subcommand("world", "judge worlds, and make hard ones");
  world->require_subcommand(1);
  add_check(*world, run);
  add_make(*world, run);
}

}  // namespace roborun::app
