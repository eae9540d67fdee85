/// JSON from outside.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "platform/input/input_error.hpp"

namespace roborun::input {

/// Deeper is nothing that roborun writes; what is copied, printed and freed recursively stays shallow.
inline constexpr int kDeepestJson = 64;

/// What nlohmann's library says, without its prefix and in one line of bearable length.
[[nodiscard]] inline std::string json_complaint(const std::exception& error) {
  constexpr std::size_t kMost = 200;
  std::string what = error.what();
  if (const std::size_t end = what.find("] "); what.starts_with("[json.") && end != std::string::npos)
    what.erase(0, end + 2);
  if (what.size() > kMost) what = what.substr(0, kMost) + " ...";
  return what;
}

/// Throws InputError "not JSON: WHY", also for values nested more than kDeepestJson deep and numbers that no
/// double holds.
template <typename Json = nlohmann::ordered_json>
[[nodiscard]] Json parse_json(std::string_view text) {
  using Event = typename Json::parse_event_t;
  // The parser keeps its own stack, and asks before it goes one deeper.
  const auto shallow = [](int depth, Event event, Json& /*value*/) {
    if (depth >= kDeepestJson && (event == Event::object_start || event == Event::array_start))
      throw InputError(fmt::format("not JSON: nested more than {} deep", kDeepestJson));
    return true;
  };
  try {
    return Json::parse(text, shallow);
  } catch (const typename Json::exception& error) {
    throw InputError(fmt::format("not JSON: {}", json_complaint(error)));
  }
}

}  // namespace roborun::input
