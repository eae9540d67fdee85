#include "platform/app/replay_command.hpp"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/mission/replay.hpp"
#include "platform/report/progress_line.hpp"

namespace roborun::app {
namespace {

struct ReplayOptions {
  std::string file;
  bool json{false};
};

int replay(const ReplayOptions& options) {
  report::ProgressLine line;
  const mission::ReplayResult r = mission::replay_flight(options.file, [&line](double done_s) {
    if (line.due())
      line.show(fmt::format("{:.0f} s replayed, {:.0f} x real time", done_s, done_s / line.elapsed_s()));
  });
  if (options.json) {
    const nlohmann::ordered_json j = {{"same", r.same()},
                                      {"minor_frames", r.replayed.minor_frames},
                                      {"decisions", r.replayed.decisions},
                                      {"digest", fmt::format("{:016x}", r.replayed.digest)},
                                      {"recorded_digest", fmt::format("{:016x}", r.recorded.digest)},
                                      {"diverged_in", r.diverged_in}};
    fmt::print("{}\n", j.dump());
  } else if (r.diverged_in != 0) {
    fmt::print("another flight: in minor frame {} it wants other inputs than the recorded one\n",
               r.diverged_in);
  } else {
    fmt::print("{}: {:.0f} s, {} minor frames, {} decisions, digest {:016x}, recorded {:016x}\n",
               r.same() ? "the same flight" : "another flight", r.seconds, r.replayed.minor_frames,
               r.replayed.decisions, r.replayed.digest, r.recorded.digest);
  }
  return r.same() ? kDone : kNotGood;
}

}  // namespace

void add_replay_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<ReplayOptions>();
  CLI::App* command =
      app.add_subcommand("replay", "Fly a recording once more, from its sensor samples and images alone");
  command->footer(
      "Examples:\n"
      "  roborun fly --record flight.rec\n"
      "  roborun replay flight.rec\n\n"
      "Exit code: 0 every motor command, every decision and the map are those of the recorded flight, 1 they "
      "are "
      "not (the code has changed), 2 no recording, or a damaged one.");
  command->add_option("file", options->file, "A file of roborun fly --record")->required();
  command->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  command->callback([options, &run] { run = [options] { return replay(*options); }; });
}

}  // namespace roborun::app
