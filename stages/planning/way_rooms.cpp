#include "stages/planning/way_rooms.hpp"

namespace roborun::stages {
namespace {

constexpr std::size_t kSide = std::size_t{2} * kBlockCells;
/// Of a row of cells the occupied ones in the lower half, those that are not free in the upper one.
using WideRows = std::array<std::uint64_t, kSide * kSide>;

/// The cells of eight blocks, as far as a vehicle of this width reaches into the others.
void gather(const WayCells& cells, std::size_t side, WideRows& rows) noexcept {
  for (std::size_t z = 0; z < side; ++z) {
    for (std::size_t y = 0; y < side; ++y) {
      std::uint64_t row = 0;
      const std::size_t at = kBlockCells * (z % kBlockCells) + y % kBlockCells;
      for (unsigned x = 0; x < 2; ++x) {
        const std::size_t index = x + 2 * (y / kBlockCells) + 4 * (z / kBlockCells);
        std::uint64_t half = cells.content[index] == BlockContent::kFree ? 0 : std::uint64_t{0xFFFF} << 32U;
        if (cells.content[index] == BlockContent::kMixed) {
          const CellBlock& block = *cells.block[index];
          const auto not_free = static_cast<std::uint16_t>(~block.free[at]);
          half =
              std::uint64_t{not_free} << 32U |
              (cells.only_sure ? unsigned{block.sure[at]} : unsigned{block.occupied[at]} | block.vague[at]);
        }
        row |= half << (16U * x);
      }
      rows[kSide * z + y] = row;
    }
  }
}

/// What is true of a place of `width` by doubling: of 1, 2, 4, .. cells, and then of two such that overlap.
template <typename Or>
void double_up(int width, const Or& or_with) noexcept {
  int have = 1;
  for (; 2 * have <= width; have *= 2) or_with(have);
  if (have < width) or_with(width - have);
}

/// Each cell becomes true if any of the `width` cells from it on is, along all three axes. What the upper half of a row
/// shifts into the lower one is above its places. `places`: wanted along each axis.
void spread(std::size_t side, int width, std::size_t places, WideRows& rows) noexcept {
  for (std::size_t z = 0; z < side; ++z) {
    const auto plane = rows.begin() + static_cast<std::ptrdiff_t>(kSide * z);
    double_up(width, [&](int by) {
      for (std::size_t y = 0; y < side; ++y)
        plane[static_cast<std::ptrdiff_t>(y)] |=
            plane[static_cast<std::ptrdiff_t>(y)] >> static_cast<unsigned>(by);
    });
    double_up(width, [&](int by) {
      const auto next = static_cast<std::size_t>(by);
      for (std::size_t y = 0; y + next < side; ++y)
        plane[static_cast<std::ptrdiff_t>(y)] |= plane[static_cast<std::ptrdiff_t>(y + next)];
    });
  }
  double_up(width, [&](int by) {
    const auto next = static_cast<std::size_t>(by);
    for (std::size_t z = 0; z + next < side; ++z) {
      for (std::size_t y = 0; y < places; ++y) rows[kSide * z + y] |= rows[kSide * (z + next) + y];
    }
  });
}

/// Of places of a cube of the middle those of the whole shape.
void round_out(const WayShape& shape, std::size_t places, WideRows& rows) noexcept {
  const auto longer = static_cast<std::size_t>(shape.width - shape.middle);
  if (longer == 0) return;
  const std::size_t aside = longer / 2;
  // What is read was not written yet: it lies behind.
  for (std::size_t z = 0; z < places; ++z) {
    for (std::size_t y = 0; y < places; ++y) {
      const std::uint64_t middle = rows[kSide * (z + aside) + y + aside];
      std::uint64_t row = 0;
      for (std::size_t i = 0; i <= longer; ++i)
        row |= middle >> i | (rows[kSide * (z + aside) + y + i] | rows[kSide * (z + i) + y + aside]) >> aside;
      rows[kSide * z + y] = row;
    }
  }
}

/// Bit x of a row becomes bit 4 x.
std::uint64_t apart(std::uint16_t row) noexcept {
  std::uint64_t bits = row;
  bits = (bits | bits << 24U) & 0x0000'00FF'0000'00FFULL;
  bits = (bits | bits << 12U) & 0x000F'000F'000F'000FULL;
  bits = (bits | bits << 6U) & 0x0303'0303'0303'0303ULL;
  return (bits | bits << 3U) & 0x1111'1111'1111'1111ULL;
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
      rooms.number[i] |= next * apart(room[i]);
    }
  }
}

}  // namespace

void find_places(const WayCells& cells, const WayShape& shape, int beyond, WayPlaces& places) noexcept {
  const std::size_t count = std::size_t{kBlockCells} + static_cast<std::size_t>(beyond);
  const std::size_t side = count + static_cast<std::size_t>(shape.width) - 1;
  WideRows rows{};
  gather(cells, side, rows);
  spread(side, shape.middle, count + static_cast<std::size_t>(shape.width - shape.middle), rows);
  round_out(shape, count, rows);
  const std::uint64_t all = (std::uint64_t{1} << count) - 1;
  // From here on known places in the upper half of a row, open ones in the lower one.
  for (std::uint64_t& row : rows) {
    const std::uint64_t blocked = row >> 32U;
    row = (~blocked & all) << 32U | (blocked & ~row & all);
  }
  for (int step = 0; step < beyond; ++step) {
    for (std::size_t z = 0; z < count; ++z) {
      for (std::size_t y = 0; y < count; ++y) {
        std::uint64_t& row = rows[kSide * z + y];
        std::uint64_t near = (row & all) >> 1U;
        if (y + 1 < count) near |= rows[kSide * z + y + 1] & all;
        if (z + 1 < count) near |= rows[kSide * (z + 1) + y] & all;
        row |= near & row >> 32U;
      }
    }
  }
  for (std::size_t i = 0; i < places.known.size(); ++i) {
    const std::uint64_t row = rows[kSide * (i / kBlockCells) + i % kBlockCells];
    places.known[i] = static_cast<std::uint16_t>(row >> 32U);
    places.open[i] = static_cast<std::uint16_t>(row);
  }
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
    if ((near & rows[i]) == room[i]) return false;  // all along x is in it
    const std::uint16_t grown = along_x(near & rows[i], rows[i]);
    const bool more = grown != room[i];
    room[i] = grown;
    return more;
  };
  for (std::size_t i = 0; i < room.size(); ++i)
    if (room[i] != 0) room[i] = along_x(room[i] & rows[i], rows[i]);
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
  number(places.open, kFirstOpenRoom, kFirstDoubtfulRoom - 1, rooms);
  number(places.doubtful, kFirstDoubtfulRoom, kRooms - 1, rooms);
}

}  // namespace roborun::stages
