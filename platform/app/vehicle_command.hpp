/// roborun vehicle: the shipped vehicles, and what follows from a vehicle file.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_vehicle_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
