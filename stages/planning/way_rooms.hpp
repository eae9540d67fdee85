/// Where a vehicle fits inside one block of the map: its rooms, connected places of one kind.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "stages/perception/cell_block.hpp"

namespace roborun::stages {

/// The cells of a vehicle: three boxes of width x middle x middle about one centre, the long edge along each axis; a cube where both
/// are the same. width - middle is even.
struct WayShape {
  int width{1}, middle{1};
};
[[nodiscard]] constexpr WayShape cube_shape(int width) noexcept { return {width, width}; }
/// The least one that holds every cell which a ball of this radius about its centre touches, in cells.
[[nodiscard]] inline WayShape ball_shape(double radius_cells) noexcept {
  constexpr double kRootTwo = 1.41421356;
  constexpr double kExact = 1e-6;  // a ball that ends on the border of a cell does not touch the next one
  const auto up = [](double cells) { return std::max(static_cast<int>(std::ceil(cells - kExact)), 1); };
  const int width = up(2.0 * radius_cells);
  // What is beyond the middle on two axes is at least root two of half the middle away.
  const int middle = up(kRootTwo * radius_cells);
  return {width, middle + (width - middle) % 2};
}

/// A place (x, y, z) of a block is that of a vehicle whose width begins with this cell on each axis. Known: all its
/// cells are free. Open: none is occupied, some unknown. Doubtful: neither, but a narrower box at its corner
/// would be, if only what is surely occupied counted.
/// Anything else is closed. Rooms 1 .. 7 are known, 8 .. 12 open, 13 .. 15 doubtful; 0 is closed. What is more than fits
/// the numbers joins the last one.
inline constexpr unsigned kFirstOpenRoom = 8;
inline constexpr unsigned kFirstDoubtfulRoom = 13;
inline constexpr unsigned kRooms = 16;
[[nodiscard]] constexpr bool is_known_room(unsigned room) noexcept {
  return room > 0 && room < kFirstOpenRoom;
}
[[nodiscard]] constexpr bool is_doubtful_room(unsigned room) noexcept { return room >= kFirstDoubtfulRoom; }

struct WayRooms {
  std::array<std::uint64_t, 256> number{};  ///< Of place x in row 16 z + y, in bits 4 x and up.
  [[nodiscard]] unsigned at(std::int32_t x, std::int32_t y, std::int32_t z) const noexcept {
    const std::int32_t row = 16 * z + y;
    return static_cast<unsigned>(number[static_cast<std::size_t>(row)] >> (4 * x)) & 15U;
  }
};

/// A block and the seven that follow it in x, y, z (bit 0, 1, 2 of the index): their cells. Null: all of one kind.
struct WayCells {
  std::array<const CellBlock*, 8> block{};
  std::array<BlockContent, 8> content{};
  bool only_sure{};  ///< Of the occupied only the sure ones count; else what is vague does, too.
};

/// The rows of places of a block that are of one kind.
struct WayPlaces {
  CellRows known{}, open{}, doubtful{};
};
/// The known and the open ones. Open are the known ones, too, that are at most `beyond` places before an open one: a vehicle that is so much wider ends there, before a
/// hole that a narrow one looks into. width + beyond at most 17. RT-safe: O(beyond * 32^2) rounds.
void find_places(const WayCells& cells, const WayShape& shape, int beyond, WayPlaces& places) noexcept;
/// All places that are connected with those of `room`, of those in `rows`. RT-safe: O(256 * 16) rounds.
void flood(const CellRows& rows, CellRows& room) noexcept;
/// Numbers the rooms. RT-safe: O(rooms * 256 * 16).
void number_rooms(const WayPlaces& places, WayRooms& rooms) noexcept;

}  // namespace roborun::stages
