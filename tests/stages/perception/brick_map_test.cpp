#include "stages/perception/brick_map.hpp"

#include <gtest/gtest.h>

#include "core/random/counter_rng.hpp"
#include "stages/perception/point_cloud.hpp"
#include "stages/perception/space_profiler.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;

/// All that a cell can hold.
constexpr std::array<unsigned, 15> kStates{0, 1, 2, 3, 4, 5, 7, 8, 9, 10, 11, 12, 13, 14, 15};

TEST(Brick, MipsSayWhatTheCellsSay) {
  core::CounterRng rng(1);
  auto sut = std::make_unique<Brick>();
  sut->fill(evidence::kUnknown);
  std::size_t known = 0;
  for (std::uint32_t m = 0; m < kCellsPerBrick; ++m) {
    const auto kind = static_cast<unsigned>(rng.below(30));
    sut->set_cell(m, kind < kStates.size() ? kStates[kind] : evidence::kFree);
    known += sut->cell(m) == evidence::kFree || evidence::is_occupied(sut->cell(m)) ? 1U : 0U;
  }
  sut->refresh();
  EXPECT_EQ(sut->known_count, known);
  for (int level = 1; level <= kBrickLevel; ++level) {
    const std::size_t size = std::size_t{1} << (3 * level);
    for (std::uint32_t m = 0; m < kCellsPerBrick / size; ++m) {
      std::uint8_t expected = 0;
      for (std::size_t i = m * size; i < (m + 1) * size; ++i)
        expected = static_cast<std::uint8_t>(expected | sut->flags(0, static_cast<std::uint32_t>(i)));
      ASSERT_EQ(sut->flags(level, m), expected) << level << " " << m;
    }
  }
}

TEST(Brick, ReadsWhatIsFreeOccupiedAndSurelyOccupied) {
  core::CounterRng rng(9);
  auto sut = std::make_unique<Brick>();
  sut->fill(evidence::kFree);
  for (int n = 0; n < 400; ++n)
    sut->set_cell(static_cast<std::uint32_t>(rng.below(kCellsPerBrick)), kStates[rng.below(kStates.size())]);
  sut->refresh();
  CellBlock cells, doubled{};
  sut->read(cells);
  constexpr std::size_t kEighth = 6;  // low x, high y and z
  sut->read_doubled(kEighth, doubled);
  const auto bit = [](const CellRows& rows, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return ((rows[16 * z + y] >> x) & 1) != 0;
  };
  CellRows expected{}, expected_vague{};
  for (std::uint32_t i = 0; i < kCellsPerBrick; ++i) {
    const std::uint32_t x = i % 16, y = i / 16 % 16, z = i / 256;
    const unsigned cell = sut->cell(morton3(x, y, z));
    ASSERT_EQ(bit(cells.free, x, y, z), cell == evidence::kFree);
    ASSERT_EQ(bit(cells.occupied, x, y, z), evidence::is_occupied(cell));
    const bool sure = cell > evidence::kOccupied && cell > evidence::after_hit(evidence::kFree);
    ASSERT_EQ(bit(cells.sure, x, y, z), sure) << cell;
    ASSERT_EQ(bit(cells.vague, x, y, z), cell == evidence::kVague);
    const std::uint32_t row = 16 * (z / 2 + 8) + y / 2 + 8;
    const auto half = [x](std::uint16_t& r) { r = static_cast<std::uint16_t>(r | 1U << (x / 2)); };
    if (sure) half(expected[row]);
    if (cell == evidence::kVague) half(expected_vague[row]);
  }
  EXPECT_EQ(doubled.sure, expected);
  EXPECT_NE(doubled.sure, doubled.occupied);
  EXPECT_EQ(doubled.vague, expected_vague);
}

TEST(Brick, EvidenceIsBounded) {
  unsigned cell = evidence::after_miss(evidence::kUnknown);
  EXPECT_EQ(cell, evidence::kFree);
  const auto looks_until_free = [](unsigned occupied) {
    int misses = 0;
    for (; evidence::is_occupied(occupied); ++misses) occupied = evidence::after_miss(occupied);
    return misses;
  };
  cell = evidence::after_hit(cell);
  EXPECT_TRUE(evidence::is_occupied(cell)) << "one surface is enough";
  EXPECT_EQ(looks_until_free(cell), 3) << "and survives two looks past it";
  for (int i = 0; i < 100; ++i) cell = evidence::after_hit(cell);
  EXPECT_EQ(looks_until_free(cell), 8);
}

