/// `roborun config`: every key of every file, with unit, range, default and meaning.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// `run` is set when the command line asks for it; it returns the exit code.
void add_config_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
