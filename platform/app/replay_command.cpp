#include "platform/app/replay_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "platform/app/exit_code.hpp"
#include "platform/app/explain_command.hpp"
#include "platform/app/flight_source.hpp"
#include "platform/app/options.hpp"
#include "platform/input/cache_folder.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/mission/logged_end.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/mission/what_if.hpp"
#include "platform/report/progress_line.hpp"

namespace roborun::app {
namespace {

struct ReplayOptions {
  std::string file;
  double from_s{-1.0};  ///< -1: not given.
  double until_s{std::numeric_limits<double>::infinity()};
  std::vector<std::string> what_if;
  std::string log;
  bool json{false};
};

nlohmann::ordered_json json_of(const mission::ReplayResult& r) {
  nlohmann::ordered_json j = {{"same", r.same()},
                              {"seconds", r.seconds},
                              {"minor_frames", r.replayed.minor_frames},
                              {"decisions", r.replayed.decisions},
                              {"digest", fmt::format("{:016x}", r.replayed.digest)},
                              {"recorded_digest", fmt::format("{:016x}", r.recorded.digest)},
                              {"keyframe_s", r.keyframe_s},
                              {"damage", r.damage},
                              {"difference", nullptr}};
  if (const auto& d = r.difference)
    j["difference"] = {
        {"minor_frame", d->minor_frame}, {"time_s", d->time_s},    {"stage", d->stage}, {"what", d->what},
        {"recorded", d->recorded},       {"replayed", d->replayed}};
  return j;
}

void refuse_before(const ReplayOptions& options) {
  if (options.from_s > options.until_s)
    throw InputError(
        fmt::format("--from: {:g} s: must not be behind --until {:g} s", options.from_s, options.until_s));
}

std::string keyframes_folder() {
  const std::string cache = input::cache_folder();
  return cache.empty() ? cache : cache + "/keyframes";
}

/// A moment behind the end of the log.
void refuse_beyond(const ReplayOptions& options, const mission::LoggedEnd& logged) {
  const std::string why = mission::beyond(logged, "--from", options.from_s);
  if (!why.empty()) throw InputError(fmt::format("{}: {}", options.file, why));
}

void print_replay(const mission::ReplayResult& r) {
  if (const auto& d = r.difference) {
    fmt::print("another flight: first in minor frame {}, at {:.4f} s: {}, {}: recorded {}, replayed {}\n",
               d->minor_frame, d->time_s, d->stage, d->what, d->recorded, d->replayed);
    return;
  }
  const bool whole = r.replayed.digest != 0;
  fmt::print(
      "{}: {:.1f} s{}, {} minor frames, {} decisions{}\n",
      !r.same() ? "another flight"
      : whole   ? "the same flight"
                : "the same flight so far",
      r.seconds, r.keyframe_s > 0.0 ? fmt::format(" (the first {:g} s before)", r.keyframe_s) : "",
      r.replayed.minor_frames, r.replayed.decisions,
      whole ? fmt::format(", digest {:016x}, recorded {:016x}", r.replayed.digest, r.recorded.digest) : "");
}

int replay(const ReplayOptions& options) {
  const bool from = options.from_s >= 0.0;
  if (from) refuse_before(options);
  nlohmann::ordered_json decisions = nlohmann::ordered_json::array();
  const auto decided = [&](const log::DecisionEntry& entry) {
    if (seconds(Nanos{entry.time_ns}) < options.from_s) return;
    if (options.json)
      decisions.push_back(nlohmann::ordered_json::parse(log::decision_json(entry)));
    else
      fmt::print("{}\n", text_of_decision(entry, static_cast<std::size_t>(entry.number), "the flight"));
  };
  std::optional<report::ProgressLine> line(std::in_place);
  const mission::ReplayResult r = mission::replay_flight(
      options.file,
      [&line, &options](double done_s) {
        if (done_s >= options.from_s && options.from_s >= 0.0) return line->clear();
        if (line->due())
          line->show(
              fmt::format("{:.0f} s replayed, {:.0f} x real time", done_s, done_s / line->elapsed_s()));
      },
      options.until_s, from ? decided : std::function<void(const log::DecisionEntry&)>(),
      from ? mission::ReplayStart{.from_s = options.from_s, .keyframes = keyframes_folder()}
           : mission::ReplayStart{});
  line.reset();
  if (from && r.seconds < options.from_s && !r.difference)
    refuse_beyond(options, mission::end_of(options.file));
  if (!r.damage.empty()) fmt::print(stderr, "roborun: {}\n", r.damage);
  if (options.json) {
    nlohmann::ordered_json j = json_of(r);
    if (from) j["decided"] = decisions;
    fmt::print("{}\n", j.dump());
  } else {
    print_replay(r);
  }
  return r.same() ? kDone : kNotGood;
}

// ---- what if

/// A log in the folder for temporary files, gone at the end.
class TemporaryLog {
 public:
  TemporaryLog() : path_((std::filesystem::temp_directory_path() / "roborun.XXXXXX").string()) {
    const int fd = ::mkstemp(path_.data());
    if (fd < 0) throw InputError(fmt::format("{}: cannot be made: {}", path_, std::strerror(errno)));
    ::close(fd);
  }
  ~TemporaryLog() { std::remove(path_.c_str()); }
  TemporaryLog(const TemporaryLog&) = delete;
  TemporaryLog& operator=(const TemporaryLog&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

nlohmann::ordered_json json_of(const mission::LoggedEnd& end) {
  nlohmann::ordered_json j = {{"reached_goal", nullptr}, {"collided", nullptr}};
  if (end.has_result) j = {{"reached_goal", end.reached}, {"collided", end.collided}};
  j["reason"] = end.reason;
  j["mission_time_s"] = end.time_s;
  j["mean_velocity_mps"] = end.mean_mps;
  j["distance_m"] = end.distance_m;
  j["energy_kJ"] = end.energy_kJ;
  j["closest_obstacle_m"] = end.closest_m;
  j["decisions"] = end.decisions;
  return j;
}

std::string table_of(const mission::LoggedEnd& logged, const mission::LoggedEnd& flown) {
  const auto number = [](double x) { return std::isfinite(x) ? fmt::format("{:.2f}", x) : std::string("-"); };
  const auto row = [&](const char* name, double a, double b) {
    return fmt::format("{:<22} {:>14} {:>14} {:>10}\n", name, number(a), number(b),
                       std::isfinite(b - a) ? fmt::format("{:+.2f}", b - a) : "");
  };
  return fmt::format("{:<22} {:>14} {:>14} {:>10}\n{:<22} {:>14} {:>14}\n", "", "logged", "what if", "change",
                     "end", logged.reason, flown.reason) +
         row("time s", logged.time_s, flown.time_s) + row("mean speed m/s", logged.mean_mps, flown.mean_mps) +
         row("way flown m", logged.distance_m, flown.distance_m) +
         row("nearest obstacle m", logged.closest_m, flown.closest_m) +
         row("energy kJ", logged.energy_kJ, flown.energy_kJ);
}

int what_if(const ReplayOptions& options) {
  PreparedFlight flight = prepare_again(options.file);
  const mission::LoggedEnd logged = mission::end_of(options.file);
  refuse_beyond(options, logged);
  const flight::FlightConfig as_logged = mission::Recording(options.file).flight().flight;
  mission::change_in_flight(flight.config, as_logged, options.from_s, options.what_if);
  flight.inputs.push_back(options.file);
  input::check_outputs({{"--log", options.log}}, flight.inputs);
  std::optional<TemporaryLog> temporary;
  if (options.log.empty()) temporary.emplace();
  flight.config.log = temporary ? temporary->path() : options.log;
  const input::StopOnSignal stop;
  flight.config.each_frame = [&](const mission::FrameRecord& frame) {
    if (input::StopOnSignal::requested())
      throw input::Interrupted(
          fmt::format("after {:.0f} s of flight; {}", seconds(frame.now.time_since_epoch()),
                      options.log.empty() ? "no file was written" : "the log ends there"));
  };
  std::optional<report::ProgressLine> line(std::in_place);
  const report::MissionReport report =
      mission::fly_mission(*flight.world, flight.config, [&line](const mission::Progress& p) {
        if (line->due())
          line->show(fmt::format("{:3.0f} % of the way, {:6.0f} s flown", 100.0 * p.done_ratio, p.time_s));
      });
  line.reset();
  if (!report.log_error.empty()) throw InputError(report.log_error);
  const auto difference = mission::first_difference(options.file, flight.config.log, options.from_s);
  if (difference) {
    fmt::print(stderr,
               "roborun: {}: is not the same flight until {:g} s (other files, or another program): {}\n",
               options.file, options.from_s, *difference);
    return kNotGood;
  }
  const mission::LoggedEnd flown = mission::end_of(flight.config.log);
  if (!logged.damage.empty()) fmt::print(stderr, "roborun: {}\n", logged.damage);
  if (options.json) {
    fmt::print("{}\n", nlohmann::ordered_json{{"from_s", options.from_s},
                                              {"what_if", options.what_if},
                                              {"same_until_then", true},
                                              {"logged", json_of(logged)},
                                              {"flown", json_of(flown)}}
                           .dump());
  } else {
    fmt::print("the same flight until {:g} s, bit for bit; from then on {}\n\n{}", options.from_s,
               fmt::join(options.what_if, ", "), table_of(logged, flown));
    if (!options.log.empty()) fmt::print("log: {}\n", options.log);
  }
  return flown.good() ? kDone : kNotGood;
}

}  // namespace

void add_replay_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<ReplayOptions>();
  CLI::App* command = app.add_subcommand(
      "replay", "Fly the flight of a log once more, from its sensor samples and images alone");
  command->footer(
      "Examples:\n"
      "  roborun fly --log flight.mcap\n"
      "  roborun replay flight.mcap\n"
      "  roborun replay flight.mcap --from 60 --until 62                     its decisions then, with their "
      "reasons\n"
      "  roborun replay flight.mcap --from 60 --what-if flight.v_max_mps=3   and if it had flown on "
      "slowly?\n\n"
      "A log that is cut off or damaged is replayed up to there, and one line says where that is. --from "
      "replays what is\n"
      "before it, too, and prints none of it. It leaves the state of each 10th second in "
      "~/.cache/roborun/keyframes, so the\n"
      "next question about this log is answered in about a second.\n\n"
      "--what-if flies on in the simulator with another setting. It takes the files that the flight was "
      "flown "
      "from, and\n"
      "verifies that it is the same flight until then, bit for bit. KEY is one of\n  " +
      mission::keys_in_flight() +
      "\n\n"
      "Exit code: 0 every motor command and every decision are those of the flight, and if the log is whole "
      "the map too;\n1 they are not (the code has changed): the first difference is said; 2 no log of a "
      "flight, or one without inputs.\nOf --what-if: 0 the goal is reached, 1 it is not, or it is another "
      "flight, 2 bad input.");
  command->add_option("file", options->file, "A log of roborun fly --log")->required();
  CLI::Option* until =
      add_number(*command, "--until", options->until_s, 0.0, 1e6, "Only so far, seconds of flight [all]")
          ->default_str("");
  CLI::Option* from =
      add_number(*command, "--from", options->from_s, 0.0, 1e6,
                 "Print each decision from then on and why it was taken, seconds of flight [none]")
          ->default_str("");
  CLI::Option* setting =
      command
          ->add_option("--what-if", options->what_if,
                       "KEY=VALUE: fly on from there with another setting; several times for several")
          ->allow_extra_args(false);
  CLI::Option* log =
      command->add_option("--log", options->log, "With --what-if: write the new flight to this MCAP file");
  command->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  command->callback([=, &run] {
    refuse_alone(*log, setting->count() > 0, "--what-if KEY=VALUE");
    refuse_alone(*setting, from->count() > 0, "--from SECONDS");
    refuse_alone(*until, setting->count() == 0, "a replay, not with --what-if");
    run = [options] { return options->what_if.empty() ? replay(*options) : what_if(*options); };
  });
}

}  // namespace roborun::app
