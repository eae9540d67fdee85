/// `roborun scenario`: flights with faults from files, each with a verdict.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_scenario_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
