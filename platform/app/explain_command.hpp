/// `roborun explain`: why a decision was what it was, in plain words.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace roborun::app {

/// `csv`: what `roborun fly --trace` wrote. The decision that was in force at `at_s`, of the given design
/// (empty: the first in the file). Throws InputError if the text is no such trace or the time is
/// outside it.
[[nodiscard]] std::string explain_decision(const std::string& name, const std::string& csv, double at_s,
                                           const std::string& design);

void add_explain_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
