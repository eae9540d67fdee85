#include "platform/input/arguments.hpp"

#include <fmt/format.h>

#include <charconv>
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

int jobs_of(const std::string& text) {
  const auto jobs = whole_number(text, 1, 1024);
  if (!jobs)
    throw InputError(
        fmt::format("--jobs: '{}' is out of range: must be a whole number from 1 to 1024", text));
  return *jobs;
}

std::uint64_t seed_of(const char* option, const std::string& text) {
  std::size_t used = 0;
  std::uint64_t seed = 0;
  try {
    if (!text.empty() && text[0] >= '0' && text[0] <= '9') seed = std::stoull(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size())
    throw InputError(fmt::format(
        "{}: '{}' is not a seed: must be a whole number from 0 to 18446744073709551615", option, text));
  return seed;
}

}  // namespace roborun::input
