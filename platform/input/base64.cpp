#include "platform/input/base64.hpp"

#include <algorithm>
#include <cstdint>

namespace roborun::input {
namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::size_t kGroup = 4;  // digits, of three bytes
constexpr char kPadding = '=';

}  // namespace

std::string to_base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * kGroup);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::string_view three = bytes.substr(i, 3);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8U | (k < three.size() ? static_cast<std::uint8_t>(three[k]) : 0U);
    for (std::size_t k = 0; k < kGroup; ++k)
      text += k <= three.size() ? kDigits[word >> (18U - 6U * k) & 0x3FU] : kPadding;
  }
  return text;
}

std::optional<std::string> from_base64(std::string_view text) {
  if (text.size() % kGroup != 0) return std::nullopt;
  std::size_t padding = 0;
  while (padding < std::min<std::size_t>(2, text.size()) && text[text.size() - 1 - padding] == kPadding)
    ++padding;
  std::string bytes;
  bytes.reserve(text.size() / kGroup * 3);
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t digit = i + padding < text.size() ? kDigits.find(text[i]) : 0;
    if (digit == std::string_view::npos) return std::nullopt;
    word = word << 6U | static_cast<std::uint32_t>(digit);
    if (i % kGroup != kGroup - 1) continue;
    for (const unsigned shift : {16U, 8U, 0U}) bytes += static_cast<char>(word >> shift & 0xFFU);
    word = 0;
  }
  bytes.erase(bytes.size() - std::min(padding, bytes.size()));
  return bytes;
}

}  // namespace roborun::input
