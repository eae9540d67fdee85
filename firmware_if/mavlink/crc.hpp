/// The checksum of MAVLink: CRC-16/MCRF4XX. Source: MAVLink developer guide, "Packet serialization".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace roborun::firmware_if::mavlink {

namespace detail {

// Polynomial 0x1021, least significant bit first.
inline constexpr auto kCrcTable = [] {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    auto crc = static_cast<std::uint16_t>(i);
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint16_t>((crc >> 1U) ^ ((crc & 1U) != 0 ? 0x8408U : 0U));
    table[i] = crc;
  }
  return table;
}();

}  // namespace detail

/// RT-safe: O(bytes).
class Crc {
 public:
  constexpr void add(std::uint8_t byte) noexcept {
    crc_ = static_cast<std::uint16_t>((crc_ >> 8U) ^ detail::kCrcTable[(crc_ ^ byte) & 0xffU]);
  }
  constexpr void add(std::span<const std::uint8_t> bytes) noexcept {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  constexpr void add(std::string_view text) noexcept {
    for (const char c : text) add(static_cast<std::uint8_t>(c));
  }
  [[nodiscard]] constexpr std::uint16_t value() const noexcept { return crc_; }

 private:
  std::uint16_t crc_{0xffff};
};

}  // namespace roborun::firmware_if::mavlink
