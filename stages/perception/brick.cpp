#include "stages/perception/brick.hpp"

#include <span>

namespace roborun::stages {

void Brick::clear(std::int32_t bx, std::int32_t by, std::int32_t bz) noexcept {
  cell.fill(evidence::kUnknown);
  mip.fill(content::kUnknown);
  x = bx;
  y = by;
  z = bz;
  known_count = 0;
  dirty = false;
}

void Brick::refresh() noexcept {
  unsigned known = 0;
  for (std::size_t i = 0; i < 512; ++i) {
    std::uint8_t flags = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      const std::int8_t value = cell[8 * i + k];
      flags = static_cast<std::uint8_t>(flags | (value == evidence::kUnknown
                                                     ? content::kUnknown
                                                     : (value > 0 ? content::kOccupied : content::kFree)));
      known += value != evidence::kUnknown ? 1U : 0U;
    }
    mip[i] = flags;
  }
  std::size_t from = 0;
  std::size_t to = 512;
  for (std::size_t count = 64; count >= 1; count /= 8) {
    for (std::size_t i = 0; i < count; ++i) {
      std::uint8_t flags = 0;
      for (std::size_t k = 0; k < 8; ++k) flags = static_cast<std::uint8_t>(flags | mip[from + 8 * i + k]);
      mip[to + i] = flags;
    }
    from = to;
    to += count;
  }
  known_count = static_cast<std::uint16_t>(known);
  dirty = false;
}

std::uint8_t Brick::flags(int level, std::uint32_t morton) const noexcept {
  if (level > 0) return mip[mip_index(level, morton)];
  const std::int8_t value = cell[morton];
  if (value == evidence::kUnknown) return content::kUnknown;
  return value > 0 ? content::kOccupied : content::kFree;
}

void Brick::add_free(int level, std::uint32_t morton) noexcept {
  const std::size_t count = std::size_t{1} << (3U * static_cast<unsigned>(level));
  for (std::int8_t& value : std::span(cell).subspan(morton * count, count))
    value = evidence::after_miss(value);
  dirty = true;
}

void Brick::add_hit(std::uint32_t morton) noexcept {
  cell[morton] = evidence::after_hit(cell[morton]);
  dirty = true;
}

}  // namespace roborun::stages
