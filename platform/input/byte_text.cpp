#include "platform/input/byte_text.hpp"

namespace roborun::input {

std::string text_of_bytes(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (byte < 0x80) {
      text += static_cast<char>(byte);
    } else {
      text += static_cast<char>(0xc0U | (byte >> 6U));
      text += static_cast<char>(0x80U | (byte & 0x3fU));
    }
  }
  return text;
}

std::optional<std::vector<std::uint8_t>> bytes_of_text(std::string_view text) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    auto byte = static_cast<std::uint8_t>(text[i]);
    if (byte >= 0x80) {
      const bool two = (byte == 0xc2 || byte == 0xc3) && i + 1 < text.size();
      if (!two) return std::nullopt;
      byte =
          static_cast<std::uint8_t>((unsigned{byte} << 6U) | (static_cast<unsigned char>(text[++i]) & 0x3fU));
    }
    bytes.push_back(byte);
  }
  return bytes;
}

}  // namespace roborun::input
