/// `roborun goto`: another goal for a flight that is under way.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_goto_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
