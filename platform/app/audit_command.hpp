/// `roborun audit`: a real-time flight on simulated sensors, and what it cost in time and memory.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// `run` is set when the command line asks for it; it returns the exit code.
void add_audit_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
