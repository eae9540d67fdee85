/// The vector kernel that derives the finest mip level of a brick from its cells.
#pragma once

#include "stages/perception/brick_cells.hpp"

namespace roborun::stages {

/// Sets mip[i] to the content flags of the cells 8 i .. 8 i + 7, for i < kCellsPerBrick / 8. Returns how many
/// cells are known. RT-safe: O(4096).
[[nodiscard]] std::size_t brick_flags(const BrickWords& word, std::uint8_t* mip) noexcept;

}  // namespace roborun::stages
