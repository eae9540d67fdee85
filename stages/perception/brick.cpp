#include "stages/perception/brick.hpp"

#include <cstring>

#include "stages/perception/block_sight.hpp"

namespace roborun::stages {
namespace {

using Word = std::uint64_t;
constexpr Word kSigns = 0x8080808080808080ULL;
static_assert(evidence::kFree == -1 && evidence::kUnknown == -128, "free_eight() relies on the bits");

/// Bit i of a byte becomes byte i of a word.
constexpr std::array<Word, 256> make_spread() noexcept {
  std::array<Word, 256> spread{};
  for (std::size_t bits = 0; bits < 256; ++bits) {
    for (unsigned i = 0; i < 8; ++i)
      if (((bits >> i) & 1U) != 0) spread[bits] |= Word{0xFF} << (8U * i);
  }
  return spread;
}
constexpr std::array<Word, 256> kSpreadBits = make_spread();

}  // namespace

void Brick::fill(std::int8_t value) noexcept {
  cell.fill(value);
  mip.fill(value == evidence::kUnknown ? content::kUnknown : content::kFree);
  known_count = value == evidence::kUnknown ? 0 : kCellsPerBrick;
  stale = false;
}

void Brick::refresh() noexcept {
  known_count = static_cast<std::uint16_t>(brick_flags(cell, mip.data()));
  std::size_t from = 0;
  std::size_t to = 512;
  for (std::size_t count = 64; count >= 1; count /= 8) {
    for (std::size_t i = 0; i < count; ++i) {
      std::uint64_t word = 0;
      std::memcpy(&word, mip.data() + from + 8 * i, sizeof word);
      word |= word >> 32U;
      word |= word >> 16U;
      mip[to + i] = static_cast<std::uint8_t>(word | (word >> 8U));
    }
    from = to;
    to += count;
  }
  stale = false;
}

std::uint8_t Brick::flags(int level, std::uint32_t morton) const noexcept {
  if (level > 0) return mip[mip_index(level, morton)];
  const std::int8_t value = cell[morton];
  if (value == evidence::kUnknown) return content::kUnknown;
  return value > 0 ? content::kOccupied : content::kFree;
}

Word Brick::load(std::size_t first) const noexcept {
  Word word = 0;
  std::memcpy(&word, cell.data() + first, sizeof word);
  return word;
}

void Brick::free_eight(std::size_t first, Word selected) noexcept {
  const Word word = load(first);
  if ((~word & kSigns & selected) == 0) {  // nothing occupied: all of them become kFree
    const Word next = word | selected;
    std::memcpy(cell.data() + first, &next, sizeof next);
    return;
  }
  for (std::size_t i = 0; i < 8; ++i) {
    if (((selected >> (8U * i)) & 1U) != 0) cell[first + i] = evidence::after_miss(cell[first + i]);
  }
}

void Brick::add_free(int level, std::uint32_t parent, std::uint8_t blocks) noexcept {
  stale = true;
  const std::size_t base = 8 * std::size_t{parent};
  if (level == 0) {
    free_eight(base, kSpreadBits[blocks]);
    return;
  }
  const std::size_t count = std::size_t{1} << (3U * static_cast<unsigned>(level));
  for (std::size_t i = 0; i < 8; ++i) {
    if (((blocks >> i) & 1U) == 0) continue;
    const std::size_t first = (base + i) * count;
    Word occupied = 0;
    for (std::size_t k = 0; k < count; k += 8) occupied |= ~load(first + k) & kSigns;
    if (occupied == 0) {
      std::memset(cell.data() + first, static_cast<unsigned char>(evidence::kFree), count);
    } else {
      for (std::size_t k = 0; k < count; k += 8) free_eight(first + k, ~Word{0});
    }
  }
}

void Brick::add_hit(std::uint32_t morton) noexcept {
  cell[morton] = evidence::after_hit(cell[morton]);
  stale = true;
}

}  // namespace roborun::stages
