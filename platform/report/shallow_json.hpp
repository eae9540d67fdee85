/// JSON from outside, of bearable depth: what is copied, printed and freed recursively stays shallow.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace roborun::report {

/// Discarded (is_discarded()) if the text is no JSON, or nested more than 32 deep.
[[nodiscard]] inline nlohmann::ordered_json parse_shallow(const std::string& text) {
  using Json = nlohmann::ordered_json;
  constexpr int kDeepest = 32;
  bool too_deep = false;
  // The parser keeps its own stack, and asks at every value.
  const auto shallow = [&too_deep](int depth, Json::parse_event_t, Json&) {
    too_deep = too_deep || depth > kDeepest;
    return !too_deep;
  };
  Json json = Json::parse(text, shallow, false);
  return too_deep ? Json(Json::value_t::discarded) : json;
}

}  // namespace roborun::report
