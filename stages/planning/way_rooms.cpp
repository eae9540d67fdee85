#include "stages/planning/way_rooms.hpp"

namespace roborun::stages {
namespace {

constexpr std::size_t kSide = std::size_t{2} * kBlockCells;
using WideRows = std::array<std::uint32_t, kSide * kSide>;

/// The cells of eight blocks, as far as a vehicle of this width reaches into the others.
void gather(const WayCells& cells, std::size_t side, bool occupied, WideRows& rows) noexcept {
  for (std::size_t z = 0; z < side; ++z) {
    for (std::size_t y = 0; y < side; ++y) {
      std::uint32_t row = 0;
      for (unsigned x = 0; x < 2; ++x) {
        const std::size_t index = x + 2 * (y / kBlockCells) + 4 * (z / kBlockCells);
        std::uint32_t half = !occupied && cells.content[index] == BlockContent::kFree ? 0xFFFFU : 0U;
        if (cells.content[index] == BlockContent::kMixed) {
          const std::size_t at = kBlockCells * (z % kBlockCells) + y % kBlockCells;
          half = occupied ? cells.block[index]->occupied[at] : cells.block[index]->free[at];
        }
        row |= half << (16U * x);
      }
      rows[kSide * z + y] = row;
    }
  }
}

/// Each cell becomes true if any of the `width` cells from it on is, along all three axes.
void spread(std::size_t side, int width, WideRows& rows) noexcept {
  const auto many = static_cast<std::size_t>(width);
  for (std::size_t z = 0; z < side; ++z) {
    for (std::size_t y = 0; y < side; ++y) {
      const std::uint32_t row = rows[kSide * z + y];
      std::uint32_t all = row;
      for (int i = 1; i < width; ++i) all |= row >> static_cast<unsigned>(i);
      rows[kSide * z + y] = all;
    }
  }
  for (const std::size_t stride : {std::size_t{1}, kSide}) {
    for (std::size_t z = 0; z < side; ++z) {
      for (std::size_t y = 0; y < side; ++y) {
        const std::size_t along = stride == 1 ? y : z;
        if (along >= kBlockCells) continue;
        std::uint32_t all = 0;
        for (std::size_t i = 0; i < many; ++i) all |= rows[kSide * z + y + stride * i];
        rows[kSide * z + y] = all;
      }
    }
  }
}

void number(CellRows rows, unsigned first, unsigned last, WayRooms& rooms) noexcept {
  std::size_t at = 0;
  for (unsigned next = first; next <= last; ++next) {
    while (at < rows.size() && rows[at] == 0) ++at;
    if (at == rows.size()) return;
    CellRows room{};
    if (next == last) {
      room = rows;
    } else {
      room[at] = static_cast<std::uint16_t>(rows[at] & (~rows[at] + 1U));
      flood(rows, room);
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (room[i] == 0) continue;
      rows[i] = static_cast<std::uint16_t>(rows[i] & ~room[i]);
      for (unsigned x = 0; x < kBlockCells; ++x)
        rooms.number[i] |= (((std::uint32_t{room[i]} >> x) & 1U) != 0 ? std::uint64_t{next} : 0U) << (4U * x);
    }
  }
}

}  // namespace

void find_places(const WayCells& cells, int width, WayPlaces& places) noexcept {
  const auto side = static_cast<std::size_t>(kBlockCells + width - 1);
  WideRows blocked{}, shut{};
  gather(cells, side, false, blocked);
  for (std::uint32_t& row : blocked) row = ~row;
  gather(cells, side, true, shut);
  spread(side, width, blocked);
  spread(side, width, shut);
  for (std::size_t i = 0; i < places.known.size(); ++i) {
    const std::size_t at = kSide * (i / kBlockCells) + i % kBlockCells;
    places.known[i] = static_cast<std::uint16_t>(~blocked[at]);
    places.open[i] = static_cast<std::uint16_t>(blocked[at] & ~shut[at]);
  }
}

CellRows find_not_closed(const WayCells& cells, int width) noexcept {
  const auto side = static_cast<std::size_t>(kBlockCells + width - 1);
  WideRows shut{};
  gather(cells, side, true, shut);
  spread(side, width, shut);
  CellRows rows{};
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = static_cast<std::uint16_t>(~shut[kSide * (i / kBlockCells) + i % kBlockCells]);
  return rows;
}

void flood(const CellRows& rows, CellRows& room) noexcept {
  const auto along_x = [](std::uint32_t seed, std::uint32_t row) {
    for (std::uint32_t before = 0; seed != before;) {
      before = seed;
      seed |= ((seed << 1U) | (seed >> 1U)) & row;
    }
    return static_cast<std::uint16_t>(seed);
  };
  const auto grow = [&](std::size_t i) {
    if (rows[i] == 0) return false;
    std::uint32_t near = room[i];
    if (i % kBlockCells > 0) near |= room[i - 1];
    if (i % kBlockCells < kBlockCells - 1) near |= room[i + 1];
    if (i >= kBlockCells) near |= room[i - kBlockCells];
    if (i + kBlockCells < room.size()) near |= room[i + kBlockCells];
    const std::uint16_t grown = along_x(near & rows[i], rows[i]);
    const bool more = grown != room[i];
    room[i] = grown;
    return more;
  };
  // Each round there and back reaches at least one place more: a room has at most 4,096.
  for (int round = 0; round < 4096; ++round) {
    bool more = false;
    for (std::size_t i = 0; i < room.size(); ++i) more = grow(i) || more;
    for (std::size_t i = room.size(); i-- > 0;) more = grow(i) || more;
    if (!more) return;
  }
}

void number_rooms(const WayPlaces& places, WayRooms& rooms) noexcept {
  rooms = {};
  number(places.known, 1, kFirstOpenRoom - 1, rooms);
  number(places.open, kFirstOpenRoom, kRooms - 1, rooms);
}

}  // namespace roborun::stages
