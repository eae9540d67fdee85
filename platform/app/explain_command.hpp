/// `roborun explain`: why a decision was what it was, in plain words.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <string_view>

#include "platform/log/log_records.hpp"

namespace roborun::app {

/// Why it was what it was: what `roborun explain` prints of it. `number` counts from 1.
[[nodiscard]] std::string text_of_decision(const log::DecisionEntry& entry, std::size_t number,
                                           std::string_view design);

/// `csv`: what `roborun fly --trace` wrote. The decision that was in force at `at_s`, of the given design
/// (empty: the first in the file). Throws InputError if the text is no such trace or the time is
/// outside it.
[[nodiscard]] std::string explain_decision(const std::string& name, const std::string& csv, double at_s,
                                           const std::string& design);

void add_explain_command(CLI::App& app, std::function<int()>& run);

}  // namespace roborun::app
