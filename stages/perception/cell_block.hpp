/// 16^3 cells of a map at its finest, as bits: for what reads much of a map at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace roborun::stages {

inline constexpr int kBlockCells = 16;  ///< Per edge.
/// Edge of a block.
[[nodiscard]] constexpr double block_m(double finest_m) noexcept { return kBlockCells * finest_m; }

/// Bit x of row 16 z + y is the cell (x, y, z) from the block's corner.
using CellRows = std::array<std::uint16_t, std::size_t{kBlockCells} * kBlockCells>;

enum class BlockContent : std::uint8_t { kUnknown, kFree, kMixed };

/// Known free cells and occupied ones; what is neither is unknown.
struct CellBlock {
  CellRows free{};
  CellRows occupied{};
  CellRows sure{};  ///< Of the occupied: met in more than one look, and not only something thin.
  CellRows
      vague{};  ///< Of the unknown (of coarse cells: of all but the free): a surface is about there, nobody knows exactly where.
};

}  // namespace roborun::stages
