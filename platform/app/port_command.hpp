/// `roborun port`: what other processes write to sensor ports.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace roborun::app {

/// A name stands for a file /dev/shm/roborun-NAME; what has a slash is a file.
[[nodiscard]] std::string port_path(const std::string& name);

void add_port_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
