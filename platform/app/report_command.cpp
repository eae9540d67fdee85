#include "platform/app/report_command.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/flight_story.hpp"
#include "platform/mission/scene.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::app {
namespace {

struct ReportOptions {
  std::string log;
  std::string out;
  std::string world;
  std::string env;
  std::string mission{"package_delivery"};
};

/// Empty if no world was named.
mission::WorldOf world_of(const ReportOptions& options) {
  if (!options.world.empty())
    return [&options](std::optional<std::uint64_t> /*seed*/) {
      return mission::scene_of(sitl::load_world(options.world, {}), "", 0.0);
    };
  if (options.env.empty()) return {};
  const sitl::NamedEnvironment named = sitl::environment(options.env);
  const sitl::Mission mission = sitl::mission_of(options.mission);
  return [named, mission](std::optional<std::uint64_t> seed) {
    if (!seed) throw InputError("--env: the log does not say its seed: must be a log of roborun fly");
    return mission::scene_of(sitl::generate(named.knobs, mission, *seed), "", named.knobs.spread_m);
  };
}

int report(const ReportOptions& options) {
  const std::string out = options.out.empty()
                              ? std::filesystem::path(options.log).replace_extension(".html").string()
                              : options.out;
  input::check_outputs({{"-o", out}}, {options.log, options.world});
  const mission::FlightStory story = mission::story_of(options.log, world_of(options));
  if (!story.damage.empty()) fmt::print(stderr, "roborun: {}; the page goes until there\n", story.damage);
  const std::string html = report::flight_page_html(story.page);
  input::write_file(out, html);
  fmt::print("page: {} ({:.2f} MB)\n", out, 1e-6 * static_cast<double>(html.size()));
  return kDone;
}

}  // namespace

void add_report_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* command =
      app.add_subcommand("report", "Make one offline page of a flight log: view in space, charts, reasons");
  command->footer(
      "Example:\n"
      "  roborun fly --log flight.mcap && roborun report flight.mcap -o flight.html\n\n"
      "The page needs a browser of 2023 or newer, and no network. Arrow keys go from decision to decision, "
      "with shift\n"
      "10 s; a click on a chart chooses a moment. A log that was cut gives a page until the cut, and a line "
      "that says so.\n\n"
      "Exit code: 0 the page was written, 2 bad input.");
  command->add_option("log", options->log, "What --log FILE.mcap wrote")->required();
  command->add_option("-o,--out", options->out, "The page [LOG with the ending .html]");
  CLI::Option* world = command->add_option(
      "--world", options->world,
      "Draw what truly stands there, where the log does not hold it: the flight's world file");
  CLI::Option* env =
      command->add_option("--env", options->env, "The same for one of the 27 environments")->excludes(world);
  command->add_option("--mission", options->mission, "With --env: the mission that was flown")
      ->capture_default_str()
      ->needs(env);
  command->callback([options, &run] { run = [options] { return report(*options); }; });
}

}  // namespace roborun::app
