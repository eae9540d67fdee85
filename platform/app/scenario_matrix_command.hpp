/// `roborun scenario matrix`.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_scenario_matrix_command(CLI::App& scenario_app, std::function<int()>& run);

}  // namespace roborun::app
