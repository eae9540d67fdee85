/// Values of options that several commands share. What throws, throws InputError with one line that names the
/// option and says what would be right.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace roborun::input {

/// The parts between commas, empty ones included.
[[nodiscard]] std::vector<std::string> split(const std::string& text);
/// Nothing if the text is anything but a whole number from `low` to `high`.
[[nodiscard]] std::optional<int> whole_number(const std::string& text, int low, int high);
/// Throws.
[[nodiscard]] int jobs_of(const std::string& text);
/// Throws.
[[nodiscard]] std::uint64_t seed_of(const char* option, const std::string& text);

}  // namespace roborun::input
