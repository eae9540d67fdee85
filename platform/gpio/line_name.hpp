/// What a line goes by.
#pragma once

#include <fmt/format.h>

#include <charconv>
#include <string>

namespace roborun::gpio {

/// CHIP:OFFSET taken apart, or a name alone.
struct LineName {
  std::string chip;  ///< Empty: it is a name.
  unsigned offset{};
};

/// False, and `why` in one line: it is neither.
[[nodiscard]] inline bool parse(const std::string& name, LineName& out, std::string& why) {
  const std::size_t colon = name.find(':');
  if (colon == std::string::npos) return true;
  out.chip = name.substr(0, colon);
  const char* const end = name.data() + name.size();
  const auto parsed = std::from_chars(name.data() + colon + 1, end, out.offset);
  if (!out.chip.empty() && parsed.ec == std::errc{} && parsed.ptr == end) return true;
  why = fmt::format("line '{}': must be a name or CHIP:OFFSET", name);
  return false;
}

}  // namespace roborun::gpio
