/// roborun port share, roborun port fetch: the ports of a vehicle on another machine.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_port_bridge_commands(CLI::App& port_app, std::function<int()>& run);

}  // namespace roborun::app
