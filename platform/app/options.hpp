/// Options that every command reads in the same way.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <set>
#include <string>
#include <vector>

#include "platform/input/input_error.hpp"

namespace roborun::app {

/// A number from `low` to `high`; a whole one. `value` is the default and outlives the parsing. What is wrong
/// throws InputError.
CLI::Option* add_number(CLI::App& app, const std::string& name, double& value, double low, double high,
                        const std::string& text);
CLI::Option* add_whole(CLI::App& app, const std::string& name, int& value, int low, int high,
                       const std::string& text);

/// What --aim says of itself in every command.
inline constexpr const char* kAimText =
    "time, or energy: no faster than what spends least per metre (roborun vehicle check says how fast that "
    "is)";

/// One that would be ignored. Throws InputError "OPTION: goes with PARTNER" if it was given although
/// `with_partner` does not hold.
void refuse_alone(const CLI::Option& option, bool with_partner, const std::string& partner);

/// Throws InputError if a list has one value twice.
template <typename T>
void refuse_twice(const char* option, const std::vector<T>& values) {
  std::set<T> seen;
  for (const T& value : values) {
    if (!seen.insert(value).second) throw InputError(fmt::format("{}: {} is given twice", option, value));
  }
}

/// Throws InputError for an option of a command that has no say once its subcommand was chosen (`sweep --seeds
/// 2 merge`).
void refuse_before_subcommand(const CLI::App& app);

/// What is wrong with a command line that could not be parsed: names the unknown command or option, and what
/// may have been meant. `error`: what the parser says if it is something else.
[[nodiscard]] std::string complaint_of(const CLI::App& app, const CLI::ParseError& error);

}  // namespace roborun::app
