/// `roborun run`: the runtime, with a vehicle at the far end of a link.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_run_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