TEST(Brick, WhatManyPixelsOfOneScanMeetIsMetOnce) {
  auto sut = std::make_unique<Brick>();
  sut->fill(evidence::kFree);
  constexpr std::uint32_t kCell = 77;
  CellBlock cells;
  const auto scan = [&] {
    for (int pixel = 0; pixel < 5; ++pixel) sut->add_hit_once(kCell);
    sut->refresh();
    sut->read(cells);
    return std::any_of(cells.sure.begin(), cells.sure.end(), [](std::uint16_t row) { return row != 0; });
  };
  EXPECT_FALSE(scan());
  EXPECT_EQ(sut->cell(kCell), evidence::after_hit(evidence::kFree));
  EXPECT_EQ(sut->flags(1, kCell / 8) & content::kOccupied, content::kOccupied);
  EXPECT_TRUE(scan()) << "met again";
  sut->set_cell(kCell, evidence::kThin);
  EXPECT_FALSE(scan());
  EXPECT_EQ(sut->cell(kCell), evidence::kThin) << "what is thin stays so";
}

TEST(Brick, TwoLooksPastAPartAreALookPastAllOfIt) {
  unsigned cell = evidence::after_miss(evidence::kUnknown, {.in_part = true});
  EXPECT_EQ(cell, evidence::kPartlyFree);
  EXPECT_FALSE(evidence::is_occupied(cell));
  EXPECT_EQ(evidence::after_miss(cell), evidence::kFree);
  EXPECT_EQ(evidence::after_miss(cell, {.in_part = true}), evidence::kFree);
  EXPECT_EQ(evidence::after_miss(evidence::kFree, {.in_part = true}), evidence::kFree)
      << "what is free stays so";
  EXPECT_TRUE(evidence::is_occupied(evidence::after_hit(cell)));
}

TEST(Brick, OnlyLooksThatWouldHaveMetItTakeFromWhatIsThin) {
  unsigned cell = evidence::kThin;
  for (int i = 0; i < 100; ++i) cell = evidence::after_miss(cell);
  EXPECT_EQ(cell, evidence::kThin);
  for (int i = 0; i < 2; ++i) cell = evidence::after_miss(cell, {.of_the_thin = true});
  EXPECT_TRUE(evidence::is_occupied(cell));
  EXPECT_EQ(evidence::after_hit(cell), evidence::kThin) << "seen again";
  EXPECT_EQ(evidence::after_miss(cell, {.of_the_thin = true}), evidence::kFree);
}

TEST(Brick, AVagueSurfaceIsUnknownUntilItIsMetOrSeenPast) {
  auto sut = std::make_unique<Brick>();
  sut->fill(evidence::kFree);
  sut->add_vague_hit(7);
  sut->refresh();
  EXPECT_EQ(sut->cell(7), evidence::kVague) << "what was free is so no longer";
  EXPECT_EQ(sut->flags(0, 7), content::kUnknown);
  EXPECT_EQ(sut->known_count, kCellsPerBrick - 1);
  sut->add_hit(7);
  EXPECT_EQ(sut->cell(7), evidence::after_hit(evidence::kUnknown)) << "as if nothing had been known";
  sut->add_vague_hit(7);
  EXPECT_TRUE(evidence::is_occupied(sut->cell(7))) << "what is known better stays";
  EXPECT_EQ(evidence::after_miss(evidence::kVague), evidence::kFree);
  EXPECT_EQ(evidence::after_miss(evidence::kVague, {.in_part = true}), evidence::kPartlyFree);
}

TEST(Brick, FreesBlocksAsItWouldTheirCells) {
  core::CounterRng rng(7);
  auto sut = std::make_unique<Brick>(), by_cell = std::make_unique<Brick>();
  for (int level = 0; level <= kBrickLevel; ++level) {
    for (int n = 0; n < 50; ++n) {
      for (std::uint32_t m = 0; m < kCellsPerBrick; ++m) {
        const unsigned cell = kStates[rng.below(kStates.size())];
        sut->set_cell(m, cell);
        by_cell->set_cell(m, cell);
      }
      const auto size = std::uint32_t{1} << (3 * level);
      const auto parent =
          static_cast<std::uint32_t>(level < kBrickLevel ? rng.below(kCellsPerBrick / size / 8) : 0);
      const auto blocks = static_cast<std::uint8_t>(level < kBrickLevel ? rng.below(256) : 1);
      const evidence::Past past{n % 2 == 1, n % 4 > 1};
      sut->add_free(level, parent, blocks, past);
      for (std::uint32_t i = 0; i < 8; ++i) {
        if (((blocks >> i) & 1) == 0) continue;
        for (std::uint32_t m = (8 * parent + i) * size; m < (8 * parent + i + 1) * size; ++m)
          by_cell->set_cell(m, evidence::after_miss(by_cell->cell(m), past));
      }
      ASSERT_EQ(sut->word, by_cell->word) << level;
    }
  }
}

TEST(Morton, InterleavesThreeAxes) {
  EXPECT_EQ(morton3(1, 0, 0), 1U);
  EXPECT_EQ(morton3(0, 1, 0), 2U);
  EXPECT_EQ(morton3(0, 0, 1), 4U);
  EXPECT_EQ(morton3(15, 15, 15), 4095U);
}

