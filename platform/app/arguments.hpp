/// Values of options that several commands share. Each function but split() and whole_number() throws
/// sitl::InputError with one line that names the option and says what would be right.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "governor/policy/governor.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::app {

/// The parts between commas, empty ones included.
[[nodiscard]] std::vector<std::string> split(const std::string& text);
[[nodiscard]] governor::Design design_of(const char* option, const std::string& name);
[[nodiscard]] sitl::Mission mission_of(const std::string& name);
/// Nothing if the text is anything but a whole number from `low` to `high`.
[[nodiscard]] std::optional<int> whole_number(const std::string& text, int low, int high);
[[nodiscard]] int jobs_of(const std::string& text);
[[nodiscard]] std::uint64_t seed_of(const char* option, const std::string& text);

}  // namespace roborun::app
