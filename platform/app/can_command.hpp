/// `roborun can`: DroneCAN at the desk: decode and encode candump logs, monitor a bus, try ESCs on the bench.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// Adds the subcommand. `run` is set to what is to be done if it was chosen; it returns the exit code (0
/// done, 2 bad input) and throws InputError for bad input.
void add_can_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
