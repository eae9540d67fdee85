/// `roborun replay`: a recorded flight once more, from its inputs alone.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// `run` is set when the command line asks for it; it returns the exit code.
void add_replay_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
