/// Values of options that several commands share. Each function throws sitl::InputError with one line that
/// names the option and says what would be right.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "governor/policy/governor.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::app {

/// The parts between commas, empty ones included.
[[nodiscard]] std::vector<std::string> split(const std::string& text);
[[nodiscard]] governor::Design design_of(const char* option, const std::string& name);
[[nodiscard]] sitl::Mission mission_of(const std::string& name);
[[nodiscard]] std::uint64_t seed_of(const char* option, const std::string& text);

}  // namespace roborun::app
