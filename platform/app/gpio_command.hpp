/// `roborun gpio`: which lines there are, and whether a kill switch is wired as it must be.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// Adds the subcommand. `run` is set to what is to be done if it was chosen; it returns the exit code (0
/// good, 1 the check failed) and throws InputError for bad input.
void add_gpio_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
