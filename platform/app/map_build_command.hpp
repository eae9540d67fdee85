#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// `roborun map build`: recorded depth images or clouds with poses into a map.
void add_map_build_command(CLI::App& map, std::function<int()>& run);

}  // namespace roborun::app
