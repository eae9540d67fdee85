/// Values of options that several commands share. What throws, throws InputError with one line that names the
/// option and says what would be right.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace roborun::input {

/// The parts between commas, empty ones included.
[[nodiscard]] std::vector<std::string> split(const std::string& text);
/// Nothing if the text is anything but a whole number from `low` to `high`.
[[nodiscard]] std::optional<int> whole_number(const std::string& text, int low, int high);
/// Nothing if the text is anything but a finite number.
[[nodiscard]] std::optional<double> number(const std::string& text);
/// Throws for anything but a whole number from `low` to `high`.
[[nodiscard]] int whole_of(std::string_view option, const std::string& text, int low, int high);
/// Throws for anything but a number from `low` to `high`.
[[nodiscard]] double number_of(std::string_view option, const std::string& text, double low, double high);
/// Throws.
[[nodiscard]] int jobs_of(const std::string& text);
/// Throws.
[[nodiscard]] std::uint64_t seed_of(std::string_view option, const std::string& text);
/// A word of a command line, as a shell reads it back.
[[nodiscard]] std::string shell_word(const std::string& word);

}  // namespace roborun::input
