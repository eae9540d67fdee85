/// `roborun port`: what other processes write to sensor ports.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_port_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