class BrickMapTest : public ::testing::Test {
 protected:
  explicit BrickMapTest(std::size_t max_bricks = 2000) : block_(64U << 20U), arena_(block_) {
    config_.bounds_W = {Vector3(-30, -30, -3), Vector3(30, 30, 12)};
    config_.max_bricks = max_bricks;
    config_.max_image_width = config_.max_image_height = 64;
    sut_ = std::make_unique<BrickMap>(config_, arena_);
    scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)},
                    {Vector3(6, -2, 0), Vector3(8, 2, 12)},
                    {Vector3(-9, 4, 0), Vector3(-7, 6, 12)}};
  }
  std::vector<std::byte> block_;
  core::Arena arena_;
  BrickMap::Config config_;
  std::unique_ptr<BrickMap> sut_;
  test::Scene scene_;
  const Vector3 at_{0.1, 0.2, 5.0};
  core::UnlimitedBudget unlimited_;
  IntegrationResult result_;
};

TEST_F(BrickMapTest, BoxesAgreeWithTheirCellsAtEveryPrecision) {
  const std::array<Vector3, 1> here{at_};
  ASSERT_EQ(sut_->integrate({scene_.look(at_), 0, kInfinity, here}, unlimited_, result_), Status::kOk);
  core::CounterRng rng(2);
  int free_boxes = 0;
  for (int level = 0; level < kPrecisionLevels; ++level) {
    core::Work work;
    (void)sut_->export_view({level, kInfinity, at_}, unlimited_, work);
    const MapView& view = sut_->view();
    std::uint64_t lookups = 0;
    for (int n = 0; n < 2000; ++n) {
      const Vector3 c(rng.uniform(-14, 14), rng.uniform(-14, 14), rng.uniform(1, 9));
      const double half = rng.uniform(0.05, 1.5);
      // Brute force over points no farther apart than a third of the finest cell.
      bool expected = true;
      for (double x = -half; expected && x <= half + 1e-9; x += half / std::ceil(half / 0.1)) {
        for (double y = -half; expected && y <= half + 1e-9; y += half / std::ceil(half / 0.1)) {
          for (double z = -half; expected && z <= half + 1e-9; z += half / std::ceil(half / 0.1)) {
            expected = view.at(c + Vector3(x, y, z), lookups) == CellState::kFree;
          }
        }
      }
      const bool actual = view.is_free(Aabb::around(c, half), lookups);
      ASSERT_TRUE(!actual || expected) << "a box is free only if all its points are, level " << level;
      free_boxes += actual ? 1 : 0;
      if (level == 0) {
        ASSERT_EQ(actual, expected);
      }
    }
  }
  EXPECT_GT(free_boxes, 500);
}

TEST_F(BrickMapTest, CoarseScansLeaveUnknownWhatFineOnesClear) {
  const std::array<Vector3, 1> here{at_};
  double last_m3 = 1e18;
  for (int level = 0; level < 5; ++level) {
    std::vector<std::byte> block(64U << 20U);
    core::Arena arena(block);
    BrickMap map(config_, arena);
    ASSERT_EQ(map.integrate({scene_.look(at_), level, kInfinity, here}, unlimited_, result_), Status::kOk);
    EXPECT_LE(result_.work.volume_m3, last_m3 * 1.0001) << level;
    last_m3 = result_.work.volume_m3;
  }
  EXPECT_GT(last_m3, 100.0);
}

