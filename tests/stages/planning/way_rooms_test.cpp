#include "stages/planning/way_rooms.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "stages/perception/map_view.hpp"
#include "tests/support/box_view.hpp"

namespace roborun::stages {
namespace {

bool bit(const CellRows& rows, std::size_t row, std::size_t x) { return ((rows[row] >> x) & 1) != 0; }

/// Eight blocks of cells: some blocks all free or all unknown, the others at random.
struct Scene {
  explicit Scene(std::uint64_t seed) {
    core::CounterRng rng(seed, 1);
    const double unknown = rng.uniform(0.0, 0.03), occupied = rng.uniform(0.0, 0.02);
    for (std::size_t i = 0; i < 8; ++i) {
      const double kind = rng.uniform();
      cells.content[i] = kind < 0.15   ? BlockContent::kFree
                         : kind < 0.25 ? BlockContent::kUnknown
                                       : BlockContent::kMixed;
      cells.block[i] = &block[i];
      for (std::size_t row = 0; row < 256; ++row) {
        for (unsigned x = 0; x < 16; ++x) {
          const double draw = rng.uniform();
          const auto bit = static_cast<std::uint16_t>(1U << x);
          if (draw < occupied) block[i].occupied[row] |= bit;
          if (draw > occupied + unknown) block[i].free[row] |= bit;
        }
      }
    }
  }
  [[nodiscard]] CellState at(std::size_t x, std::size_t y, std::size_t z) const {
    const std::size_t i = x / 16 + 2 * (y / 16) + 4 * (z / 16);
    if (cells.content[i] == BlockContent::kFree) return CellState::kFree;
    if (cells.content[i] == BlockContent::kUnknown) return CellState::kUnknown;
    const std::size_t row = 16 * (z % 16) + y % 16;
    if (bit(block[i].occupied, row, x % 16)) return CellState::kOccupied;
    return bit(block[i].free, row, x % 16) ? CellState::kFree : CellState::kUnknown;
  }
  std::array<CellBlock, 8> block{};
  WayCells cells;
};

/// In cells, from the middle of the shape to what of a cell is nearest to it along one axis.
double to_cell(int width, int cell) {
  const double from = std::fabs(cell + 0.5 - 0.5 * width);
  return std::fmax(from - 0.5, 0.0);
}

bool is_in(const WayShape& shape, int x, int y, int z) {
  const double middle = 0.5 * shape.middle;
  int beyond = 0;
  for (const int cell : {x, y, z}) beyond += std::fabs(cell + 0.5 - 0.5 * shape.width) > middle ? 1 : 0;
  return beyond <= 1;
}

TEST(WayRooms, AShapeHoldsItsBallAndNoCellWithoutNeed) {
  for (double radius = 0.3; radius < 8.5; radius += 0.0371) {
    const WayShape shape = ball_shape(radius);
    ASSERT_EQ(shape.width, static_cast<int>(std::ceil(2.0 * radius)));
    ASSERT_LE(shape.middle, shape.width);
    ASSERT_EQ((shape.width - shape.middle) % 2, 0);
    for (int i = 0; i < shape.width * shape.width * shape.width; ++i) {
      const int x = i % shape.width, y = i / shape.width % shape.width, z = i / shape.width / shape.width;
      const double near =
          std::hypot(to_cell(shape.width, x), to_cell(shape.width, y), to_cell(shape.width, z));
      if (near < radius) {
        ASSERT_TRUE(is_in(shape, x, y, z)) << radius << " " << x << " " << y << " " << z;
      }
    }
    // With a middle that is two cells less the ball would not fit, or it is as small as it gets.
    const double corner = 0.5 * shape.middle - 1.0;
    ASSERT_TRUE(shape.middle <= 2 || std::hypot(corner, corner) < radius) << radius;
  }
}

TEST(WayRooms, PlacesAreThoseOfAShapeOfCells) {
  constexpr std::array<WayShape, 9> kShapes{
      {{1, 1}, {2, 2}, {3, 3}, {3, 1}, {4, 2}, {5, 5}, {6, 4}, {7, 3}, {9, 7}}};
  for (std::uint64_t seed = 0; seed < 27; ++seed) {
    const Scene scene(seed);
    const WayShape shape = kShapes[seed % kShapes.size()];
    WayPlaces places;
    find_places(scene.cells, shape, 0, places);
    for (std::size_t i = 0; i < 4096; ++i) {
      const std::size_t x = i % 16, y = i / 16 % 16, z = i / 256;
      bool free = true, occupied = false;
      for (int k = 0; k < shape.width * shape.width * shape.width; ++k) {
        const int dx = k % shape.width, dy = k / shape.width % shape.width,
                  dz = k / shape.width / shape.width;
        if (!is_in(shape, dx, dy, dz)) continue;
        const CellState state = scene.at(x + static_cast<std::size_t>(dx), y + static_cast<std::size_t>(dy),
                                         z + static_cast<std::size_t>(dz));
        free = free && state == CellState::kFree;
        occupied = occupied || state == CellState::kOccupied;
      }
      const std::size_t row = 16 * z + y;
      ASSERT_EQ(bit(places.known, row, x), free) << seed << " " << i;
      ASSERT_EQ(bit(places.open, row, x), !free && !occupied) << seed << " " << i;
    }
  }
}

TEST(WayRooms, AreTheConnectedPlacesOfOneKind) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Scene scene(seed);
    WayPlaces places;
    find_places(scene.cells, cube_shape(4), 0, places);
    WayPlaces narrow;
    find_places(scene.cells, cube_shape(3), 0, narrow);
    for (std::size_t row = 0; row < narrow.known.size(); ++row)
      places.doubtful[row] =
          static_cast<std::uint16_t>(narrow.known[row] & ~(places.known[row] | places.open[row]));
    WayRooms rooms;
    number_rooms(places, rooms);
    // Neighbours of one kind are in one room, unless the numbers ran out; each kind has its numbers.
    for (std::int32_t i = 0; i < 4096; ++i) {
      const std::int32_t x = i % 16, y = i / 16 % 16, z = i / 256;
      const std::size_t row = static_cast<std::size_t>(i) / 16;
      const bool known = bit(places.known, row, static_cast<std::size_t>(x));
      const bool open = bit(places.open, row, static_cast<std::size_t>(x));
      const bool doubtful = bit(places.doubtful, row, static_cast<std::size_t>(x));
      const unsigned room = rooms.at(x, y, z);
      ASSERT_EQ(is_known_room(room), known);
      ASSERT_EQ(room >= kFirstOpenRoom, open || doubtful);
      ASSERT_EQ(is_doubtful_room(room), doubtful);
      if (x < 15 && room != 0) {
        const unsigned next = rooms.at(x + 1, y, z);
        if (next != 0 && is_known_room(next) == known && is_doubtful_room(next) == doubtful) {
          ASSERT_EQ(room, next);
        }
      }
    }
    // A room is connected: whatever is reached from one of its places is all of it.
    for (unsigned room = 1; room < kRooms - 1; ++room) {
      if (room == kFirstOpenRoom - 1 || room == kFirstDoubtfulRoom - 1) continue;
      std::vector<std::int32_t> stack;
      std::vector<bool> seen(4096);
      std::size_t all = 0, reached = 0;
      for (std::int32_t i = 0; i < 4096; ++i) {
        if (rooms.at(i % 16, i / 16 % 16, i / 256) != room) continue;
        if (all++ == 0) stack.push_back(i), seen[static_cast<std::size_t>(i)] = true;
      }
      while (!stack.empty()) {
        const std::int32_t i = stack.back();
        stack.pop_back();
        ++reached;
        const auto visit = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
          if (((x | y | z) & ~15) != 0 || rooms.at(x, y, z) != room) return;
          const std::int32_t n = x + 16 * y + 256 * z;
          if (auto&& met = seen[static_cast<std::size_t>(n)]; !met) met = true, stack.push_back(n);
        };
        const std::int32_t x = i % 16, y = i / 16 % 16, z = i / 256;
        visit(x + 1, y, z), visit(x - 1, y, z), visit(x, y + 1, z), visit(x, y - 1, z), visit(x, y, z + 1),
            visit(x, y, z - 1);
      }
      EXPECT_EQ(reached, all) << "room " << room << " of seed " << seed;
    }
  }
}

