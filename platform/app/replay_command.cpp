#include "platform/app/replay_command.hpp"

#include <fmt/format.h>

#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/mission/replay.hpp"
#include "platform/report/progress_line.hpp"

namespace roborun::app {
namespace {

struct ReplayOptions {
  std::string file;
  double until_s{std::numeric_limits<double>::infinity()};
  bool json{false};
};

nlohmann::ordered_json json_of(const mission::ReplayResult& r) {
  nlohmann::ordered_json j = {{"same", r.same()},
                              {"seconds", r.seconds},
                              {"minor_frames", r.replayed.minor_frames},
                              {"decisions", r.replayed.decisions},
                              {"digest", fmt::format("{:016x}", r.replayed.digest)},
                              {"recorded_digest", fmt::format("{:016x}", r.recorded.digest)},
                              {"damage", r.damage},
                              {"difference", nullptr}};
  if (const auto& d = r.difference)
    j["difference"] = {
        {"minor_frame", d->minor_frame}, {"time_s", d->time_s},    {"stage", d->stage}, {"what", d->what},
        {"recorded", d->recorded},       {"replayed", d->replayed}};
  return j;
}

void print_replay(const mission::ReplayResult& r) {
  if (const auto& d = r.difference) {
    fmt::print("another flight: first in minor frame {}, at {:.4f} s: {}, {}: recorded {}, replayed {}\n",
               d->minor_frame, d->time_s, d->stage, d->what, d->recorded, d->replayed);
    return;
  }
  const bool whole = r.replayed.digest != 0;
  fmt::print(
      "{}: {:.1f} s, {} minor frames, {} decisions{}\n",
      !r.same() ? "another flight"
      : whole   ? "the same flight"
                : "the same flight so far",
      r.seconds, r.replayed.minor_frames, r.replayed.decisions,
      whole ? fmt::format(", digest {:016x}, recorded {:016x}", r.replayed.digest, r.recorded.digest) : "");
}

int replay(const ReplayOptions& options) {
  std::optional<report::ProgressLine> line(std::in_place);
  const mission::ReplayResult r = mission::replay_flight(
      options.file,
      [&line](double done_s) {
        if (line->due())
          line->show(
              fmt::format("{:.0f} s replayed, {:.0f} x real time", done_s, done_s / line->elapsed_s()));
      },
      options.until_s);
  line.reset();
  if (!r.damage.empty()) fmt::print(stderr, "roborun: {}\n", r.damage);
  if (options.json)
    fmt::print("{}\n", json_of(r).dump());
  else
    print_replay(r);
  return r.same() ? kDone : kNotGood;
}

}  // namespace

void add_replay_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<ReplayOptions>();
  CLI::App* command = app.add_subcommand(
      "replay", "Fly the flight of a log once more, from its sensor samples and images alone");
  command->footer(
      "Examples:\n"
      "  roborun fly --log flight.mcap\n"
      "  roborun replay flight.mcap\n\n"
      "A log that is cut off or damaged is replayed up to there, and one line says where that is.\n\n"
      "Exit code: 0 every motor command and every decision are those of the flight, and if the log is whole "
      "the map "
      "too;\n1 they are not (the code has changed): the first difference is said; 2 no log of a flight, or "
      "one without "
      "inputs.");
  command->add_option("file", options->file, "A log of roborun fly --log")->required();
  add_number(*command, "--until", options->until_s, 0.0, 1e6, "Only so far, seconds of flight [all]")
      ->default_str("");
  command->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  command->callback([options, &run] { run = [options] { return replay(*options); }; });
}

}  // namespace roborun::app
