/// The one program. Every subcommand teaches itself with --help; bad input is one line on stderr and exit
/// code 2 (exit_code.hpp).
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <system_error>

#include "firmware_if/assert.hpp"
#include "platform/app/audit_command.hpp"
#include "platform/app/calibrate_command.hpp"
#include "platform/app/can_command.hpp"
#include "platform/app/config_command.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/explain_command.hpp"
#include "platform/app/feed_command.hpp"
#include "platform/app/fly_command.hpp"
#include "platform/app/goto_command.hpp"
#include "platform/app/gpio_command.hpp"
#include "platform/app/help_format.hpp"
#include "platform/app/manual_command.hpp"
#include "platform/app/map_command.hpp"
#include "platform/app/mavlink_command.hpp"
#include "platform/app/memory_command.hpp"
#include "platform/app/options.hpp"
#include "platform/app/plant_command.hpp"
#include "platform/app/port_command.hpp"
#include "platform/app/replay_command.hpp"
#include "platform/app/report_command.hpp"
#include "platform/app/run_command.hpp"
#include "platform/app/scenario_command.hpp"
#include "platform/app/solve_command.hpp"
#include "platform/app/sweep_command.hpp"
#include "platform/app/vehicle_command.hpp"
#include "platform/app/world_command.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/report/build_identity.hpp"

namespace {

namespace cli = roborun::app;

int complain(const std::string& what, int code = cli::kRefused) {
  const std::string line = fmt::format("roborun: {}\n", what.substr(0, what.find('\n')));
  (void)std::fputs(line.c_str(), stderr);  // that nobody may read: no reason to throw
  return code;
}

void report_bug(const char* condition, const char* file, int line) noexcept {
  // Not through fmt: this thread may be a lane's, and its heap sealed.
  std::fprintf(stderr, "roborun: a bug of ours: %s:%d: '%s' does not hold\n", file, line, condition);
}

/// A stream that the caller closed fails when it is used; no file that is opened later takes its place.
void hold_standard_streams() {
  constexpr std::array<int, 3> kUseless{O_WRONLY, O_RDONLY, O_WRONLY};
  for (int fd = 0; fd < 3; ++fd) {
    if (fcntl(fd, F_GETFD) < 0) (void)open("/dev/null", kUseless.at(static_cast<std::size_t>(fd)));
  }
}

int stdout_errno = 0;  // of a print in the middle; 0: none failed, or unknown

/// What was printed counts only once it has left.
int finish(int code) {
  const bool lost = std::ferror(stdout) != 0;
  if (std::fflush(stdout) == 0 && !lost) return code;
  const int why = lost ? stdout_errno : errno;
  return complain(fmt::format("standard output: cannot be written: {}",
                              why != 0 ? strerror(why) : "a part of it was lost"));
}

int run_command(int argc, char** argv) {
  CLI::App app{"roborun: a navigation runtime for drones that thinks as long as it can afford to"};
  app.name("roborun");
  app.formatter(std::make_shared<cli::HelpFormat>(cli::help_width()));  // of all commands: they take it over
  app.require_subcommand(1);
  const roborun::report::BuildIdentity build = roborun::report::build_identity();
  app.set_version_flag("--version",
                       fmt::format("roborun {}, commit {}\ncommitted {}, compiled by {}", build.version,
                                   build.commit, build.commit_date, build.compiler));
  app.footer(cli::kExitCodes);
  std::function<int()> run;
  cli::add_fly_command(app, run);
  cli::add_plant_command(app, run);
  cli::add_run_command(app, run);
  cli::add_goto_command(app, run);
  cli::add_calibrate_command(app, run);
  cli::add_explain_command(app, run);
  cli::add_solve_command(app, run);
  cli::add_audit_command(app, run);
  cli::add_memory_command(app, run);
  cli::add_map_command(app, run);
  cli::add_can_command(app, run);
  cli::add_gpio_command(app, run);
  cli::add_port_command(app, run);
  cli::add_feed_command(app, run);
  cli::add_mavlink_command(app, run);
  cli::add_sweep_command(app, run);
  cli::add_scenario_command(app, run);
  cli::add_replay_command(app, run);
  cli::add_report_command(app, run);
  cli::add_vehicle_command(app, run);
  cli::add_config_command(app, run);
  cli::add_world_command(app, run);
  cli::add_manual_command(app, run);
  try {
    app.parse(argc, argv);
    cli::refuse_before_subcommand(app);
    return run ? run() : cli::kRefused;
  } catch (const CLI::Success& done) {  // --help and --version
    std::ostringstream text;
    (void)app.exit(done, text, text);
    (void)std::fputs(text.str().c_str(), stdout);
    return cli::kDone;
  } catch (const CLI::ParseError& error) {
    return complain(cli::complaint_of(app, error));
  } catch (const roborun::InputError& error) {
    return complain(error.what());
  } catch (const roborun::input::Interrupted& stop) {
    return complain(fmt::format("interrupted: {}", stop.what()), cli::kInterrupted);
  } catch (const std::system_error& error) {
    if (std::ferror(stdout) == 0) return complain(fmt::format("unexpected: {}", error.what()));
    stdout_errno = error.code().value();
    return cli::kRefused;  // finish() says it
  } catch (const std::exception& error) {
    return complain(fmt::format("unexpected: {}", error.what()));
  }
}

}  // namespace

// Formatting an error line can throw only where memory is gone: then std::terminate is the right end.
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  roborun::set_assertion_handler(&report_bug);
  hold_standard_streams();
  return finish(run_command(argc, argv));
}
