/// The cells of a brick: what a cell holds, and how they are packed. Sixteen cells of half a byte share a word.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/precision.hpp"

namespace roborun::stages {

inline constexpr int kBrickLevel = 4;                 ///< A brick is one cell of this level.
inline constexpr int kBrickCells = 1 << kBrickLevel;  ///< Per edge.
inline constexpr std::size_t kCellsPerBrick = 4096;
inline constexpr double kBrick_m = cell_size_m(kBrickLevel);

/// What a cell holds, four bits: unknown, free, or occupied with evidence 1 .. 8. One look through free space
/// makes it free; one surface makes it occupied whatever was there; kMost looks through it clear the oldest
/// obstacle, kHit looks one that was seen once.
namespace evidence {
inline constexpr unsigned kUnknown = 0;
inline constexpr unsigned kFree = 1;
inline constexpr unsigned kOccupied = 7;  ///< Plus the evidence: bit 3 is set of what is occupied alone.
inline constexpr unsigned kHit = 3;
inline constexpr unsigned kMost = 8;

[[nodiscard]] constexpr bool is_occupied(unsigned cell) noexcept { return cell > kOccupied; }
[[nodiscard]] constexpr unsigned after_hit(unsigned cell) noexcept {
  const unsigned next = (is_occupied(cell) ? cell : kOccupied) + kHit;
  return next > kOccupied + kMost ? kOccupied + kMost : next;
}
[[nodiscard]] constexpr unsigned after_miss(unsigned cell) noexcept {
  return cell > kOccupied + 1 ? cell - 1 : kFree;
}
}  // namespace evidence

/// What a mip entry says of the cells below it: a set of flags.
namespace content {
inline constexpr std::uint8_t kUnknown = 1;
inline constexpr std::uint8_t kOccupied = 2;
inline constexpr std::uint8_t kFree = 4;  ///< An entry that equals kFree is free all over.
}  // namespace content

inline constexpr std::size_t kCellsPerWord = 16;
/// The cell with Morton index m is bits 4 (m % 16) and up of word m / 16.
using BrickWords = std::array<std::uint64_t, kCellsPerBrick / kCellsPerWord>;

}  // namespace roborun::stages
