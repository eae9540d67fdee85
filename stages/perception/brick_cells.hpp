/// The cells of a brick: what a cell holds, and how they are packed. Sixteen cells of half a byte share a word.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace roborun::stages {

inline constexpr int kBrickLevel = 4;                 ///< A brick is one cell of this level.
inline constexpr int kBrickCells = 1 << kBrickLevel;  ///< Per edge.
inline constexpr std::size_t kCellsPerBrick = 4096;

/// What a cell holds, four bits: unknown, free, or a surface.
///   0       unknown
///   1       free: seen past
///   2       seen past in part, once: still unknown
///   4       unknown, but a surface is about here, too far away to say in which cell
///   3 5 7   something thin, evidence 1 .. 3: only looks that would have seen it take from it
///   6       a surface that this scan is the first to meet, of a camera that mixes: evidence kHit from the next refresh() on
///   8 .. 15 a surface, evidence 1 .. 8
/// One look past all of a cell makes it free, two looks past a part of it do; one surface makes it occupied whatever was
/// there; 8 looks past it clear the oldest obstacle, kHit looks one that was seen once.
namespace evidence {
inline constexpr unsigned kUnknown = 0;
inline constexpr unsigned kFree = 1;
inline constexpr unsigned kPartlyFree = 2;
inline constexpr unsigned kVague = 4;
inline constexpr unsigned kThin = 7;      ///< As it is when it was just seen.
inline constexpr unsigned kOccupied = 7;  ///< Plus the evidence.
inline constexpr unsigned kHit = 3;
inline constexpr unsigned kMetNow = 6;
inline constexpr unsigned kMost = 8;

[[nodiscard]] constexpr bool is_occupied(unsigned cell) noexcept {
  return cell > kPartlyFree && cell != kVague;
}
[[nodiscard]] constexpr bool is_thin(unsigned cell) noexcept {
  return is_occupied(cell) && cell <= kThin && cell != kMetNow;
}
/// From this value on a surface was met in more than one look (or by more than one pixel, of a camera that does not mix).
inline constexpr unsigned kSureFrom = kOccupied + kHit + 1;
[[nodiscard]] constexpr unsigned after_hit(unsigned cell) noexcept {
  if (is_thin(cell)) return kThin;
  const unsigned next = (is_occupied(cell) ? cell : kOccupied) + kHit;
  return next > kOccupied + kMost ? kOccupied + kMost : next;
}
/// What a look past a cell was like.
struct Past {
  bool in_part{};      ///< Many pixels had no information.
  bool of_the_thin{};  ///< It counts for what is thin.
};
[[nodiscard]] constexpr unsigned after_miss(unsigned cell, Past past = {}) noexcept {
  if (is_thin(cell)) return past.of_the_thin ? cell - 2 : cell;
  if (is_occupied(cell)) return cell > kOccupied + 1 ? cell - 1 : kFree;
  return past.in_part && (cell == kUnknown || cell == kVague) ? kPartlyFree : kFree;
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
