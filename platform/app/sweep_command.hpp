/// `roborun sweep`: environments x profiles x designs x seeds in parallel, and `roborun sweep merge`.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// Adds the subcommand. `run` is set to what is to be done if it was chosen; it returns the exit code (0:
/// every mission of the request has its line, 1: not all, the same command goes on) and throws
/// InputError for bad input.
void add_sweep_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
