#include "stages/perception/brick.hpp"

#include <cstring>

#include "stages/perception/brick_flags.hpp"

namespace roborun::stages {
namespace {

using Word = std::uint64_t;
constexpr Word kOnes = 0x1111111111111111ULL;
constexpr Word kAll = ~Word{0};

/// Bit i of a byte becomes the half byte i of half a word.
constexpr std::array<std::uint32_t, 256> make_spread() noexcept {
  std::array<std::uint32_t, 256> spread{};
  for (std::size_t bits = 0; bits < 256; ++bits) {
    for (unsigned i = 0; i < 8; ++i)
      if (((bits >> i) & 1U) != 0) spread[bits] |= 0xFU << (4U * i);
  }
  return spread;
}
constexpr std::array<std::uint32_t, 256> kSpreadBits = make_spread();

/// Of a word's first cell the row 16 z + y and x. The cells of a word are 4 x 2 x 2, x lowest and highest.
struct PlaceOfWord {
  std::uint8_t row, x;
};
constexpr auto kPlaceOfWord = [] {
  std::array<PlaceOfWord, 256> place{};
  for (std::size_t w = 0; w < place.size(); ++w) {
    std::array<unsigned, 3> at{};
    for (unsigned bit = 0; bit < 8; ++bit)  // of the Morton index, from 4 on
      at[(bit + 4) % 3] |= static_cast<unsigned>((w >> bit) & 1U) << ((bit + 4) / 3);
    place[w] = {static_cast<std::uint8_t>(kBlockCells * at[2] + at[1]), static_cast<std::uint8_t>(at[0])};
  }
  return place;
}();

/// Bit 4 k becomes bit k; no others are set.
constexpr std::uint32_t gather_ones(Word bits) noexcept {
  bits = (bits | (bits >> 3U)) & 0x0303'0303'0303'0303ULL;
  bits = (bits | (bits >> 6U)) & 0x000F'000F'000F'000FULL;
  bits = (bits | (bits >> 12U)) & 0x0000'00FF'0000'00FFULL;
  return static_cast<std::uint32_t>((bits | (bits >> 24U)) & 0xFFFFU);
}

/// The lowest bit of each half byte that holds something thin: odd, more than 1, less than 8.
constexpr Word thin_in(Word word) noexcept {
  return word & ((word >> 1U) | (word >> 2U)) & ~(word >> 3U) & kOnes;
}

/// The lowest bit of each half byte that holds a surface that was met more than once: evidence::kSureFrom or more.
constexpr Word sure_in(Word word) noexcept {
  static_assert(evidence::kSureFrom == 0b1011U);
  return (word >> 3U) & ((word >> 2U) | ((word >> 1U) & word)) & kOnes;
}

/// The lowest bit of each half byte that is evidence::kVague.
constexpr Word vague_in(Word word) noexcept {
  static_assert(evidence::kVague == 0b0100U);
  return (word >> 2U) & ~(word | (word >> 1U) | (word >> 3U)) & kOnes;
}

/// evidence::after_miss() of those of sixteen cells whose half bytes are set in `selected`.
template <bool kInPart, bool kOfTheThin>
constexpr Word after_miss(Word word, Word selected) noexcept {
  const Word chosen = kOnes & selected;
  const Word occupied = (word >> 3U) & chosen;
  const Word thin = thin_in(word) & chosen;
  const Word blank = chosen & ~(occupied | thin);  // unknown, free, or half of both
  const Word first = kInPart ? blank & ~(word | (word >> 1U)) : Word{0};
  Word aged = (word & ~(blank * 0xFU)) | (blank ^ first) | (first << 1U);
  if (kOfTheThin) aged -= thin << 1U;
  aged -= occupied;
  const Word cleared = occupied & ~(aged >> 3U);  // 8 became 7 and has to become kFree
  return aged ^ (cleared * (evidence::kOccupied ^ evidence::kFree));
}
template <bool kInPart, bool kOfTheThin>
constexpr bool ages_as_its_cells() noexcept {
  for (const unsigned cell : {0U, 1U, 2U, 3U, 4U, 5U, 7U, 8U, 9U, 10U, 11U, 12U, 13U, 14U, 15U}) {
    const unsigned aged = evidence::after_miss(cell, {kInPart, kOfTheThin});
    if (after_miss<kInPart, kOfTheThin>(kOnes * cell, kAll) != kOnes * aged) return false;
    if (after_miss<kInPart, kOfTheThin>(kOnes * cell, 0xF0) != (kOnes * cell ^ ((cell ^ aged) << 4U)))
      return false;
  }
  return true;
}
static_assert(ages_as_its_cells<false, false>() && ages_as_its_cells<false, true>() &&
              ages_as_its_cells<true, false>() && ages_as_its_cells<true, true>());

/// True if a cell changed.
template <bool kInPart, bool kOfTheThin>
bool miss(BrickWords& word, int level, std::uint32_t parent, std::uint8_t blocks) noexcept {
  Word changed = 0;
  const auto age = [&changed](Word& w, Word selected) {
    const Word aged = after_miss<kInPart, kOfTheThin>(w, selected);
    changed |= w ^ aged;
    w = aged;
  };
  if (level == 0) {
    age(word[parent / 2], Word{kSpreadBits[blocks]} << (32U * (parent % 2)));
  } else if (level == 1) {
    for (unsigned i = 0; i < 4; ++i) {
      const unsigned two = (std::uint32_t{blocks} >> (2U * i)) & 3U;
      age(word[4 * std::size_t{parent} + i],
          ((two & 1U) != 0 ? 0xFFFFFFFFULL : 0U) | ((two & 2U) != 0 ? 0xFFFFFFFFULL << 32U : 0U));
    }
  } else {
    const std::size_t count = (std::size_t{1} << (3U * static_cast<unsigned>(level))) / kCellsPerWord;
    for (std::size_t i = 0; i < 8; ++i) {
      if (((std::uint32_t{blocks} >> i) & 1U) == 0) continue;
      Word* const first = &word[(8 * std::size_t{parent} + i) * count];
      for (std::size_t k = 0; k < count; ++k) age(first[k], kAll);
    }
  }
  return changed != 0;
}

}  // namespace

void Brick::fill(unsigned value) noexcept {
  word.fill(kOnes * value);
  mip.fill(value == evidence::kUnknown ? content::kUnknown : content::kFree);
  known_count = value == evidence::kUnknown ? 0 : kCellsPerBrick;
  stale = false;
}

void Brick::refresh() noexcept {
  for (std::size_t w = 0; has_new && w < word.size(); ++w) {
    static_assert(evidence::kMetNow == 0b0110U && evidence::kOccupied + evidence::kHit == 0b1010U);
    const Word met_now = (word[w] >> 1U) & (word[w] >> 2U) & ~word[w] & ~(word[w] >> 3U) & kOnes;
    word[w] ^= met_now * 0b1100U;
  }
  has_new = false;
  known_count = static_cast<std::uint16_t>(brick_flags(word, mip.data()));
  std::size_t from = 0;
  std::size_t to = 512;
  for (std::size_t count = 64; count >= 1; count /= 8) {
    for (std::size_t i = 0; i < count; ++i) {
      std::uint64_t flags = 0;
      std::memcpy(&flags, mip.data() + from + 8 * i, sizeof flags);
      flags |= flags >> 32U;
      flags |= flags >> 16U;
      mip[to + i] = static_cast<std::uint8_t>(flags | (flags >> 8U));
    }
    from = to;
    to += count;
  }
  stale = false;
}

void Brick::read(CellBlock& cells) const noexcept {
  cells = {};
  for (std::size_t w = 0; w < word.size(); ++w) {
    if (word[w] == kOnes * evidence::kUnknown) continue;
    const auto [first_row, cx] = kPlaceOfWord[w];
    const Word not_free = word[w] ^ (kOnes * evidence::kFree);
    const Word folded = not_free | (not_free >> 1U) | (not_free >> 2U) | (not_free >> 3U);
    const std::uint32_t free = gather_ones(~folded & kOnes);
    const std::uint32_t occupied = gather_ones(((word[w] >> 3U) & kOnes) | thin_in(word[w]));
    const std::uint32_t vague = gather_ones(vague_in(word[w]));
    const std::uint32_t sure = gather_ones(sure_in(word[w]));
    for (unsigned pair = 0; pair < 4; ++pair) {
      const auto four = [pair](std::uint32_t bits) {
        return (bits >> (2U * pair) & 3U) | (bits >> (2U * pair + 6U) & 12U);
      };
      const std::size_t row = first_row + kBlockCells * (pair / 2) + pair % 2;
      cells.free[row] = static_cast<std::uint16_t>(cells.free[row] | (four(free) << cx));
      cells.occupied[row] = static_cast<std::uint16_t>(cells.occupied[row] | (four(occupied) << cx));
      cells.vague[row] = static_cast<std::uint16_t>(cells.vague[row] | (four(vague) << cx));
      cells.sure[row] = static_cast<std::uint16_t>(cells.sure[row] | (four(sure) << cx));
    }
  }
}

void Brick::read_doubled(std::size_t eighth, CellBlock& cells) const noexcept {
  static_assert(content::kOccupied == 2);
  constexpr Word kBytes = 0x0101010101010101ULL;
  constexpr std::size_t kHalf = kBlockCells / 2;
  // The lowest bits of eight bytes as one byte.
  const auto gather = [](Word bits) { return static_cast<unsigned>(bits * 0x0102040810204080ULL >> 56U); };
  const std::size_t at = kBlockCells * kHalf * (eighth >> 2U) + kHalf * (eighth >> 1U & 1U);
  if (mip.back() == content::kFree) {
    const unsigned row = (eighth & 1U) != 0 ? 0xFF00U : 0xFFU;
    for (std::size_t i = 0; i < 64; ++i) {
      std::uint16_t& to = cells.free[at + kBlockCells * (i / kHalf) + i % kHalf];
      to = static_cast<std::uint16_t>(to | row);
    }
    return;
  }
  for (std::size_t i = 0; i < 64; ++i) {  // of level 2: eight of level 1
    Word flags = 0;
    std::memcpy(&flags, mip.data() + 8 * i, sizeof flags);
    const Word other = flags ^ (kBytes * content::kFree);
    const unsigned free = gather(~(other | other >> 1U | other >> 2U) & kBytes);
    const unsigned occupied = gather(flags >> 1U & kBytes);
    unsigned sure = 0, vague = 0;
    for (std::size_t half = 0; half < 8 && free != 0xFFU; ++half) {
      const auto has = [half](Word bits) {
        return (bits >> (32U * (half % 2)) & 0xFFFFFFFFU) != 0 ? 1U << half : 0U;
      };
      sure |= has(sure_in(word[4 * i + half / 2]));
      vague |= has(vague_in(word[4 * i + half / 2]));
    }
    if ((free | occupied | vague) == 0) continue;
    const auto [first_row, cx] = kPlaceOfWord[4 * i];
    const unsigned shift = cx / 2U + ((eighth & 1U) != 0 ? 8U : 0U);
    for (std::size_t pair = 0; pair < 4; ++pair) {
      const std::size_t row = at + first_row / 2U + kBlockCells * (pair / 2) + pair % 2;
      cells.free[row] = static_cast<std::uint16_t>(cells.free[row] | (free >> (2U * pair) & 3U) << shift);
      cells.occupied[row] =
          static_cast<std::uint16_t>(cells.occupied[row] | (occupied >> (2U * pair) & 3U) << shift);
      cells.vague[row] = static_cast<std::uint16_t>(cells.vague[row] | (vague >> (2U * pair) & 3U) << shift);
      cells.sure[row] = static_cast<std::uint16_t>(cells.sure[row] | (sure >> (2U * pair) & 3U) << shift);
    }
  }
}

void Brick::set_cell(std::uint32_t morton, unsigned value) noexcept {
  const unsigned shift = 4U * (morton % kCellsPerWord);
  Word& w = word[morton / kCellsPerWord];
  const Word before = w;
  w = (w & ~(Word{0xF} << shift)) | (Word{value} << shift);
  stale = stale || w != before;
}

void Brick::add_free(int level, std::uint32_t parent, std::uint8_t blocks, evidence::Past past) noexcept {
  bool changed = false;
  if (past.of_the_thin) {
    changed = past.in_part ? miss<true, true>(word, level, parent, blocks)
                           : miss<false, true>(word, level, parent, blocks);
  } else {
    changed = past.in_part ? miss<true, false>(word, level, parent, blocks)
                           : miss<false, false>(word, level, parent, blocks);
  }
  stale = stale || changed;
}

}  // namespace roborun::stages
