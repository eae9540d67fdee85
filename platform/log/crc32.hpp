/// CRC-32 as zip, PNG and MCAP use it (ISO 3309: polynomial 0xEDB88320 reflected, start and end inverted).
#pragma once

#include <cstdint>
#include <string_view>

namespace roborun::log {

/// Of `bytes` that follow those of which `before` is the CRC-32; 0 for none before. crc32("123456789") is 0xCBF43926.
[[nodiscard]] std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) noexcept;

}  // namespace roborun::log
