/// Why a decision was what it was, in plain words: what `roborun explain` prints and what stands in a log.
#pragma once

#include <string>
#include <vector>

#include "platform/log/log_records.hpp"

namespace roborun::log {

/// How many metres of known way a metre counts that nobody has seen yet (stages/planning/ways.hpp).
inline constexpr double kUnseenWeight = 2.0;

/// What it saw, how long it might take, how precise it was, which way it knew, how fast. One line each.
[[nodiscard]] std::vector<std::string> why_of(const DecisionEntry& entry);
/// What held it back, and what came of it. One line each.
[[nodiscard]] std::vector<std::string> outcome_of(const DecisionEntry& entry);

}  // namespace roborun::log
