#include "platform/log/crc32.hpp"

#include <array>
#include <cstring>

namespace roborun::log {
namespace {

constexpr std::size_t kSlices = 8;

/// table[k][b]: the remainder of byte b with k zero bytes behind it, so that eight bytes are taken at once.
constexpr std::array<std::array<std::uint32_t, 256>, kSlices> make_table() {
  std::array<std::array<std::uint32_t, 256>, kSlices> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t remainder = byte;
    for (int bit = 0; bit < 8; ++bit)
      remainder = (remainder >> 1U) ^ ((remainder & 1U) != 0 ? 0xEDB88320U : 0U);
    table[0][byte] = remainder;
  }
  for (std::size_t k = 1; k < kSlices; ++k)
    for (std::size_t byte = 0; byte < 256; ++byte)
      table[k][byte] = (table[k - 1][byte] >> 8U) ^ table[0][table[k - 1][byte] & 0xFFU];
  return table;
}

constexpr auto kTable = make_table();

}  // namespace

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) noexcept {
  std::uint32_t crc = ~before;
  for (; bytes.size() >= kSlices; bytes.remove_prefix(kSlices)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), kSlices);
    word ^= crc;
    // Written out: the compiler leaves a loop of eight as a loop, at a third of the speed.
    crc = kTable[7][word & 0xFFU] ^ kTable[6][(word >> 8U) & 0xFFU] ^ kTable[5][(word >> 16U) & 0xFFU] ^
          kTable[4][(word >> 24U) & 0xFFU] ^ kTable[3][(word >> 32U) & 0xFFU] ^
          kTable[2][(word >> 40U) & 0xFFU] ^ kTable[1][(word >> 48U) & 0xFFU] ^
          kTable[0][static_cast<std::uint8_t>(word >> 56U)];
  }
  for (const char byte : bytes)
    crc = (crc >> 8U) ^ kTable[0][(crc ^ static_cast<std::uint8_t>(byte)) & 0xFFU];
  return ~crc;
}

}  // namespace roborun::log
