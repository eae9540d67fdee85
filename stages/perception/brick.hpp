/// A brick: 16^3 cells of 0.3 m in Morton order, half a byte each, and one mip level for each coarser
/// precision up to its own 4.8 m.
#pragma once

#include <array>
#include <cstdint>

#include "stages/perception/brick_cells.hpp"
#include "stages/perception/cell_block.hpp"

namespace roborun::stages {

struct Brick {
  BrickWords word{};                                 ///< Level 0, the truth.
  std::array<std::uint8_t, 512 + 64 + 8 + 1> mip{};  ///< Levels 1 to 4, derived by refresh().
  bool dirty{};                                      ///< Written to in this scan.
  bool stale{};                                      ///< Cells changed since refresh().
  bool has_new{};                                    ///< Some are evidence::kMetNow.
  std::uint64_t revision{};                          ///< BrickMap's number of what the cells are now.
  std::uint16_t known_count{};                       ///< Cells that are not unknown.
  std::int32_t x{}, y{}, z{};                        ///< Position in bricks from the map's corner.
  std::int32_t cleared{};                            ///< BrickMap's mark of the last scan that saw past it.

  /// All cells become `value`: kUnknown or kFree.
  void fill(unsigned value) noexcept;
  /// Derives mip and known_count from the cells. O(4096).
  void refresh() noexcept;
  [[nodiscard]] unsigned cell(std::uint32_t morton) const noexcept {
    return static_cast<unsigned>(word[morton / kCellsPerWord] >> (4U * (morton % kCellsPerWord))) & 0xFU;
  }
  void set_cell(std::uint32_t morton, unsigned value) noexcept;
  /// All cells as bits. O(4096).
  void read(CellBlock& cells) const noexcept;
  /// The same in cells twice as large, into one of the eight halves of a block. After refresh().
  void read_doubled(std::size_t eighth, CellBlock& cells) const noexcept;
  /// Flags of the cell of `level` (0 .. 4) with this Morton index. After refresh(). O(1).
  [[nodiscard]] inline std::uint8_t flags(int level, std::uint32_t morton) const noexcept;
  /// Free evidence for the blocks of `level` with Morton index 8 * parent + i, for each bit i of `blocks`.
  void add_free(int level, std::uint32_t parent, std::uint8_t blocks, evidence::Past past = {}) noexcept;
  /// A surface in this cell of level 0.
  void add_hit(std::uint32_t morton) noexcept { set_cell(morton, evidence::after_hit(cell(morton))); }
  /// The same, but what was not occupied before this scan is met once, however many pixels of it say so.
  void add_hit_once(std::uint32_t morton) noexcept {
    const unsigned before = cell(morton);
    if (before == evidence::kMetNow) return;
    const bool is_new = !evidence::is_occupied(before);
    has_new = has_new || is_new;
    set_cell(morton, is_new ? evidence::kMetNow : evidence::after_hit(before));
  }
  /// A surface near this cell, nobody knows exactly where: what was free is not any more.
  void add_vague_hit(std::uint32_t morton) noexcept {
    if (!evidence::is_occupied(cell(morton))) set_cell(morton, evidence::kVague);
  }
  /// Something thin in it.
  void add_thin(std::uint32_t morton) noexcept { set_cell(morton, evidence::kThin); }
};

/// Index of an entry in Brick::mip; level 1 .. 4.
[[nodiscard]] constexpr std::size_t mip_index(int level, std::uint32_t morton) noexcept {
  constexpr std::array<std::size_t, 5> kStart{0, 0, 512, 576, 584};
  return kStart[static_cast<std::size_t>(level)] + morton;
}

inline std::uint8_t Brick::flags(int level, std::uint32_t morton) const noexcept {
  if (level > 0) return mip[mip_index(level, morton)];
  const unsigned value = cell(morton);
  if (evidence::is_occupied(value)) return content::kOccupied;
  return value == evidence::kFree ? content::kFree : content::kUnknown;
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
/// A cell's number along one axis inside its brick. RT-safe: O(1).
[[nodiscard]] constexpr std::uint32_t in_brick(std::int32_t cell) noexcept {
  return static_cast<std::uint32_t>(cell & (kBrickCells - 1));
}

}  // namespace roborun::stages
