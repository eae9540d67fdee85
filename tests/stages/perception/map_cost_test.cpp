// What the map does not do because it would tell nothing more.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "stages/perception/brick_map.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;

/// A hall of 60 m with pillars.
class MapCost : public ::testing::Test {
 protected:
  explicit MapCost(double finest_m = 0.2) {
    config_.bounds_W = {Vector3(-30, -30, -3), Vector3(30, 30, 12)};
    config_.lattice.finest_m = finest_m;
    config_.max_bricks = 40000;
    config_.max_image_width = config_.max_image_height = 64;
    block_.resize(BrickMap::arena_bytes(config_));
    arena_ = std::make_unique<core::Arena>(block_);
    sut_ = std::make_unique<BrickMap>(config_, *arena_);
    scene_.solid.push_back({Vector3(-40, -40, -2), Vector3(40, 40, 0)});
    for (int i = 0; i < 12; ++i) {
      const double x = -25.0 + 4.5 * i, y = 5.0 * (i % 3) - 4.0;
      scene_.solid.push_back({Vector3(x, y, -1), Vector3(x + 0.6, y + 0.6, 9)});
    }
  }
  void see(const Vector3& p_W, int level = 0) {
    const std::array<Vector3, 1> here{p_W};
    ASSERT_EQ(sut_->integrate({scene_.look(p_W), level, kInfinity, here}, unlimited_, result_), Status::kOk);
  }
  [[nodiscard]] core::Work exported(double volume_m3, const Vector3& p_W) {
    core::Work work;
    (void)sut_->export_view({0, volume_m3, p_W}, unlimited_, work);
    return work;
  }

  BrickMap::Config config_{};
  std::vector<std::byte> block_;
  std::unique_ptr<core::Arena> arena_;
  std::unique_ptr<BrickMap> sut_;
  test::Scene scene_;
  core::UnlimitedBudget unlimited_;
  IntegrationResult result_;
  Vector3 at_{Vector3(-14.0, 1.7, 4.0)};
};

TEST_F(MapCost, AnExportDoesNotCountWhatIsFarBeyondTheEndOfItsView) {
  see(at_);
  const core::Work before = exported(800.0, at_);
  EXPECT_GT(before.volume_m3, 100.0);
  EXPECT_LE(before.volume_m3, 800.0);
  see(at_ + Vector3(40.0, 0.0, 0.0));
  const core::Work after = exported(800.0, at_);
  EXPECT_EQ(after.volume_m3, before.volume_m3);
  EXPECT_EQ(after.units, before.units);
}

TEST_F(MapCost, AnExportOfEverythingCountsEachBrickOnce) {
  see(at_);
  see(at_ + Vector3(30.0, 0.0, 0.0));
  const core::Work all = exported(kInfinity, at_);
  EXPECT_NEAR(all.volume_m3, sut_->known_volume_m3(), 1e-6 * all.volume_m3);
  // In growing boxes, of which the last one is not the first.
  const core::Work most = exported(0.9 * all.volume_m3, at_);
  EXPECT_GT(most.volume_m3, 0.5 * all.volume_m3);
  EXPECT_LE(most.volume_m3, 0.9 * all.volume_m3);
  EXPECT_LE(most.units, all.units);
}

TEST_F(MapCost, DoubledCellsAreThoseOfEightBlocks) {
  see(at_);
  see(at_ + Vector3(3.0, 1.0, 0.0));
  const MapView& view = sut_->view();
  const double edge_m = block_m(2.0 * view.finest_m());
  std::size_t mixed = 0, unknown = 0;
  for (int x = -5; x < 5; ++x) {
    for (int y = -5; y < 5; ++y) {
      for (int z = -1; z < 2; ++z) {
        const Vector3 corner_W = edge_m * Vector3(x, y, z);
        CellBlock cells, expected;
        std::uint64_t lookups = 0, more_lookups = 0;
        const BlockContent content = view.read_doubled(corner_W, cells, lookups);
        ASSERT_EQ(content, read_eighths(view, corner_W, expected, more_lookups));
        mixed += content == BlockContent::kMixed ? 1U : 0U;
        unknown += content == BlockContent::kUnknown ? 1U : 0U;
        if (content != BlockContent::kMixed) continue;
        ASSERT_EQ(cells.free, expected.free);
        ASSERT_EQ(cells.occupied, expected.occupied);
        EXPECT_LE(lookups, more_lookups);
      }
    }
  }
  EXPECT_GT(mixed, 20U);
  EXPECT_GT(unknown, 20U);
}

class FineMapCost : public MapCost {
 protected:
  FineMapCost() : MapCost(0.1) {}
};

TEST_F(FineMapCost, CellsBelowAPixelAreNotLookedAt) {
  see(at_, 1);
  const std::uint64_t larger = result_.work.units;
  const double larger_m3 = sut_->known_volume_m3();
  sut_->forget();
  see(at_, 0);
  EXPECT_LT(result_.work.units, 2 * larger) << "cells of 0.1 m as far as a pixel is less than 0.2 m wide";
  EXPECT_GT(sut_->known_volume_m3(), larger_m3) << "they still see more";
}

}  // namespace
}  // namespace roborun::stages
