/// `roborun map info | convert | diff | view`: what to do with OctoMap files.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// Adds the subcommand. `run` is set to what is to be done if it was chosen; it returns the exit code (1 only
/// for `diff` of maps that differ) and throws InputError for bad input.
void add_map_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