TEST(ReadBlocks, InDoubledCellsFreeNeedsAllEightAndOccupiedOne) {
  test::BoxView view;
  view.free_W = {Vector3(-1.0, 1.1, -0.5), Vector3(7.0, 20.0, 9.0)};
  view.occupied = {{Vector3(3.1, 2.0, 1.0), Vector3(3.2, 4.0, 2.6)},
                   {Vector3(6.1, 8.5, 7.0), Vector3(6.9, 9.0, 7.2)}};
  CellBlock cells;
  std::uint64_t lookups = 0;
  ASSERT_EQ(read_blocks(view, Vector3::Zero(), 0.6, cells, lookups), BlockContent::kMixed);
  for (int i = 0; i < 4096; ++i) {
    const int x = i % 16, y = i / 16 % 16, z = i / 256;
    bool free = true, occupied = false;
    for (int k = 0; k < 8; ++k) {
      const Vector3 p_W =
          0.3 * Vector3(2 * x + (k & 1) + 0.5, 2 * y + (k >> 1 & 1) + 0.5, 2 * z + (k >> 2) + 0.5);
      free = free && view.at(p_W, lookups) == CellState::kFree;
      occupied = occupied || view.at(p_W, lookups) == CellState::kOccupied;
    }
    const auto row = static_cast<std::size_t>(16 * z + y), column = static_cast<std::size_t>(x);
    ASSERT_EQ(bit(cells.free, row, column), free) << x << ' ' << y << ' ' << z;
    ASSERT_EQ(bit(cells.occupied, row, column), occupied) << x << ' ' << y << ' ' << z;
  }
}

}  // namespace
}  // namespace roborun::stages
