/// What a decision was, value by value in the order of its stages: what a replay compares.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "platform/flight/decision_pipeline.hpp"
#include "platform/mission/inputs_format.hpp"

namespace roborun::mission {

/// Bits of whole numbers and of doubles.
using DecisionValues = std::array<std::uint64_t, kDecisionValues>;

[[nodiscard]] DecisionValues values_of(const flight::DecisionOutput& decision) noexcept;
/// Of all coefficients of a trajectory, and when it starts.
[[nodiscard]] std::uint64_t hash_of(const Trajectory& trajectory) noexcept;

struct NamedValue {
  const char* stage;
  const char* name;
};
[[nodiscard]] NamedValue name_of_value(std::size_t index) noexcept;
/// For a reader.
[[nodiscard]] std::string text_of_value(std::size_t index, std::uint64_t bits);

}  // namespace roborun::mission
