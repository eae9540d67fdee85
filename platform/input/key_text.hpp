/// What a reference says of a key of a configuration file.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace roborun::input {

struct KeyText {
  std::string table, key;
  double low{}, high{}, value{};  ///< Both ends of the range are allowed; `value` is the default.
  std::string text;
};

/// The unit that a key's name ends in ("m/s" of speed_mps), or "-".
[[nodiscard]] std::string_view unit_of(std::string_view key);
/// One line per key: name, unit, range, default, meaning. Tables have a heading of their own.
[[nodiscard]] std::string reference_of(const std::vector<KeyText>& keys);

}  // namespace roborun::input
