/// The two checksums of DroneCAN. Source: UAVCAN v0 specification, "CAN bus transport layer" and "DSDL".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace roborun::firmware_if::dronecan {

namespace detail {

inline constexpr auto kCrc16Table = [] {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    auto crc = static_cast<std::uint16_t>(i << 8U);
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint16_t>((crc << 1) ^ ((crc & 0x8000) != 0 ? 0x1021 : 0));
    table[i] = crc;
  }
  return table;
}();

}  // namespace detail

/// CRC-16/CCITT-FALSE over `bytes`, continued from `crc`. RT-safe: O(bytes).
[[nodiscard]] constexpr std::uint16_t crc16(std::span<const std::uint8_t> bytes,
                                            std::uint16_t crc = 0xffff) noexcept {
  for (const std::uint8_t byte : bytes)
    crc = static_cast<std::uint16_t>((crc << 8U) ^ detail::kCrc16Table[(crc >> 8U) ^ byte]);
  return crc;
}

/// The start value of a transfer's CRC: the data type signature, low byte first, so that a transfer decoded
/// as another type does not pass.
[[nodiscard]] constexpr std::uint16_t transfer_crc_seed(std::uint64_t signature) noexcept {
  std::array<std::uint8_t, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(signature >> (8U * i));
  return crc16(bytes);
}

/// CRC-64/WE, bit by bit: only ever evaluated by the compiler.
class Crc64 {
 public:
  constexpr void add(std::uint8_t byte) noexcept {
    crc_ ^= static_cast<std::uint64_t>(byte) << 56U;
    for (int bit = 0; bit < 8; ++bit)
      crc_ = (crc_ >> 63U) != 0 ? (crc_ << 1U) ^ 0x42f0e1eba9ea3693ULL : crc_ << 1U;
  }
  constexpr void add_little_endian(std::uint64_t value) noexcept {
    for (unsigned i = 0; i < 8; ++i) add(static_cast<std::uint8_t>(value >> (8U * i)));
  }
  [[nodiscard]] constexpr std::uint64_t value() const noexcept { return ~crc_; }

 private:
  std::uint64_t crc_{~std::uint64_t{0}};
};

}  // namespace roborun::firmware_if::dronecan
