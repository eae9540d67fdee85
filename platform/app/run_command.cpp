#include "platform/app/run_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "platform/app/earth_argument.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/run_guard.hpp"
#include "platform/app/world_arguments.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/live/live_run.hpp"
#include "platform/mavlink/mission_file.hpp"
#include "platform/mission/flight_story.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/report/flight_page.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/report/status_screen.hpp"
#include "platform/rt/confinement.hpp"
#include "platform/vehicle/vehicle_file.hpp"
#include "platform/viewer/live_server.hpp"

namespace roborun::app {
namespace {

struct RunOptions {
  std::string vehicle{"paper"};
  std::string link, port, goal, mission, bounds, origin, ground, key, log;
  int ground_id{live::kGroundStation};
  std::string autopilot{"none"};
  bool tune{false};
  bool arm{false};
  bool guard{false}, limits_speed{false};
  std::vector<std::string> kill_lines;
  std::string arm_line;
  bool active_low{false}, pull_up{false};
  std::string profile{"host"};
  std::string aim{"time"};
  std::string seed{"1"};
  double cruise_m{0.0};
  double seconds{3600.0};
  double wait_s{5.0};
  std::optional<std::uint16_t> live{};  ///< Port.
  bool best_effort{false};
  bool json{false};
};

constexpr std::uint16_t kLivePort = 8765;  // as Foxglove asks first
constexpr double kAround_m = 100.0;        // of start and goal
constexpr double kLowest_m = 1.5;
constexpr double kHighest_m = 10.0;

mission::FlightSpace space_of(const RunOptions& options, const std::optional<live::Route>& route) {
  mission::FlightSpace space;
  Aabb places_W;
  if (route) {
    space.goal_W = route->first_W();
    space.cruise_m = route->cruise_m;
    places_W = route->box_W();
  } else {
    space.goal_W = *point_of("--goal", options.goal);
    space.cruise_m = options.cruise_m > 0.0 ? options.cruise_m : space.goal_W.z();
    const Vector3 start_W(0.0, 0.0, space.cruise_m);
    places_W = {start_W.cwiseMin(space.goal_W), start_W.cwiseMax(space.goal_W)};
  }
  if (const auto bounds_W = box_of("--bounds", options.bounds)) {
    space.bounds_W = *bounds_W;
  } else {
    space.bounds_W = {places_W.min_W - Vector3(kAround_m, kAround_m, 0.0),
                      places_W.max_W + Vector3(kAround_m, kAround_m, 0.0)};
    space.bounds_W.min_W.z() = std::min(kLowest_m, space.bounds_W.min_W.z() - 1.0);
    space.bounds_W.max_W.z() = std::max(kHighest_m, space.bounds_W.max_W.z() + 1.0);
  }
  if (!route && !space.bounds_W.contains(space.goal_W))
    throw InputError(fmt::format("--goal: {}: must be inside --bounds", options.goal));
  if (!(space.cruise_m > 0.0 && space.cruise_m <= space.bounds_W.max_W.z()))
    throw InputError(
        fmt::format("--cruise: {:g} m: must be above the ground and below the top of --bounds, {:g} m",
                    space.cruise_m, space.bounds_W.max_W.z()));
  return space;
}

/// Who flies at the far end of a MAVLink link; none: the runtime itself.
std::optional<mission::AutopilotChoice> autopilot_of(const RunOptions& options, const live::Link& link) {
  const auto kind = mission::autopilot_of("--autopilot", options.autopilot);
  if (kind && !link.mavlink)
    throw InputError("--autopilot: goes with a MAVLink --link: udpin://[HOST]:PORT, tcp://HOST:PORT, ...");
  if (!kind && link.mavlink)
    throw InputError("--autopilot: must say who flies at the far end of this link: px4 or arducopter");
  if (!kind && (options.tune || options.arm))
    throw InputError("--autopilot-tune, --arm: must go with --autopilot px4 or arducopter");
  if (!kind) return std::nullopt;
  return mission::AutopilotChoice{*kind, options.tune};
}

live::BusLines lines_of(const RunOptions& options, const live::Link& link) {
  live::BusLines lines;
  if ((!options.kill_lines.empty() || !options.arm_line.empty()) && !link.dronecan)
    throw InputError("--kill-lines, --arm-line: go with --link dronecan:INTERFACE");
  const auto bias = options.pull_up ? firmware_if::GpioBias::kPullUp : firmware_if::GpioBias::kNone;
  const auto line = [&](const std::string& name) { return gpio::LineConfig{name, options.active_low, bias}; };
  if (!options.kill_lines.empty())
    lines.kill = {line(options.kill_lines.at(0)), line(options.kill_lines.at(1))};
  if (!options.arm_line.empty()) lines.arm = line(options.arm_line);
  return lines;
}

/// The route of --mission, and where it begins.
void take_mission(const RunOptions& options, live::LiveConfig& config) {
  if (options.cruise_m > 0.0) throw InputError("--cruise: goes with --goal: a mission has its take-off");
  const mavlink::MissionFile file = mavlink::load_mission(options.mission);
  if (!config.origin) config.origin = {file.home.latitude_deg, file.home.longitude_deg, file.home_height_m};
  try {
    config.route = live::route_of(file, *config.origin);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--mission: {}: {}", options.mission, error.what()));
  }
}

/// Its goals have room.
void check(const RunOptions& options, const live::LiveConfig& config) {
  try {
    live::check_route(*config.route, config.flight.bounds_W, config.flight.fence,
                      planned_radius_m(config.flight.vehicle));
  } catch (const InputError& error) {
    throw InputError(fmt::format("--mission: {}: {}", options.mission, error.what()));
  }
}

live::LiveConfig config_of(const RunOptions& options) {
  live::LiveConfig config;
  config.link = live::link_of(options.link, options.port);
  config.lines = lines_of(options, config.link);
  config.origin = origin_of(options.origin);
  if (!options.ground.empty()) config.ground.link = mavlink::parse_link(options.ground);
  config.ground.sysid = static_cast<std::uint8_t>(options.ground_id);
  config.key = mavlink::read_key("--signing-key", options.key);
  if (config.key && !config.link.mavlink && !config.ground.link)
    throw InputError("--signing-key: goes with a MAVLink --link or --ground");
  if (options.goal.empty() == options.mission.empty())
    throw InputError("--goal, --mission: must be one of both");
  if (!options.mission.empty()) take_mission(options, config);
  const mission::FlightSpace space = space_of(options, config.route);
  mission::MissionConfig mission;
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(options.vehicle);
  mission::set_vehicle(mission, vehicle);
  mission.seed = input::seed_of("--seed", options.seed);
  mission.flight.aim = mission::aim_of("--aim", options.aim);
  mission.autopilot = autopilot_of(options, config.link);
  if (mission.autopilot) {
    config.autopilot = mission::companion_config(*mission.autopilot, mission.flight.vehicle);
    config.autopilot->may_arm = options.arm;
    config.autopilot->ground_sysid = config.ground.sysid;
  }
  config.rig = sitl::rig_of(mission.simulator);
  // Last, after everything that may be refused: the first time this measures the machine.
  std::string note;
  const board::Profile profile = options.profile == "host"
                                     ? board::host(board::default_host_path({}), {}, 1.0, note)
                                     : board::load_profile(options.profile, {});
  if (!note.empty()) fmt::print(stderr, "roborun: {}\n", note);
  mission.flight.costs = profile.costs;
  mission.flight.model = profile.model;
  if (config.route) mission.flight.fence = config.route->fence;
  config.flight = mission::flight_config_in(space, mission);
  if (config.route) check(options, config);
  config.seconds = options.seconds;
  config.wait_s = options.wait_s;
  config.best_effort = options.best_effort;
  config.log = options.log;
  return config;
}

/// Says what is missing. Throws InputError.
[[noreturn]] void refuse(const RunOptions& options, const live::LiveReport& report) {
  std::string lacking;
  for (const live::Need& need : report.needs)
    if (!need.lacks.empty()) lacking += (lacking.empty() ? "" : ", ") + need.device;
  if (std::none_of(report.needs.begin(), report.needs.end(), [](const auto& need) { return need.has_port; }))
    throw InputError(fmt::format(
        "--link: {}: nothing is there: start what writes its ports (roborun plant --port {}), "
        "roborun port list "
        "shows them; {}",
        options.link, live::link_of(options.link, options.port).name, report.needs.front().lacks));
  for (const live::Need& need : report.needs)
    fmt::print(stderr, "{:<9} {}{}\n", need.lacks.empty() ? "READY" : "NOT READY", need.device,
               need.lacks.empty() ? "" : ": " + need.lacks);
  throw InputError(fmt::format("--link: {}: nothing was armed, for want of {}", options.link, lacking));
}

void print_json(const live::LiveReport& r) {
  nlohmann::ordered_json ports = nlohmann::ordered_json::array();
  for (const live::PortUse& port : r.ports)
    ports.push_back(
        {{"device", port.device}, {"frames", port.frames}, {"dropped", port.dropped}, {"stale", port.stale}});
  nlohmann::ordered_json events = nlohmann::ordered_json::array();
  for (const live::LiveReport::Event& e : r.events)
    events.push_back({{"time_s", e.time_s}, {"action", e.action}, {"conditions", e.conditions}});
  nlohmann::ordered_json json{{"reached_goal", r.reached_goal},
                              {"reason", r.reason},
                              {"distance_m", r.distance_m},
                              {"decisions", r.decisions},
                              {"deadline_misses", r.deadline_misses},
                              {"heap_calls_after_start", r.heap_calls_after_start},
                              {"page_faults", r.page_faults},
                              {"port", ports},
                              {"time_s", r.time_s},
                              {"ended", r.ended},
                              {"lane_misses", nlohmann::ordered_json::object()},
                              {"failsafe", events},
                              {"not_real_time", r.missing},
                              {"near_brakes", r.near_brakes}};
  if (r.autopilot)
    json["autopilot"] = {{"stage", r.autopilot->stage},
                         {"reason", r.autopilot->reason},
                         {"subject", r.autopilot->subject},
                         {"text", r.autopilot->text},
                         {"set_points", r.autopilot->set_points},
                         {"not_sent", r.autopilot->not_sent},
                         {"jumps", r.autopilot->jumps},
                         {"reboots", r.autopilot->reboots},
                         {"state_to_set_point_s",
                          {{"median", r.autopilot->median_s},
                           {"p99", r.autopilot->p99_s},
                           {"max", r.autopilot->max_s},
                           {"clock_error", r.autopilot->clock_error_s}}}};
  if (r.route)
    json["mission"] = {{"steps", r.route->steps}, {"done", r.route->done}, {"released", r.route->released}};
  json["goals_given"] = r.goals_given;
  json["goals_refused"] = r.goals_refused;
  for (const auto& [lane, misses] : r.lane_misses) json["lane_misses"][lane] = misses;
  fmt::print("{}\n", json.dump());
}

void print_words(const live::LiveReport& r) {
  fmt::print("{} after {:.1f} s and {:.1f} m; {}\n", r.reason, r.time_s, r.distance_m, r.ended);
  fmt::print("{} decisions, {} deadlines missed, {} heap calls and {} page faults in the lanes\n",
             r.decisions, r.deadline_misses, r.heap_calls_after_start, r.page_faults);
  if (r.near_brakes > 0)
    fmt::print("braked {} times between two decisions for what was near in the way\n", r.near_brakes);
  for (const live::LiveReport::Event& e : r.events)
    fmt::print("{:.1f} s: {}{}\n", e.time_s, e.action, e.conditions.empty() ? "" : " (" + e.conditions + ")");
  if (r.route)
    fmt::print("{} of {} steps of the mission, {} packages released\n", r.route->done, r.route->steps,
               r.route->released);
  if (r.autopilot)
    fmt::print("autopilot: {}{}{}{}; {} set-points\n", r.autopilot->stage,
               r.autopilot->reason.empty() ? "" : " (" + r.autopilot->reason + ")",
               r.autopilot->text.empty() ? "" : ", it said: ", r.autopilot->text, r.autopilot->set_points);
  fmt::print("\n{:<10} {:>8} {:>8} {:>6}\n", "port", "frames", "dropped", "stale");
  for (const live::PortUse& port : r.ports)
    fmt::print("{:<10} {:>8} {:>8} {:>6}\n", port.device, port.frames, port.dropped, port.stale);
}

int run_flight(const RunOptions& options) {
  if (options.guard) {
    if (!options.goal.empty() || !options.mission.empty() || options.arm || options.autopilot != "none")
      throw InputError("--guard: commands nothing: must go without --goal, --mission, --autopilot and --arm");
    if (!options.log.empty() || options.live || !options.ground.empty() || !options.key.empty())
      throw InputError(
          "--guard: signs nothing, and logs nothing: must go without --signing-key, --ground, --log and "
          "--live");
    return run_guard({options.vehicle, options.link, options.port, options.seconds, options.wait_s,
                      options.limits_speed, options.json});
  }
  if (options.limits_speed) throw InputError("--limit-speed: goes with --guard");
  input::check_outputs({{"--log", options.log}}, {options.vehicle, options.mission, options.profile});
  if (options.live && options.log.empty())
    throw InputError("--live: shows the log while it is written: must go with --log FILE.mcap");
  live::LiveConfig config = config_of(options);
  if (const std::string kept = rt::drop_capabilities(); !kept.empty())
    fmt::print(stderr, "roborun: {}\n", kept);
  config.confine = rt::confine;
  std::optional<viewer::LiveServer> server;
  if (options.live) {
    server.emplace(*options.live, [&options] {
      return report::flight_page_html(mission::story_of(options.log, {}, true).page);
    });
    config.viewer = &*server;
    fmt::print(stderr, "roborun: --live: http://127.0.0.1:{0}/, Foxglove: ws://127.0.0.1:{0}\n",
               server->port());
  }
  const input::StopOnSignal stop;
  (void)std::signal(SIGPIPE, SIG_IGN);  // who reads what is said may go: the flight does not end for it
  config.stop = &input::StopOnSignal::requested;
  std::optional<report::ProgressLine> line(std::in_place);
  std::optional<report::StatusScreen> screen(std::in_place, stderr);
  const live::LiveReport report = live::run_live(
      config,
      [&line](const std::vector<live::Need>& needs) {
        if (!line->due()) return;
        const auto lacking =
            std::find_if(needs.begin(), needs.end(), [](const auto& n) { return !n.lacks.empty(); });
        line->show(fmt::format("waits for {}: {}", lacking->device, lacking->lacks));
      },
      [&](const live::LiveProgress& p) {
        line.reset();
        if (screen->due())
          screen->show({{p.doing, fmt::format("{:.0f} s", p.time_s)},
                        {"goal", fmt::format("{:.1f} m away", p.to_goal_m)},
                        {"speed", fmt::format("{:.1f} m/s", p.speed_mps)},
                        {"height", fmt::format("{:.1f} m", p.height_m)},
                        {"decisions", fmt::format("{}", p.decisions)},
                        {"failsafe", p.action}});
      });
  line.reset();
  screen.reset();
  if (!report.ready) {
    if (input::StopOnSignal::requested()) throw input::Interrupted("before anything was armed");
    refuse(options, report);
  }
  for (const std::string& why : report.missing) fmt::print(stderr, "roborun: not real time: {}\n", why);
  options.json ? print_json(report) : print_words(report);
  if (!report.log_error.empty()) throw InputError(report.log_error);
  if (report.reason == "interrupted")
    throw input::Interrupted(fmt::format("after {:.1f} s, {}", report.time_s, report.ended));
  return report.reached_goal && report.ended == "landed" ? kDone : kNotGood;
}

}  // namespace

void add_run_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand(
      "run", "Fly a vehicle at the far end of a link: its sensors and its bus, or its autopilot");
  command->footer(
      "First it looks whether everything is there and says what is not; nothing is armed before. Then it "
      "climbs "
      "straight up,\nflies to the goal, and lands there. East, north and up count from where the vehicle "
      "stands at its "
      "first fix, or from --origin.\nCtrl-C, SIGTERM and SIGHUP: it stops, lands where it is, and reports; a "
      "second one "
      "of its kind ends the process at once,\nand the motors' controllers stop by themselves.\n\n"
      "Example, in two terminals:\n"
      "  roborun plant --vehicle paper --env 14 --seed 1 --port demo\n"
      "  roborun run --vehicle paper --link port:demo --goal 900,0,5 --bounds=-100,-100,1.5,1000,100,10\n"
      "With its sensors, too, on the CAN bus (dronecan:can0 --port demo for a real one):\n"
      "  roborun plant --vehicle paper --env 14 --seed 1 --port demo --bus-sensors\n"
      "  roborun run --vehicle paper --link dronecan:port:demo --wait 60 --goal 900,0,5 "
      "--bounds=-100,-100,1.5,1000,100,10\n"
      "With an autopilot between, a fake one:\n"
      "  roborun plant --vehicle paper --env 14 --seed 1 --port demo --autopilot px4\n"
      "  roborun run --vehicle paper --link udpin://127.0.0.1:14540 --port demo --autopilot px4 --arm --goal "
      "900,0,5 "
      "--bounds=-100,-100,1.5,1000,100,10\n\n"
      "Exit code: 0 it was at the goal and landed, 1 it ended otherwise (reason says how), 2 bad input, a "
      "device that is "
      "missing,\nor no real time to be had here, 130 interrupted, landed.");
  command
      ->add_option("--vehicle", options->vehicle,
                   "Vehicle: a shipped one (roborun vehicle list), or a vehicle file")
      ->capture_default_str();
  command
      ->add_option(
          "--link", options->link,
          "The way to the vehicle: port:NAME (sensor ports of this machine), dronecan:INTERFACE (its "
          "CAN bus; dronecan:port:NAME for a bus made of ports), or to its autopilot: "
          "udpin://[HOST]:PORT, udpout://HOST:PORT, tcp://HOST:PORT, serial:///dev/NAME:BAUD")
      ->required();
  command->add_option(
      "--port", options->port,
      "With a link to an autopilot or a CAN bus: NAME of the ports of the vehicle's depth images "
      "(with a bus also of its lines and odometry)");
  auto* kill_lines = command->add_option("--kill-lines", options->kill_lines,
                                         "With a CAN bus: the kill switch on lines of this machine, normally "
                                         "open and normally closed contact, each a "
                                         "name or CHIP:OFFSET [the port NAME-lines]");
  kill_lines->expected(2)->delimiter(',');
  command->add_option("--arm-line", options->arm_line,
                      "With a CAN bus: the arming switch on a line of this machine "
                      "[the port NAME-lines]");
  command->add_flag("--active-low", options->active_low, "A closed contact pulls its line low")
      ->needs(kill_lines);
  command->add_flag("--pull-up", options->pull_up, "Switch on the pull-up of the lines")->needs(kill_lines);
  command
      ->add_option("--autopilot", options->autopilot,
                   "Who flies at the far end of a MAVLink link: px4 or arducopter")
      ->capture_default_str();
  command->add_flag(
      "--autopilot-tune", options->tune,
      "Set the autopilot's limits of acceleration and jerk to the vehicle's before the take-off; "
      "default: its own limits must be enough");
  command->add_flag(
      "--guard", options->guard,
      "Only tell the autopilot what the cameras see (OBSTACLE_DISTANCE, 10 Hz); the pilot flies");
  command->add_flag(
      "--limit-speed", options->limits_speed,
      "With --guard: also tell it no faster than it can stop where it sees (DO_CHANGE_SPEED, for "
      "missions and guided flight)");
  command->add_flag(
      "--arm", options->arm,
      "Take the autopilot's mode and arm it, for simulators and without propellers; default: the "
      "operator does both");
  command->add_option(
      "--ground", options->ground,
      "Where somebody on the ground is told how the flight goes and may give another goal (roborun goto): "
      "udpin://[HOST]:PORT, udpout://HOST:PORT, ... [only through the autopilot]");
  add_whole(*command, "--ground-id", options->ground_id, 1, 255, "MAVLink system that may give goals");
  command->add_option(
      "--signing-key", options->key,
      "File with 64 hexadecimal digits: everything that is sent is signed, and nothing unsigned is heard");
  command->add_option("--goal", options->goal, "X,Y,Z in metres; or --mission");
  command->add_option(
      "--mission", options->mission,
      "Mission file instead: .plan of QGroundControl (with its fence), or .waypoints (QGC WPL 110)");
  command->add_option(
      "--bounds", options->bounds,
      "Where the vehicle may be: X,Y,Z,X,Y,Z of two corners, in metres [100 m around start and goal, "
      "1.5 to 10 m high]");
  add_number(*command, "--cruise", options->cruise_m, 0.5, 200.0,
             "How high it climbs first, metres [as high as the goal]")
      ->default_str("");
  command->add_option(
      "--origin", options->origin,
      "Where (0, 0, 0) is on the earth: LATITUDE,LONGITUDE,HEIGHT [where it stands; the home of --mission]");
  command
      ->add_option(
          "--profile", options->profile,
          "What the governor expects stages to cost: paper, host (measured once), or a file of roborun "
          "calibrate")
      ->capture_default_str();
  command->add_option("--aim", options->aim, kAimText)->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the planner")->capture_default_str();
  add_number(*command, "--seconds", options->seconds, 1.0, 86400.0, "Then it lands where it is, 1 .. 86400");
  add_number(*command, "--wait", options->wait_s, 0.0, 3600.0,
             "How long to wait for what is missing at the start, seconds");
  command->add_option("--log", options->log,
                      "Write what the flight did and why to this MCAP file, for Foxglove and PlotJuggler");
  command
      ->add_option_function<std::string>(
          "--live",
          [options](const std::string& port) {
            options->live = static_cast<std::uint16_t>(
                port.empty() ? kLivePort : input::whole_of("--live", port, 0, 65535));
          },
          "Show the flight while it goes on, on this port of 127.0.0.1: a page, and topics for Foxglove "
          "(Open connection, Foxglove WebSocket); 0: a free port; needs --log")
      ->expected(0, 1)
      ->default_str(std::to_string(kLivePort));
  command->add_flag("--best-effort", options->best_effort,
                    "Run without the real-time privileges, locked memory or CPUs that are missing here");
  command->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  command->callback([options, &run] { run = [options] { return run_flight(*options); }; });
}

}  // namespace roborun::app
