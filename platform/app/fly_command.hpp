/// `roborun fly`: one mission, one design or several side by side.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// Adds the subcommand. `run` is set to what is to be done if it was chosen; it returns the exit code (0:
/// every design reached the goal, 1: at least one did not) and throws InputError for bad input.
void add_fly_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
