/// `roborun mavlink`: MAVLink at the desk: decode recorded streams and .tlog files, encode frames.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// Adds the subcommand. `run` is set to what is to be done if it was chosen; it returns the exit code (0
/// done, 2 bad input) and throws InputError for bad input.
void add_mavlink_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
