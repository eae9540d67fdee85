/// `roborun report`.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_report_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
