/// A brick: 16^3 cells of 0.3 m in Morton order, and one mip level for each coarser precision up to its
/// own 4.8 m.
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

/// What a cell holds: kUnknown, or evidence: negative is free, positive occupied. One look through free space
/// makes it free; one surface makes it occupied whatever was there; kMost / kMiss = 10 looks through it clear
/// the oldest obstacle.
namespace evidence {
inline constexpr std::int8_t kUnknown = -128;
inline constexpr std::int8_t kFree = -1;
inline constexpr std::int8_t kHit = 6;
inline constexpr std::int8_t kMiss = 2;
inline constexpr std::int8_t kMost = 20;

[[nodiscard]] constexpr std::int8_t after_hit(std::int8_t cell) noexcept {
  const int base = cell > 0 ? cell : 0;
  return static_cast<std::int8_t>(base + kHit > kMost ? kMost : base + kHit);
}
[[nodiscard]] constexpr std::int8_t after_miss(std::int8_t cell) noexcept {
  return cell > kMiss ? static_cast<std::int8_t>(cell - kMiss) : kFree;
}
}  // namespace evidence

/// What a mip entry says of the cells below it: a set of flags.
namespace content {
inline constexpr std::uint8_t kUnknown = 1;
inline constexpr std::uint8_t kOccupied = 2;
inline constexpr std::uint8_t kFree = 4;  ///< An entry that equals kFree is free all over.
}  // namespace content

struct Brick {
  std::array<std::int8_t, kCellsPerBrick> cell{};    ///< Level 0, Morton order: the truth.
  std::array<std::uint8_t, 512 + 64 + 8 + 1> mip{};  ///< Levels 1 to 4, derived by refresh().
  std::int32_t x{}, y{}, z{};                        ///< Position in bricks from the map's corner.
  std::uint16_t known_count{};                       ///< Cells that are not unknown.
  bool dirty{};                                      ///< Written to in this scan.
  bool stale{};                                      ///< Cells changed since refresh().

  /// All cells become `value`: kUnknown or kFree.
  void fill(std::int8_t value) noexcept;
  /// Derives mip and known_count from cell. O(4096).
  void refresh() noexcept;
  /// Flags of the cell of `level` (0 .. 4) with this Morton index. After refresh(). O(1).
  [[nodiscard]] std::uint8_t flags(int level, std::uint32_t morton) const noexcept;
  /// Free evidence for the blocks of `level` with Morton index 8 * parent + i, for each bit i of `blocks`.
  void add_free(int level, std::uint32_t parent, std::uint8_t blocks) noexcept;
  /// A surface in this cell of level 0.
  void add_hit(std::uint32_t morton) noexcept;

 private:
  [[nodiscard]] std::uint64_t load(std::size_t first) const noexcept;
  /// Free evidence for those of eight cells whose bytes are set in `selected`.
  void free_eight(std::size_t first, std::uint64_t selected) noexcept;
};

/// Index of an entry in Brick::mip; level 1 .. 4.
[[nodiscard]] constexpr std::size_t mip_index(int level, std::uint32_t morton) noexcept {
  constexpr std::array<std::size_t, 5> kStart{0, 0, 512, 576, 584};
  return kStart[static_cast<std::size_t>(level)] + morton;
}

inline constexpr std::array<std::uint16_t, 16> kMortonSpread{0x000, 0x001, 0x008, 0x009, 0x040, 0x041,
                                                             0x048, 0x049, 0x200, 0x201, 0x208, 0x209,
                                                             0x240, 0x241, 0x248, 0x249};

/// Interleaves the low four bits of x, y, z: x lowest.
[[nodiscard]] constexpr std::uint32_t morton3(std::uint32_t x, std::uint32_t y, std::uint32_t z) noexcept {
  return static_cast<std::uint32_t>(kMortonSpread[x & 15U]) |
         (static_cast<std::uint32_t>(kMortonSpread[y & 15U]) << 1U) |
         (static_cast<std::uint32_t>(kMortonSpread[z & 15U]) << 2U);
}

}  // namespace roborun::stages
