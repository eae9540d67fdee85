#include "platform/app/report_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/flight_story.hpp"
#include "platform/mission/scene.hpp"
#include "platform/report/folder_page.hpp"
#include "platform/report/result_line.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::app {
namespace {

namespace fs = std::filesystem;

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

void print_page(const std::string& path, const std::string& html) {
  input::write_file(path, html);
  fmt::print("page: {} ({:.2f} MB)\n", path, 1e-6 * static_cast<double>(html.size()));
}

report::FolderRow row_of(const std::string& name, const mission::LoggedEnd& end) {
  using Verdict = report::FolderRow::Verdict;
  return {name,
          "",
          end.has_verdict  ? (end.passed ? Verdict::kPassed : Verdict::kFailed)
          : end.good()     ? Verdict::kReached
          : end.has_result ? Verdict::kFailed
                           : Verdict::kUnknown,
          end.reason,
          end.damage,
          end.has_result ? end.time_s : end.recorded_s,
          end.mean_mps,
          end.closest_m,
          end.complaints};
}

report::FolderRow row_of(const report::MissionResult& r) {
  using Verdict = report::FolderRow::Verdict;
  const std::string env = r.env.find_first_not_of("0123456789") == std::string::npos ? "env " + r.env : r.env;
  return {fmt::format("{} {} {} seed {}", env, r.profile, r.design, r.seed),
          "",
          r.reached_goal && !r.collided ? Verdict::kReached : Verdict::kFailed,
          r.reason,
          "",
          r.mission_time_s,
          r.mean_velocity_mps,
          mission::kUnknown};
}

/// One row per line of results; a line that is none is named.
void add_results(const fs::path& path, std::vector<report::FolderRow>& rows,
                 std::vector<std::string>& skipped) {
  std::istringstream lines(input::read_text(path.string(), "lines of results"));
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (const auto result = report::from_line(line))
      rows.push_back(row_of(*result));
    else
      skipped.push_back(fmt::format("{}:{}: no result of a flight", path.string(), number));
  }
}

/// The files of a folder that may hold flights, by name.
struct FolderFiles {
  std::vector<fs::path> logs, results;
};

FolderFiles files_in(const std::string& folder) {
  FolderFiles files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (std::error_code gone; !at->is_regular_file(gone)) continue;
    if (at->path().extension() == ".mcap") files.logs.push_back(at->path());
    if (at->path().extension() == ".jsonl") files.results.push_back(at->path());
  }
  if (error) throw InputError(fmt::format("{}: cannot be read: {}", folder, error.message()));
  std::sort(files.logs.begin(), files.logs.end());
  std::sort(files.results.begin(), files.results.end());
  if (files.logs.empty() && files.results.empty())
    throw InputError(fmt::format(
        "{}: holds no flights: must hold logs (.mcap) or results of roborun sweep (.jsonl)", folder));
  return files;
}

