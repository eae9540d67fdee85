/// The one program. Every subcommand teaches itself with --help; bad input is one line on stderr and exit
/// code 2.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>

#include "firmware_if/assert.hpp"
#include "platform/app/audit_command.hpp"
#include "platform/app/calibrate_command.hpp"
#include "platform/app/can_command.hpp"
#include "platform/app/config_command.hpp"
#include "platform/app/explain_command.hpp"
#include "platform/app/fly_command.hpp"
#include "platform/app/gpio_command.hpp"
#include "platform/app/map_command.hpp"
#include "platform/app/memory_command.hpp"
#include "platform/app/replay_command.hpp"
#include "platform/app/scenario_command.hpp"
#include "platform/app/solve_command.hpp"
#include "platform/app/sweep_command.hpp"
#include "platform/app/vehicle_command.hpp"
#include "platform/app/world_command.hpp"
#include "platform/input/input_error.hpp"
#include "platform/report/build_identity.hpp"

namespace {

int complain(const std::string& what) {
  std::string line = what.substr(0, what.find('\n'));
  fmt::print(stderr, "roborun: {}\n", line);
  return 2;
}

void report_bug(const char* condition, const char* file, int line) noexcept {
  // Not through fmt: this thread may be a lane's, and its heap sealed.
  std::fprintf(stderr, "roborun: a bug of ours: %s:%d: '%s' does not hold\n", file, line, condition);
}

}  // namespace

// Formatting an error line can throw only where memory is gone: then std::terminate is the right end.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  roborun::set_assertion_handler(&report_bug);
  CLI::App app{"roborun: a navigation runtime for drones that thinks as long as it can afford to"};
  app.name("roborun");
  app.require_subcommand(1);
  app.set_version_flag("--version",
                       fmt::format("roborun 0.1.0, commit {}", roborun::report::build_identity().commit));
  std::function<int()> run;
  roborun::app::add_fly_command(app, run);
  roborun::app::add_calibrate_command(app, run);
  roborun::app::add_explain_command(app, run);
  roborun::app::add_solve_command(app, run);
  roborun::app::add_audit_command(app, run);
  roborun::app::add_memory_command(app, run);
  roborun::app::add_map_command(app, run);
  roborun::app::add_can_command(app, run);
  roborun::app::add_gpio_command(app, run);
  roborun::app::add_sweep_command(app, run);
  roborun::app::add_scenario_command(app, run);
  roborun::app::add_replay_command(app, run);
  roborun::app::add_vehicle_command(app, run);
  roborun::app::add_config_command(app, run);
  roborun::app::add_world_command(app, run);
  try {
    app.parse(argc, argv);
    return run ? run() : 2;
  } catch (const CLI::Success& done) {
    return app.exit(done);  // --help and --version
  } catch (const CLI::ParseError& error) {
    return complain(fmt::format("{} (see roborun --help)", error.what()));
  } catch (const roborun::InputError& error) {
    return complain(error.what());
  } catch (const std::exception& error) {
    return complain(fmt::format("unexpected: {}", error.what()));
  }
}
