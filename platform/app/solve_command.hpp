/// `roborun solve`: Eq. 3 for whoever wants to ask it directly.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace roborun::app {

/// Answers the problems in `text` (one JSON object, or a list of them; NaN, Infinity and -Infinity may be
/// written as Python does). Returns an object for an object, a list for a list, on one line. Throws
/// InputError with the number of the problem, the key and what would be right.
[[nodiscard]] std::string solve_json(const std::string& text);

/// Adds the subcommand. Exit code 0: every problem was answered ("infeasible" and "invalid" are answers); bad
/// input throws InputError.
void add_solve_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
