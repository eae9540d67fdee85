#include "platform/app/plant_command.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "platform/app/earth_argument.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/plant_arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/live/plant.hpp"
#include "platform/report/progress_line.hpp"

namespace roborun::app {
namespace {

struct PlantOptions {
  PlantArguments common;
  std::string origin;
  std::string autopilot{"none"};
  std::string mavlink{"udpout://127.0.0.1:14540"};
  std::string key;
  std::string physics{"none"};
  int physics_port{0};
  double pilot_s{0.0};
  double seconds{0.0};
  bool no_pictures{false};
  bool bus_sensors{false};
  std::string can;
  std::vector<std::string> kill_pulls;
  bool json{false};
};

std::string text_of(const Vector3& p) { return fmt::format("{:g},{:g},{:g}", p.x(), p.y(), p.z()); }

/// Where the runtime has to wait for what this link sends.
std::string far_end_of(const mavlink::LinkAddress& link) {
  using Kind = mavlink::LinkAddress::Kind;
  if (link.kind == Kind::kUdpOut) return fmt::format("udpin://{}:{}", link.host, link.number);
  if (link.kind == Kind::kUdpIn) return fmt::format("udpout://{}:{}", link.host, link.number);
  return "URL";
}

/// How the autopilot is started that steps this world; empty: none does.
std::string physics_line(const live::PlantConfig& config) {
  if (!config.physics) return {};
  if (config.physics->kind == mission::AutopilotKind::kPx4)
    return fmt::format("roborun: waits for PX4's simulator link on TCP {}\n", config.physics->port);
  return fmt::format(
      "roborun: waits on UDP {} for: arducopter --model JSON:127.0.0.1 --home {:.8f},{:.8f},{:g},90\n",
      config.physics->port, config.origin.latitude_deg, config.origin.longitude_deg, config.origin.height_m);
}

/// Where `run` finds the vehicle.
std::string link_to(const PlantOptions& options, const live::PlantConfig& config) {
  std::string link = "port:" + options.common.port;
  if (config.on_bus)
    link = (options.can.empty() ? "dronecan:" + link : "dronecan:INTERFACE --port " + options.common.port) +
           " --wait 60";
  if (config.autopilot)
    link = fmt::format("{} --autopilot {}", far_end_of(config.autopilot->link), options.autopilot);
  if (config.physics)
    link = fmt::format("{} --autopilot {}",
                       config.physics->kind == mission::AutopilotKind::kPx4 ? "udpin://127.0.0.1:14540"
                                                                            : "tcp://127.0.0.1:5760",
                       options.physics);
  return config.autopilot || config.physics ? link + " --arm --port " + options.common.port : link;
}

/// What flies in this world.
std::string run_line(const PlantOptions& options, const PlantScene& scene, const live::PlantConfig& config) {
  const sitl::World& world = scene.world;
  const std::string link = link_to(options, config);
  std::string line =
      fmt::format("roborun run --vehicle {} --link {} --goal {} --bounds={},{}", scene.vehicle, link,
                  text_of(world.goal_W()), text_of(world.bounds_W().min_W), text_of(world.bounds_W().max_W));
  if (world.start_W().z() != world.goal_W().z()) line += fmt::format(" --cruise {:g}", world.start_W().z());
  // The runtime's world begins where the vehicle stands, or with the autopilot's frame.
  if (!config.autopilot && !config.physics && mission::ground_below(world).norm() > 0.01)
    line += fmt::format(" --origin {:.8f},{:.8f},{:g}", config.origin.latitude_deg,
                        config.origin.longitude_deg, config.origin.height_m);
  return line;
}

void print(const live::PlantReport& r, bool json) {
  if (json) {
    nlohmann::ordered_json j{{"time_s", r.time_s}, {"collided", r.collided}};
    j["least_clearance_m"] = r.least_clearance_m ? nlohmann::ordered_json(*r.least_clearance_m) : nullptr;
    j["reached_goal"] = r.reached_goal;
    j["frames_sent"] = r.frames_sent;
    j["faults"] = r.faults;
    j["reason"] = r.reason;
    j["distance_m"] = r.distance_m;
    j["stood_still_s"] = r.stood_still_s;
    j["commands"] = r.commands;
    j["speed_mps"] = r.speed_mps;
    j["injected"] = r.injected;
    if (r.autopilot)
      j["autopilot"] = {{"mode", r.autopilot->mode},
                        {"armed", r.autopilot->armed},
                        {"set_points", r.autopilot->set_points},
                        {"refused_set_points", r.autopilot->refused_set_points},
                        {"timeouts", r.autopilot->timeouts},
                        {"releases", r.autopilot->releases},
                        {"lost_frames", r.autopilot->lost_frames},
                        {"doubled_frames", r.autopilot->doubled_frames}};
    if (r.package) j["package"] = {{"height_m", r.package->height_m}, {"speed_mps", r.package->speed_mps}};
    if (r.physics)
      j["physics"] = {{"steps", r.physics->steps},
                      {"lost", r.physics->lost},
                      {"resent", r.physics->resent},
                      {"restarts", r.physics->restarts},
                      {"refused", r.physics->refused}};
    fmt::print("{}\n", j.dump());
    return;
  }
  fmt::print("{} after {:.1f} s and {:.1f} m: {}{}\n", r.reason, r.time_s, r.distance_m,
             r.reached_goal ? "was at the goal" : "was not at the goal",
             r.least_clearance_m ? fmt::format(", least clearance {:.2f} m", *r.least_clearance_m) : "");
  fmt::print("{} pictures sent, {} {} heard, {} faults of its own\n", r.frames_sent, r.commands,
             r.autopilot ? "set-points"
             : r.physics ? "steps"
                         : "bus frames",
             r.faults);
  if (r.injected > 0) fmt::print("{} faults of the scenario began\n", r.injected);
  if (r.package)
    fmt::print("the package left its hook {:.2f} m above the ground, at {:.2f} m/s\n", r.package->height_m,
               r.package->speed_mps);
  if (r.physics)
    fmt::print("autopilot: {} packets lost, {} resent, {} refused, {} restarts\n", r.physics->lost,
               r.physics->resent, r.physics->refused, r.physics->restarts);
  if (r.autopilot)
    fmt::print("autopilot: mode {}, {}, {:.1f} m/s, {} time-outs\n", r.autopilot->mode,
               r.autopilot->armed ? "armed" : "disarmed", r.speed_mps, r.autopilot->timeouts);
}

std::optional<live::PlantAutopilot> autopilot_of(const PlantOptions& options) {
  const auto kind = mission::autopilot_of("--autopilot", options.autopilot);
  if (!kind) {
    if (options.pilot_s > 0.0) throw InputError("--pilot-after: must go with --autopilot px4 or arducopter");
    if (!options.key.empty()) throw InputError("--signing-key: must go with --autopilot px4 or arducopter");
    return std::nullopt;
  }
  live::PlantAutopilot autopilot{*kind, mavlink::parse_link(options.mavlink),
                                 mavlink::read_key("--signing-key", options.key), std::nullopt};
  if (options.pilot_s > 0.0) autopilot.pilot_s = options.pilot_s;
  return autopilot;
}

std::optional<live::PlantPhysics> physics_of(const PlantOptions& options) {
  const auto kind = mission::autopilot_of("--physics", options.physics);
  if (!kind) {
    if (options.physics_port > 0)
      throw InputError("--physics-port: must go with --physics px4 or arducopter");
    return std::nullopt;
  }
  if (options.autopilot != "none")
    throw InputError("--physics: must go without --autopilot: one of them flies");
  if (options.physics_port > 0) return live::PlantPhysics{*kind, options.physics_port};
  return live::PlantPhysics{*kind,
                            *kind == mission::AutopilotKind::kPx4 ? live::kPx4Port : live::kArduPilotPort};
}

int plant(const PlantOptions& options) {
  live::PlantConfig config;
  config.port = options.common.port;
  config.pictures = !options.no_pictures;
  if (const auto origin = origin_of(options.origin)) config.origin = *origin;
  config.autopilot = autopilot_of(options);
  config.physics = physics_of(options);
  if (options.bus_sensors || !options.can.empty()) {
    if (config.autopilot || config.physics)
      throw InputError("--bus-sensors, --can: go without --autopilot and --physics");
    config.on_bus = {options.can, options.kill_pulls};
  } else if (!options.kill_pulls.empty()) {
    throw InputError("--kill-pulls: goes with --can or --bus-sensors");
  }
  if (options.seconds > 0.0) config.seconds = options.seconds;
  const PlantScene scene = plant_scene(options.common);
  config.mission = scene.mission;
  const input::StopOnSignal stop;
  config.stop = &input::StopOnSignal::requested;
  std::optional<report::ProgressLine> line(std::in_place);
  const live::PlantReport result = live::run_plant(
      scene.world, config,
      [&] {
        fmt::print(stderr, "{}roborun: plant {} runs: {}\n", physics_line(config), options.common.port,
                   run_line(options, scene, config));
      },
      [&](const live::PlantProgress& p) {
        if (line->due())
          line->show(fmt::format("plant {:5.0f} s, {}, at ({:.1f}, {:.1f}, {:.1f}) m, {:.1f} m/s", p.time_s,
                                 p.is_heard ? "the runtime is there" : "nobody flies", p.p_WB.x(), p.p_WB.y(),
                                 p.p_WB.z(), p.speed_mps));
      });
  line.reset();
  print(result, options.json);
  if (result.reason == "interrupted") return kInterrupted;
  return result.collided ? kNotGood : kDone;
}

}  // namespace

void add_plant_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<PlantOptions>();
  CLI::App* command = app.add_subcommand(
      "plant",
      "World, physics and sensors as a process of their own: roborun run flies in it over sensor ports");
  command->footer(
      "Writes the ports NAME-camera1, NAME-imu, NAME-gnss, ... of the vehicle (roborun port list), its bus "
      "and its "
      "kill lines,\nin real time, and says the line that flies in it. Ends once the vehicle has flown and "
      "stands with "
      "its motors off,\nwhen it collides, after --seconds, or at Ctrl-C.\n\n"
      "Example, in two terminals:\n"
      "  roborun plant --vehicle paper --env 14 --seed 1 --port demo\n"
      "  roborun run --vehicle paper --link port:demo --goal 900,0,5 --bounds=-100,-100,1.5,1000,100,10\n\n"
      "With --scenario FILE its sensors, bus, motors, kill switch and cameras fail as the file says; time of "
      "a fault "
      "without a\nphase counts from leaving the ground. What becomes of it the flight itself has to tell "
      "(run "
      "--json).\n\n"
      "Exit code: 0 done, 1 the vehicle collided, 2 bad input, or ports that cannot be made, 130 "
      "interrupted.");
  add_plant_arguments(*command, options->common);
  command->add_option(
      "--origin", options->origin,
      "Where the world's (0, 0, 0) is on the earth: LATITUDE,LONGITUDE,HEIGHT [47.397742,8.545594,488]");
  command
      ->add_option(
          "--autopilot", options->autopilot,
          "px4 or arducopter: a fake one flies the vehicle, and speaks MAVLink; none: the runtime does")
      ->capture_default_str();
  command
      ->add_option(
          "--mavlink", options->mavlink,
          "Where that autopilot speaks: udpout://HOST:PORT, udpin://[HOST]:PORT or serial:///dev/NAME:BAUD")
      ->capture_default_str();
  command->add_option("--signing-key", options->key,
                      "File with 64 hexadecimal digits: that autopilot signs, and hears nothing unsigned");
  command
      ->add_option("--physics", options->physics,
                   "px4 or arducopter: a real one flies the vehicle, over its simulator link, and steps the "
                   "world; none: none does")
      ->capture_default_str();
  add_whole(*command, "--physics-port", options->physics_port, 1, 65535, "Port of that link on this machine")
      ->default_str("arducopter: UDP 9002; px4: TCP 4560");
  add_number(*command, "--pilot-after", options->pilot_s, 0.1, 86400.0,
             "After this many seconds in the air the autopilot's pilot takes over and lands")
      ->default_str("never");
  add_number(*command, "--seconds", options->seconds, 0.1, 86400.0,
             "End after this time at the latest; default: as long as it takes")
      ->default_str("");
  command->add_flag("--bus-sensors", options->bus_sensors,
                    "IMU, receiver, magnetometer, barometer and range finder are nodes on the vehicle's CAN "
                    "bus (RawIMU, Fix2, "
                    "...): for roborun run "
                    "--link dronecan:port:NAME");
  command->add_option(
      "--can", options->can,
      "That bus is this interface of the kernel: for roborun run --link dronecan:INTERFACE on the other end");
  command
      ->add_option(
          "--kill-pulls", options->kill_pulls,
          "OPEN,CLOSED: the contacts of its kill switch are lines of the kernel's gpio-sim; the files that "
          "pull them (/sys/devices/platform/gpio-sim.0/gpiochip1/sim_gpio0/pull): for roborun run "
          "--kill-lines")
      ->delimiter(',')
      ->expected(2);
  command->add_flag("--no-pictures", options->no_pictures,
                    "Depth images and clouds are made by a process of their own: roborun feed plant");
  command->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  command->callback([options, &run] { run = [options] { return plant(*options); }; });
}

}  // namespace roborun::app
