/// `roborun plant`: world, physics and sensors as a process of its own.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_plant_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