int report_folder(const ReportOptions& options) {
  FolderFiles files = files_in(options.log);
  const std::string out = options.out.empty() ? (fs::path(options.log) / "index.html").string() : options.out;
  const auto page_of = [](fs::path log) { return log.replace_extension(".html"); };
  std::vector<std::string> skipped;
  // Names of pages come from the folder: nobody asked for what lies behind a link in it.
  if (std::error_code error; options.out.empty() && fs::is_symlink(out, error))
    throw InputError(fmt::format("{}: is a link: must be a file, or another one with -o", out));
  std::erase_if(files.logs, [&](const fs::path& log) {
    std::error_code error;
    const fs::path page = page_of(log);
    const bool bad = fs::is_symlink(page, error) || fs::absolute(page) == fs::absolute(out);
    if (bad)
      skipped.push_back(
          fmt::format("{}: its page would be {}, a link or the table itself", log.string(), page.string()));
    return bad;
  });
  std::vector<input::NamedOutput> outputs{{"-o", out}};
  std::vector<std::string> inputs;
  for (const fs::path& log : files.logs) {
    outputs.push_back({"report", page_of(log).string()});
    inputs.push_back(log.string());
  }
  for (const fs::path& results : files.results) inputs.push_back(results.string());
  input::check_outputs(outputs, inputs);
  std::vector<report::FolderRow> rows;
  const input::StopOnSignal stop;
  for (const fs::path& log : files.logs) {
    if (input::StopOnSignal::requested())
      throw input::Interrupted(fmt::format("{} of {} pages written", rows.size(), files.logs.size()));
    std::string html;
    report::FolderRow row;
    try {
      const mission::FlightStory story = mission::story_of(log.string());
      row = row_of(log.stem().string(), story.end);
      html = report::flight_page_html(story.page);
    } catch (const InputError& error) {
      skipped.emplace_back(error.what());
      continue;
    }
    print_page(page_of(log).string(), html);
    row.page = fs::relative(page_of(log), fs::absolute(out).parent_path()).string();
    rows.push_back(std::move(row));
  }
  for (const fs::path& results : files.results) {
    try {
      add_results(results, rows, skipped);
    } catch (const InputError& error) {
      skipped.emplace_back(error.what());
    }
  }
  for (const std::string& line : skipped) fmt::print(stderr, "roborun: left out: {}\n", line);
  if (rows.empty()) throw InputError(fmt::format("{}: none of its files holds a flight", options.log));
  const std::size_t count = rows.size();
  input::write_file(out, report::folder_page_html(options.log, std::move(rows), skipped));
  fmt::print("index: {} ({} flights)\n", out, count);
  return kDone;
}

int report(const ReportOptions& options) {
  if (std::error_code error; fs::is_directory(options.log, error)) return report_folder(options);
  const std::string out = options.out.empty()
                              ? std::filesystem::path(options.log).replace_extension(".html").string()
                              : options.out;
  input::check_outputs({{"-o", out}}, {options.log, options.world});
  const mission::FlightStory story = mission::story_of(options.log, world_of(options));
  if (!story.end.damage.empty())
    fmt::print(stderr, "roborun: {}; the page goes until there\n", story.end.damage);
  print_page(out, report::flight_page_html(story.page));
  return kDone;
}

}  // namespace

void add_report_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* command =
      app.add_subcommand("report", "Make one offline page of a flight log: view in space, charts, reasons");
  command->footer(
      "Examples:\n"
      "  roborun fly --log flight.mcap && roborun report flight.mcap -o flight.html\n"
      "  roborun scenario run scenarios --out failed; roborun report failed     a table of those flights\n\n"
      "The page needs a browser of 2023 or newer, and no network. Arrow keys go from decision to decision, "
      "with shift\n"
      "10 s; a click on a chart chooses a moment. A log that was cut gives a page until the cut, and a line "
      "that says so.\n\n"
      "In a folder what holds no flight is named and left out; a log that was cut stands in the table with a "
      "note. Its verdict is\n"
      "that of its scenario, and of a flight without one whether the goal was reached.\n\n"
      "Exit code: 0 the page was written, 2 bad input.");
  command
      ->add_option("log", options->log,
                   "What --log FILE.mcap wrote; or a folder: a table of its logs and of the results of a "
                   "sweep, and a page "
                   "beside each log")
      ->required();
  command->add_option("-o,--out", options->out, "The page [LOG with the ending .html; FOLDER/index.html]");
  CLI::Option* world = command->add_option(
      "--world", options->world,
      "Draw what truly stands there, where the log does not hold it: the flight's world file");
  CLI::Option* env =
      command->add_option("--env", options->env, "The same for one of the 27 environments")->excludes(world);
  command->add_option("--mission", options->mission, "With --env: the mission that was flown")
      ->capture_default_str()
      ->needs(env);
  command->callback([=, &run] {
    std::error_code error;
    const bool folder = fs::is_directory(options->log, error);
    refuse_alone(*world, !folder, "one log");
    refuse_alone(*env, !folder, "one log");
    run = [options] { return report(*options); };
  });
}

}  // namespace roborun::app
