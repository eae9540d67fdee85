/// `roborun calibrate`: what the stages cost on this machine, or how far the simulated vehicle needs to stop.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// Adds the subcommand. Exit code 0; throws InputError if a file cannot be written.
void add_calibrate_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
