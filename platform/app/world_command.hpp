/// roborun world: whether a world has a way, and hard worlds from a seed.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_world_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
