/// Base64 (RFC 4648) with padding.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace roborun::input {

[[nodiscard]] std::string to_base64(std::string_view bytes);
/// Nothing for what is not whole groups of four, with padding at the end alone.
[[nodiscard]] std::optional<std::string> from_base64(std::string_view text);

}  // namespace roborun::input