TEST_F(BrickMapTest, ACoarseLookNeverClearsAFineSurface) {
  const std::array<Vector3, 1> here{at_};
  const auto frames = scene_.look(at_);
  (void)sut_->integrate({frames, 0, kInfinity, here}, unlimited_, result_);
  core::Work work;
  (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  std::uint64_t lookups = 0;
  std::vector<Vector3> surface;
  for (double y = -1.95; y < 2; y += 0.3) {
    for (const double x : {5.85, 6.15}) {
      if (sut_->view().at(Vector3(x, y, 5.05), lookups) == CellState::kOccupied)
        surface.emplace_back(x, y, 5.05);
    }
  }
  ASSERT_GT(surface.size(), 5U);
  for (int i = 0; i < 20; ++i)
    (void)sut_->integrate({frames, 2 + i % 4, kInfinity, here}, unlimited_, result_);
  (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  for (const Vector3& p : surface)
    EXPECT_EQ(sut_->view().at(p, lookups), CellState::kOccupied) << p.transpose();
}

TEST_F(BrickMapTest, ACoarseLookSeesWhatAppearsInFreeSpace) {
  const std::array<Vector3, 1> here{at_};
  test::Scene before = scene_;
  before.solid.resize(1);  // the floor
  for (int level = 1; level < kPrecisionLevels; ++level) {
    std::vector<std::byte> block(64U << 20U);
    core::Arena arena(block);
    BrickMap map(config_, arena);
    (void)map.integrate({before.look(at_), 0, kInfinity, here}, unlimited_, result_);
    core::Work work;
    (void)map.export_view({0, kInfinity, at_}, unlimited_, work);
    std::uint64_t lookups = 0;
    ASSERT_TRUE(is_segment_free(map.view(), at_, Vector3(7, 0.2, 5), 0.3, lookups));
    ASSERT_EQ(map.integrate({scene_.look(at_), level, kInfinity, here}, unlimited_, result_), Status::kOk);
    (void)map.export_view({0, kInfinity, at_}, unlimited_, work);
    EXPECT_FALSE(is_segment_free(map.view(), at_, Vector3(7, 0.2, 5), 0.3, lookups)) << level;
    EXPECT_TRUE(is_segment_free(map.view(), at_, Vector3(5, 0.2, 5), 0.3, lookups)) << "only where it is";
  }
}

TEST_F(BrickMapTest, WhereAPixelOfACoarseLookEndsNothingStaysFree) {
  core::CounterRng rng(8);
  int ended_in_free_space = 0;
  for (int n = 0; n < 8; ++n) {
    std::vector<std::byte> block(64U << 20U);
    core::Arena arena(block);
    BrickMap map(config_, arena);
    test::Scene scene = scene_;
    const std::array<Vector3, 2> here{at_, at_ + Vector3(0.7, -0.4, 0.3)};
    (void)map.integrate({scene.look(here[0]), 0, kInfinity, std::span(here).first(1)}, unlimited_, result_);
    for (int pole = 0; pole < 12; ++pole) {
      const Vector3 low(rng.uniform(-12, 12), rng.uniform(-12, 12), rng.uniform(0.5, 6));
      if ((low - at_).norm() > 2.5)
        scene.solid.push_back({low, low + Vector3(0.17, 0.23, rng.uniform(0.2, 4))});
    }
    const auto frames = scene.look(here[1]);
    core::Work work;
    std::uint64_t lookups = 0;
    (void)map.export_view({0, kInfinity, at_}, unlimited_, work);
    std::vector<Vector3> free_ends;
    for (const PosedDepthFrame& posed : frames) {
      for (std::size_t i = 0; i < posed.frame.depth_m.size(); ++i) {
        const auto depth_m = static_cast<double>(posed.frame.depth_m[i]);
        if (!(depth_m < 20.0)) continue;
        const double u = static_cast<double>(i % 64) + 0.5, v = static_cast<double>(i / 64) + 0.5;
        const Vector3 p_W = posed.X_WC * (depth_m * Vector3(1.0, 1.0 - u / 32.0, 1.0 - v / 32.0));
        const Vector3 in_cell = p_W / 0.3 - (p_W / 0.3).array().floor().matrix();
        const bool clear_case = in_cell.minCoeff() > 0.01 && in_cell.maxCoeff() < 0.99;
        if (clear_case && map.view().at(p_W, lookups) == CellState::kFree) free_ends.push_back(p_W);
      }
    }
    ended_in_free_space += static_cast<int>(free_ends.size());
    const int level = kBrickLevel + n % 2;
    ASSERT_EQ(map.integrate({frames, level, kInfinity, here}, unlimited_, result_), Status::kOk);
    (void)map.export_view({0, kInfinity, at_}, unlimited_, work);
    for (const Vector3& p_W : free_ends)
      EXPECT_EQ(map.view().at(p_W, lookups), CellState::kOccupied) << level << ": " << p_W.transpose();
  }
  EXPECT_GT(ended_in_free_space, 500);
}

class NotSquare : public BrickMapTest, public ::testing::WithParamInterface<std::pair<int, int>> {};

TEST_P(NotSquare, SurfacesAreWhereTheyAre) {
  const std::array<Vector3, 1> here{at_};
  const auto frames = scene_.look(at_, GetParam().first, 20.0F, GetParam().second);
  ASSERT_EQ(sut_->integrate({frames, 0, kInfinity, here}, unlimited_, result_), Status::kOk);
  core::Work work;
  (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  std::uint64_t lookups = 0;
  int found = 0;
  for (double x = -13.35; x < 14; x += 0.3)
    for (double y = -13.35; y < 14; y += 0.3)
      for (double z = -0.45; z < 8; z += 0.3) {
        if (sut_->view().at(Vector3(x, y, z), lookups) != CellState::kOccupied) continue;
        ++found;
        const Aabb around = Aabb::around(Vector3(x, y, z), 0.31);
        bool solid = false;
        for (const Aabb& box : scene_.solid)
          solid = solid || ((box.min_W.array() <= around.max_W.array()).all() &&
                            (box.max_W.array() >= around.min_W.array()).all());
        ASSERT_TRUE(solid) << x << " " << y << " " << z;
      }
  EXPECT_GT(found, 500);
}
INSTANTIATE_TEST_SUITE_P(Images, NotSquare, ::testing::Values(std::pair{64, 40}, std::pair{40, 64}));

TEST_F(BrickMapTest, ACoarseLookNotesSurfacesInUnknownBricksUntilAFinerOne) {
  const std::array<Vector3, 1> here{at_};
  const auto frames = scene_.look(at_);
  const auto cells = [this](int level) {
    core::Work work;
    (void)sut_->export_view({level, kInfinity, at_}, unlimited_, work);
    std::array<int, 3> count{};
    std::uint64_t lookups = 0;
    for (double x = -13.35; x < 14; x += 0.3)
      for (double y = -13.35; y < 14; y += 0.3)
        for (const double z : {-0.15, 0.15})
          ++count[static_cast<std::size_t>(sut_->view().at(Vector3(x, y, z), lookups))];
    return count;
  };
  constexpr auto kOccupied = static_cast<std::size_t>(CellState::kOccupied),
                 kFree = static_cast<std::size_t>(CellState::kFree);
  ASSERT_EQ(sut_->integrate({frames, kBrickLevel, kInfinity, here}, unlimited_, result_), Status::kOk);
  const std::uint64_t known = sut_->known_cells();
  EXPECT_GT(cells(kBrickLevel)[kOccupied], 6000) << "the floor, in the upper or the lower of 2 x 8281 cells";
  EXPECT_EQ(cells(kBrickLevel)[kFree], 0);
  EXPECT_EQ(cells(0)[kOccupied], 0) << "where in the brick is not known";
  (void)sut_->integrate({frames, kBrickLevel, kInfinity, here}, unlimited_, result_);
  EXPECT_EQ(sut_->known_cells(), known) << "the same look again changes nothing";
  (void)sut_->integrate({frames, 0, kInfinity, here}, unlimited_, result_);
  EXPECT_GT(cells(0)[kOccupied], 1000);
}

/// Of a map with finer cells a block is as large as a cell of two levels below it is here.
class FineBrickMap : public BrickMapTest {
 protected:
  /// Free volume, and occupied cells of 0.1 m around the pillar, after a look at cells of 1.6 m.
  std::pair<double, int> look_at_coarse_cells(double finest_m, double volume_m3) {
    std::vector<std::byte> block(200U << 20U);
    core::Arena arena(block);
    config_.lattice.finest_m = finest_m;
    config_.max_bricks = 9000;
    BrickMap map(config_, arena);
    const std::array<Vector3, 2> ahead{at_, at_ + Vector3(4, 0, 0)};
    (void)map.integrate({scene_.look(at_), config_.lattice.coarsest_level_within(1.6), volume_m3, ahead},
                        unlimited_, result_);
    core::Work work;
    (void)map.export_view({0, kInfinity, at_}, unlimited_, work);
    std::uint64_t lookups = 0;
    int occupied = 0;
    for (double x = 5.95; x < 6.2; x += 0.1)
      for (double y = -1.95; y < 2; y += 0.1)
        for (double z = 4.05; z < 6; z += 0.1)
          occupied += map.view().at(Vector3(x, y, z), lookups) == CellState::kOccupied ? 1 : 0;
    return {result_.work.volume_m3, occupied};
  }
};

TEST_F(FineBrickMap, ALookAtWholeBlocksFindsWhatOneAtCellsOfThatSizeFinds) {
  for (const double volume_m3 : {2000.0, kInfinity}) {
    const auto [cells_m3, in_cells] = look_at_coarse_cells(0.2, volume_m3);
    const auto [blocks_m3, in_blocks] = look_at_coarse_cells(0.1, volume_m3);
    EXPECT_GT(cells_m3, 1000.0);
    EXPECT_GT(blocks_m3, 0.99 * cells_m3) << "near blocks do not hide far ones";
    EXPECT_GT(in_cells, 50);
    EXPECT_GT(in_blocks, 50) << "surfaces are written, too";
  }
}

TEST_F(BrickMapTest, ABlockHasItsRevisionUntilItsCellsChange) {
  const std::array<Vector3, 1> here{at_};
  const MapView& view = sut_->view();
  const auto corner_W = [this](double x, double y, double z) {
    const double edge_m = block_m(config_.lattice.finest_m);
    return Vector3(edge_m * std::floor(x / edge_m), edge_m * std::floor(y / edge_m),
                   edge_m * std::floor(z / edge_m));
  };
  const Vector3 pillar_W = corner_W(7, 0, 5), behind_W = corner_W(25, 0, 5),
                open_W = corner_W(at_.x(), at_.y(), at_.z());
  EXPECT_EQ(view.revision(pillar_W), view.revision(behind_W)) << "all unknown";
  const std::uint64_t unknown = view.revision(behind_W);
  for (int i = 0; i < 12; ++i)
    (void)sut_->integrate({scene_.look(at_), 0, kInfinity, here}, unlimited_, result_);
  const std::uint64_t seen = view.revision(pillar_W);
  EXPECT_NE(seen, unknown);
  EXPECT_NE(seen, view.revision(open_W));
  EXPECT_EQ(view.revision(behind_W), unknown);
  (void)sut_->integrate({scene_.look(at_), 0, kInfinity, here}, unlimited_, result_);
  EXPECT_EQ(view.revision(pillar_W), seen) << "the same once more";
  scene_.solid.push_back({Vector3(5, -2, 4), Vector3(6, 2, 6)});
  (void)sut_->integrate({scene_.look(at_), 0, kInfinity, here}, unlimited_, result_);
  EXPECT_NE(view.revision(pillar_W), seen);
}

/// What a pillar of the scene leaves in the map over many scans.
class Ageing : public BrickMapTest {
 protected:
  void see(test::Scene& scene, int level = 0) {
    const std::array<Vector3, 1> here{at_};
    ASSERT_EQ(sut_->integrate({scene.look(at_), level, kInfinity, here}, unlimited_, result_), Status::kOk);
  }
  int occupied(const Aabb& box) {
    core::Work work;
    (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
    std::uint64_t lookups = 0;
    int count = 0;
    for (double x = box.min_W.x(); x <= box.max_W.x(); x += 0.3)
      for (double y = box.min_W.y(); y <= box.max_W.y(); y += 0.3)
        for (double z = box.min_W.z(); z <= box.max_W.z(); z += 0.3)
          count += sut_->view().at(Vector3(x, y, z), lookups) == CellState::kOccupied ? 1 : 0;
    return count;
  }
  const Aabb front_{Vector3(5.85, -1.95, 1.05), Vector3(6.15, 1.95, 8.0)};
};

TEST_F(Ageing, AnObstacleThatMovedAwayIsClearAfterTenScansAtMost) {
  test::Scene gone = scene_;
  gone.solid.erase(gone.solid.begin() + 1);
  for (const int seen : {1, 3, 100}) {
    for (int i = 0; i < seen; ++i) see(scene_);
    ASSERT_GT(occupied(front_), 100);
    int scans = 0;
    while (occupied(front_) > 0 && scans < 20) {
      see(gone);
      ++scans;
    }
    EXPECT_LE(scans, 10) << "seen " << seen << " times";
    EXPECT_GE(scans, 3) << "one bad image is not enough";
  }
}

TEST_F(Ageing, OneThatStaysNeverClears) {
  see(scene_);
  const int first = occupied(front_);
  ASSERT_GT(first, 100);
  for (int i = 0; i < 100; ++i) see(scene_, i % kPrecisionLevels);
  EXPECT_EQ(occupied(front_), first);
}

TEST_F(Ageing, AThinOneSeenEveryThirdTimeDoesNotVanish) {
  test::Scene missed = scene_;  // a wire that falls between two pixels
  scene_.solid.push_back({Vector3(3.0, 1.02, 0), Vector3(3.05, 1.07, 12)});
  const Aabb wire{Vector3(3.0, 1.05, 3.05), Vector3(3.0, 1.05, 6.0)};
  see(scene_);
  ASSERT_GT(occupied(wire), 3);
  int least = 1000;
  for (int i = 0; i < 30; ++i) {
    see(i % 3 == 2 ? scene_ : missed);
    if (i > 2) least = std::min(least, occupied(wire));
  }
  EXPECT_GT(least, 3);
}

class SmallBrickMap : public BrickMapTest {
 protected:
  SmallBrickMap() : BrickMapTest(64) {}
};

TEST_F(SmallBrickMap, GivesUpTheFarthestBricksWhenFull) {
  for (double x = -20; x <= 20; x += 5) {
    const Vector3 p(x, 10, 5);
    const std::array<Vector3, 1> here{p};
    (void)sut_->integrate({scene_.look(p), 0, kInfinity, here}, unlimited_, result_);
  }
  EXPECT_GT(sut_->counters().bricks_given_up, 0U);
  EXPECT_LE(sut_->used_bytes(), 64 * sizeof(Brick) + 2048 * sizeof(std::int32_t));
  core::Work work;
  (void)sut_->export_view({0, kInfinity, Vector3(20, 10, 5)}, unlimited_, work);
  std::uint64_t lookups = 0;
  EXPECT_TRUE(sut_->view().is_free(Aabb::around(Vector3(20, 10, 5), 0.2), lookups)) << "what is near stays";
}

TEST_F(SmallBrickMap, TakesNoNewSpaceWhenAllItHasIsNear) {
  const std::array<Vector3, 1> here{at_};
  (void)sut_->integrate({scene_.look(at_), 0, kInfinity, here}, unlimited_, result_);
  EXPECT_GT(sut_->counters().bricks_refused, 0U);
  EXPECT_EQ(sut_->counters().bricks_given_up, 0U) << "nothing that this scan needs";
  core::Work work;
  (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  std::uint64_t lookups = 0;
  EXPECT_TRUE(sut_->view().is_free(Aabb::around(at_, 0.5), lookups));
  EXPECT_EQ(sut_->view().at(Vector3(7, 0, 5), lookups), CellState::kUnknown) << "inside the pillar";
  for (double x = 0.15; x < 20; x += 0.3) {
    for (double z = 0.15; z < 10; z += 0.3) {
      const Vector3 p(x, 0.2, z);
      if (scene_.occupied(p - Vector3(0.3, 0, 0)) && scene_.occupied(p + Vector3(0.3, 0, 0))) {
        EXPECT_NE(sut_->view().at(p, lookups), CellState::kFree) << p.transpose();
      }
    }
  }
}

TEST_F(BrickMapTest, WorksWithoutTheHeap) {
  const auto frames = scene_.look(at_);
  const std::array<Vector3, 1> here{at_};
  core::Work work;
  const test::NoAllocScope scope;
  (void)sut_->integrate({frames, 0, kInfinity, here}, unlimited_, result_);
  (void)sut_->export_view({1, 20e3, at_}, unlimited_, work);
  std::uint64_t lookups = 0;
  (void)sut_->view().is_free(Aabb::around(at_, 0.9), lookups);
  EXPECT_EQ(scope.count(), 0U);
}

TEST_F(BrickMapTest, StopsWhenTheBudgetIsSpent) {
  class Short final : public core::StageBudget {
   public:
    [[nodiscard]] bool spent(const core::Work& done) noexcept override { return done.units > 2000; }
  } budget;
  const std::array<Vector3, 1> here{at_};
  EXPECT_EQ(sut_->integrate({scene_.look(at_), 0, kInfinity, here}, budget, result_), Status::kBudgetSpent);
  EXPECT_LT(result_.work.units, 2000U + 1024U + 6U * 64U * 64U);
}

TEST_F(BrickMapTest, AViewIsUnknownBeyondItsVolume) {
  const std::array<Vector3, 1> here{at_};
  (void)sut_->integrate({scene_.look(at_), 0, kInfinity, here}, unlimited_, result_);
  core::Work work;
  EXPECT_EQ(sut_->export_view({0, 1000.0, at_}, unlimited_, work), Status::kBudgetSpent);
  EXPECT_LE(work.volume_m3, 1500.0);
  std::uint64_t lookups = 0;
  EXPECT_EQ(sut_->view().at(at_, lookups), CellState::kFree);
  EXPECT_EQ(sut_->view().at(Vector3(-15, -10, 5), lookups), CellState::kUnknown);
}

TEST_F(BrickMapTest, FreeDistanceEndsAtThePillar) {
  const std::array<Vector3, 1> here{at_};
  (void)sut_->integrate({scene_.look(at_), 0, kInfinity, here}, unlimited_, result_);
  core::Work work;
  (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  std::uint64_t lookups = 0;
  const double free_m = free_distance_m(sut_->view(), at_, Vector3(1, 0, 0), 0.6, 20.0, lookups);
  EXPECT_LT(free_m, 6.0 - 0.1 - 0.6 + 0.01);
  EXPECT_GT(free_m, 6.0 - 0.1 - 0.6 - 0.9);
  EXPECT_EQ(free_distance_m(sut_->view(), at_, Vector3(0, 0, 0), 0.6, 20.0, lookups), 0.0);
  EXPECT_EQ(free_distance_m(sut_->view(), at_, Vector3(std::nan(""), 0, 0), 0.6, 20.0, lookups), 0.0);
  EXPECT_FALSE(is_segment_free(sut_->view(), at_, Vector3(10, 0, 5), 0.6, lookups));
  EXPECT_TRUE(is_segment_free(sut_->view(), at_, Vector3(4, 0, 5), 0.6, lookups));
}

TEST_F(BrickMapTest, WhatIsFreeAtTheFinestStaysFreeUnderACoarserAndSmallerView) {
  const std::array<Vector3, 1> here{at_};
  ASSERT_EQ(sut_->integrate({scene_.look(at_), 0, kInfinity, here}, unlimited_, result_), Status::kOk);
  core::Work work;
  const auto boxes_free = [this](const MapView& view) {
    std::vector<bool> free;
    core::CounterRng rng(3);
    std::uint64_t lookups = 0;
    for (int n = 0; n < 2000; ++n) {
      const Vector3 c(rng.uniform(-14, 14), rng.uniform(-14, 14), rng.uniform(1, 9));
      free.push_back(view.is_free(Aabb::around(c, 0.6), lookups));
    }
    return free;
  };
  (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  const std::vector<bool> fine = boxes_free(sut_->view());
  (void)sut_->export_view({3, 500.0, at_}, unlimited_, work);
  const std::vector<bool> coarse = boxes_free(sut_->view());
  EXPECT_EQ(boxes_free(FinestView(sut_->view())), fine);
  int lost = 0;
  for (std::size_t i = 0; i < fine.size(); ++i) {
    ASSERT_TRUE(fine[i] || !coarse[i]) << "never the other way round";
    lost += fine[i] && !coarse[i] ? 1 : 0;
  }
  EXPECT_GT(lost, 100) << "otherwise nothing was tested";
}

TEST_F(BrickMapTest, PointCloudAveragesAndProfilesGaps) {
  std::vector<std::byte> block(32U << 20U);
  core::Arena arena(block);
  PointCloud cloud({}, arena);
  ASSERT_FALSE(arena.exhausted());
  core::Work work;
  const auto frames = scene_.look(at_);
  ASSERT_EQ(cloud.step(frames, 0, unlimited_, work), Status::kOk);
  const std::size_t fine = cloud.points().size();
  for (const CloudPoint& p : cloud.points()) {
    double nearest = 1e9;
    for (const Aabb& b : scene_.solid)
      nearest = std::min(nearest, (p.p_W - p.p_W.cwiseMax(b.min_W).cwiseMin(b.max_W)).norm());
    ASSERT_LT(nearest, 0.3);
  }
  // The sphere of sight of 20 m, cut at the floor: between a half ball of 5 m and the box of 40 x 40 x 25 m.
  EXPECT_GT(cloud.seen_volume_m3(), 5000.0);
  EXPECT_LT(cloud.seen_volume_m3(), 40e3);
  (void)cloud.step(frames, 3, unlimited_, work);
  EXPECT_LT(cloud.points().size(), fine / 4);
  const std::vector<PosedDepthFrame> none;
  EXPECT_EQ(cloud.step(none, 0, unlimited_, work), Status::kInvalidArgument);

  (void)cloud.step(frames, 0, unlimited_, work);
  const std::array<Vector3, 1> here{at_};
  (void)sut_->integrate({frames, 0, kInfinity, here}, unlimited_, result_);
  (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  SpaceProfile profile;
  ASSERT_EQ(profile_space({}, cloud.points(), sut_->view(), Trajectory::hold(at_, {}), {}, at_,
                          Vector3::Zero(), Vector3(20, 0, 5), {Vector3(-30, -30, 1), Vector3(30, 30, 12)},
                          0.6, profile, unlimited_, work),
            Status::kOk);
  EXPECT_NEAR(profile.closest_obstacle_m, 5.9, 0.2) << "the front of the nearer pillar";
  // The gap between the corners (6, 2) and (-7, 4): 13.2 m; the other way round is wider than 20 m or between
  // the same.
  EXPECT_GT(profile.gap_average_m, 10.0);
  EXPECT_LT(profile.gap_average_m, 20.0);
  EXPECT_LT(profile.closest_unknown_m, 6.0);
  EXPECT_EQ(profile.outlook_count, 1U);
}

TEST(DepthPyramid, BoundsEveryRectangle) {
  core::CounterRng rng(3);
  std::vector<float> depth(96 * 80);
  for (float& d : depth) d = static_cast<float>(rng.uniform(0.5, 30.0));
  for (int i = 0; i < 50; ++i)
    depth[static_cast<std::size_t>(rng.below(depth.size()))] = std::numeric_limits<float>::quiet_NaN();
  firmware_if::DepthFrame frame;
  frame.width = 96;
  frame.height = 80;
  frame.tan_half_width = frame.tan_half_height = 1.0F;
  frame.range_m = 25.0F;
  frame.depth_m = depth;
  std::vector<std::byte> block(1U << 20U);
  core::Arena arena(block);
  DepthPyramid sut(arena, 96, 80);
  for (int n = 0; n < 4000; ++n) {
    if (n % 1000 == 0) {
      ASSERT_EQ(sut.build(frame, n / 1000), Status::kOk);
    }
    const int u0 = static_cast<int>(rng.below(96)), v0 = static_cast<int>(rng.below(80));
    const int u1 = std::min(95, u0 + static_cast<int>(rng.below(40))),
              v1 = std::min(79, v0 + static_cast<int>(rng.below(40)));
    const DepthPyramid::Bound bound = sut.bound(u0, v0, u1, v1);
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) {
        const float d = depth[static_cast<std::size_t>(v * 96 + u)];
        if (!(d > 0.0F)) continue;
        ASSERT_LE(bound.least_m, std::min(d, 25.0F));
        ASSERT_GE(bound.most_m, std::min(d, 25.0F));
      }
    }
  }
  frame.width = 97;
  EXPECT_EQ(sut.build(frame), Status::kCapacity);
}

}  // namespace
}  // namespace roborun::stages
