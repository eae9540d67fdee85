#include "platform/input/arguments.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <sstream>

#include "platform/input/input_error.hpp"

namespace roborun::input {

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  if (text.empty() || text.back() == ',') parts.emplace_back();  // getline drops an empty last one
  return parts;
}

std::optional<int> whole_number(const std::string& text, int low, int high) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < low || value > high)
    return std::nullopt;
  return value;
}

std::optional<double> number(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

int whole_of(std::string_view option, const std::string& text, int low, int high) {
  const auto value = whole_number(text, low, high);
  if (!value)
    throw InputError(fmt::format("{}: '{}' is out of range: must be a whole number from {} to {}", option,
                                 text, low, high));
  return *value;
}

double number_of(std::string_view option, const std::string& text, double low, double high) {
  const auto value = number(text);
  if (!value || !(*value >= low && *value <= high))
    throw InputError(
        fmt::format("{}: '{}' is out of range: must be a number from {} to {}", option, text, low, high));
  return *value;
}

int jobs_of(const std::string& text) { return whole_of("--jobs", text, 1, 1024); }

std::uint64_t seed_of(std::string_view option, const std::string& text) {
  std::uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (error != std::errc{} || end != text.data() + text.size())
    throw InputError(fmt::format(
        "{}: '{}' is not a seed: must be a whole number from 0 to 18446744073709551615", option, text));
  return seed;
}

std::string shell_word(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace roborun::input
