/// Bytes that are mostly ASCII as UTF-8 and back, without loss: a byte >= 0x80 is the code point of that number.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace roborun::input {

[[nodiscard]] std::string text_of_bytes(std::span<const std::uint8_t> bytes);
/// Nothing if a code point is above U+00FF.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> bytes_of_text(std::string_view text);

}  // namespace roborun::input
