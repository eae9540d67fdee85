/// `roborun manual`: man pages and shell completions, made from the same table as --help.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

/// `app`: the whole program; what is added to it after this is in the pages, too.
void add_manual_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
