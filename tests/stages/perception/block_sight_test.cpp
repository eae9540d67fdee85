// The vector kernels of the map: the same bits on every instruction set, and bounds that are bounds.
#include "stages/perception/block_sight.hpp"

#include <gtest/gtest.h>

#include <bitset>
#include <memory>
#include <optional>

#include "core/random/counter_rng.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/perception/instruction_sets.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;

Matrix3 tilted() {
  return (Eigen::AngleAxisd(0.3, Vector3::UnitZ()) * Eigen::AngleAxisd(0.1, Vector3::UnitY()) *
          Eigen::AngleAxisd(-0.07, Vector3::UnitX()))
      .toRotationMatrix();
}

/// Restores the choice of the machine.
struct InstructionSet {
  explicit InstructionSet(std::int64_t set) { use_kernel_instruction_sets(set); }
  ~InstructionSet() { use_kernel_instruction_sets(~std::int64_t{0}); }
  InstructionSet(const InstructionSet&) = delete;
  InstructionSet& operator=(const InstructionSet&) = delete;
};

class BlockSight : public ::testing::Test {
 protected:
  BlockSight() {
    scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)}, {Vector3(5, -2, 0), Vector3(7, 1, 12)}};
    frames_ = scene_.look(Vector3(0.1, 0.2, 5.0), 45);  // no multiple of any vector
    for (PosedDepthFrame& f : frames_) f.X_WC.R_RT = tilted() * f.X_WC.R_RT;
    scene_.image[2][700] = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 100; i < 130; ++i) scene_.image[1][i] = -1.0F;
  }
  test::Scene scene_;
  std::vector<PosedDepthFrame> frames_;
};

TEST_F(BlockSight, IsBitEqualOnEveryInstructionSet) {
  const std::array<Vector3, 1> here{Vector3(0.1, 0.2, 5.0)};
  frames_[1].frame.tan_half_height = 0.6F;
  frames_[3].frame.tan_half_width = 1.3F;
  frames_[2].frame.range_min_m = 3.0F;
  std::vector<std::uint64_t> digests;
  int sets = 0;
  const std::int64_t all = kernel_instruction_sets();
  for (unsigned bit = 0; bit < 63; ++bit) {
    const std::int64_t set = all & (std::int64_t{1} << bit);
    if (set == 0) continue;
    const InstructionSet only(set);
    ++sets;
    for (int level = 0; level < kPrecisionLevels; ++level) {
      BrickMap::Config config;
      config.bounds_W = {Vector3(-30, -30, -3), Vector3(30, 30, 12)};
      config.max_bricks = 2000;
      config.max_image_width = config.max_image_height = 64;
      std::vector<std::byte> block(BrickMap::arena_bytes(config));
      core::Arena arena(block);
      BrickMap map(config, arena);
      ASSERT_FALSE(arena.exhausted());
      core::UnlimitedBudget unlimited;
      IntegrationResult result;
      ASSERT_EQ(map.integrate({frames_, level, kInfinity, here}, unlimited, result), Status::kOk);
      ASSERT_EQ(map.integrate({frames_, level, kInfinity, here}, unlimited, result), Status::kOk);
      EXPECT_GT(map.known_cells(), level < 3 ? 10000U : 0U);
      digests.push_back(map.digest());
    }
  }
  ASSERT_GT(sets, 1);
  for (std::size_t i = kPrecisionLevels; i < digests.size(); ++i)
    EXPECT_EQ(digests[i], digests[i % kPrecisionLevels]) << i;
  EXPECT_NE(digests[0], digests[1]);
}

TEST_F(BlockSight, ATileKnowsTheLeastAndTheMostOfItsDepths) {
  constexpr float kRange_m = 20.0F;
  const float steps_per_m = static_cast<float>(DepthPyramid::kMaxSteps - 1) / kRange_m;
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  const std::array<float, 9> odd{nan, -nan, 0.0F, -0.0F, -1.0F, infinity, -infinity, 700.0F, kRange_m};
  core::CounterRng rng(3);
  const std::int64_t all = kernel_instruction_sets();
  for (int n = 0; n < 4000; ++n) {
    const std::int64_t set = all & (std::int64_t{1} << rng.below(63));
    if (set == 0) continue;
    const InstructionSet only(set);
    const std::size_t width = 8 + rng.below(n % 8 == 0 ? kMaxImageSide - 7 : 60),
                      rows = 1 + rng.below(kMaxTile);
    const auto shift = static_cast<int>(rng.below(4));
    std::vector<float> depth_m(width * rows);
    const std::uint64_t odd_in = n % 3 == 0 ? 4 : 100;
    for (float& d : depth_m)
      d = rng.below(odd_in) == 0 ? odd[rng.below(odd.size())] : static_cast<float>(rng.uniform(0.1, 21.0));
    const std::size_t side = std::size_t{1} << static_cast<unsigned>(shift),
                      tiles = (width + side - 1) / side;
    std::vector<DepthPyramid::Entry> entry(tiles);
    const StripSeen seen =
        tile_steps({depth_m.data(), width, rows, kRange_m, 0.0F, steps_per_m}, shift, entry.data());
    std::array<std::uint64_t, StripSeen::kWords> incomplete{};
    bool surface = false;
    for (std::size_t x = 0; x < tiles; ++x) {
      std::int32_t least = DepthPyramid::kMaxSteps, not_most = DepthPyramid::kMaxSteps;
      for (std::size_t v = 0; v < rows; ++v)
        for (std::size_t u = x * side; u < std::min((x + 1) * side, width); ++u) {
          const float d = depth_m[v * width + u];
          if (!(d > 0.0F)) {
            incomplete[u / 512] |= std::uint64_t{1} << (u / 8 % 64);
            continue;
          }
          const auto steps = static_cast<std::int32_t>(d < kRange_m ? d * steps_per_m : 0.0F);
          surface = surface || d < kRange_m;
          least = std::min(least, d < kRange_m ? steps : DepthPyramid::kMaxSteps);
          not_most = std::min(not_most, d < kRange_m ? DepthPyramid::kMaxSteps - steps - 1 : 0);
        }
      ASSERT_EQ(entry[x].least_steps, least) << width << " x " << rows << " by " << side << ", tile " << x;
      ASSERT_EQ(entry[x].not_most_steps, not_most)
          << width << " x " << rows << " by " << side << ", tile " << x;
    }
    ASSERT_EQ(seen.incomplete, incomplete);
    ASSERT_EQ(seen.surface, surface);
  }
}

TEST_F(BlockSight, ABlockIsFreeOnlyIfEveryRayThroughItSeesPastIt) {
  std::vector<std::byte> block(DepthPyramid::arena_bytes(45, 45));
  core::Arena arena(block);
  DepthPyramid image(arena, 45, 45);
  ASSERT_EQ(image.build(frames_[0].frame), Status::kOk);
  SightCameras cameras;
  cameras.camera[0].prepare(frames_[0], image);
  cameras.count = 1;
  cameras.complete = false;
  core::CounterRng rng(5);
  int free_blocks = 0;
  int rays = 0;
  for (int n = 0; n < 1600; ++n) {
    const int level = 1 + static_cast<int>(rng.below(4));
    std::array<Vector3, 21> center_W;  // no multiple of any vector
    for (Vector3& c : center_W)
      c = frames_[0].X_WC * Vector3(rng.uniform(0, 18), rng.uniform(-9, 9), rng.uniform(-9, 9));
    const BlocksSeen seen = see_blocks(cameras, level, center_W);
    for (unsigned i = 0; i < center_W.size(); ++i) {
      if (((seen.free >> i) & 1U) == 0) continue;
      ++free_blocks;
      for (int k = 0; k < 20; ++k) {
        const double half = 0.5 * PrecisionLattice{}.cell_size_m(level);
        const Vector3 p_W =
            center_W[i] + half * Vector3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
        const Vector3 p_C = frames_[0].X_WC.inverse_times(p_W);
        ASSERT_GT(p_C.x(), 0.0);
        const int u = static_cast<int>((1.0 - p_C.y() / p_C.x()) * 22.5),
                  v = static_cast<int>((1.0 - p_C.z() / p_C.x()) * 22.5);
        ASSERT_TRUE(u >= 0 && u < 45 && v >= 0 && v < 45) << "a block that leaves the image is not free";
        ASSERT_GE(static_cast<double>(frames_[0].frame.depth_m[static_cast<std::size_t>(v * 45 + u)]),
                  p_C.x());
        ++rays;
      }
    }
  }
  EXPECT_GT(free_blocks, 200);
  EXPECT_GT(rays, 4000);
}

/// The free cells of a block by its children, one after the other, each against all edges of each view.
void see_slowly(const SightCameras& cameras, const SightBlock& block, std::uint32_t morton,
                std::bitset<kCellsPerBrick>& free) {
  const EightSeen eight = see_children(cameras, block);
  const double quarter = 0.25 * PrecisionLattice{}.cell_size_m(block.level);
  const std::uint32_t cells = std::uint32_t{1} << (3U * static_cast<unsigned>(block.level - 1));
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint32_t child = 8 * morton + i;
    if (((eight.free >> i) & 1U) != 0) {
      for (std::uint32_t k = 0; k < cells; ++k) free.set(child * cells + k);
    } else if (((eight.mixed >> i) & 1U) != 0 && block.level > 1) {
      const Vector3 offset((i & 1U) != 0 ? quarter : -quarter, (i & 2U) != 0 ? quarter : -quarter,
                           (i & 4U) != 0 ? quarter : -quarter);
      see_slowly(cameras, {block.center_W + offset, block.level - 1, eight.cameras[i]}, child, free);
    }
  }
}

TEST_F(BlockSight, ABrickIsSeenAsItsBlocksOneByOne) {
  std::vector<std::byte> block(6 * DepthPyramid::arena_bytes(45, 45));
  core::Arena arena(block);
  std::array<std::optional<DepthPyramid>, 6> image;
  SightCameras cameras;
  for (cameras.count = 0; cameras.count < 6; ++cameras.count) {
    const PosedDepthFrame& frame = frames_[cameras.count];
    image[cameras.count].emplace(arena, 45, 45);
    ASSERT_EQ(image[cameras.count]->build(frame.frame), Status::kOk);
    cameras.camera[cameras.count].prepare(frame, *image[cameras.count]);
  }
  core::CounterRng rng(6);
  auto seen = std::make_unique<BrickSeen>();
  std::size_t free_cells = 0, different = 0;
  for (int n = 0; n < 400; ++n) {
    cameras.complete = n % 2 == 0;
    const Vector3 center_W(rng.uniform(-15, 15), rng.uniform(-15, 15), rng.uniform(0, 10));
    const SightBlock brick{center_W, kBrickLevel, 0x3F};
    see_brick(cameras, brick, 0, *seen);
    std::bitset<kCellsPerBrick> free, slowly;
    for (std::size_t g = 0; g < seen->count; ++g) {
      const FreeGroup& group = seen->group[g];
      const std::uint32_t cells = std::uint32_t{1} << (3U * unsigned{group.level});
      for (std::uint32_t i = 0; i < 8; ++i)
        for (std::uint32_t k = 0; ((unsigned{group.free} >> i) & 1U) != 0 && k < cells; ++k)
          free.set((8U * group.parent + i) * cells + k);
    }
    EXPECT_EQ(free.count(), seen->free_cells);
    see_slowly(cameras, brick, 0, slowly);
    free_cells += free.count();
    different += (free ^ slowly).count();
  }
  EXPECT_GT(free_cells, 300000U);
  EXPECT_LT(different, free_cells / 10000) << "positions are rounded on the way down in one of them only";
}

/// A wall ends where the image to the left ends: what lies across the border behind it is seen past by the image ahead, and is
/// hidden in the other one.
TEST_F(BlockSight, WhatOneOfTwoImagesHidesIsNotFreeByBothTogether) {
  const Vector3 at_W(0.0, 0.0, 5.0);
  for (const bool wall : {false, true}) {
    scene_.solid.clear();
    if (wall) scene_.solid.push_back({Vector3(-20, 3, -20), Vector3(3, 4, 30)});
    frames_ = scene_.look(at_W, 45);
    std::vector<std::byte> block(6 * DepthPyramid::arena_bytes(45, 45));
    core::Arena arena(block);
    std::array<std::optional<DepthPyramid>, 6> image;
    SightCameras cameras;
    for (std::size_t i = 0; i < 6; ++i) {
      image[i].emplace(arena, 45, 45);
      ASSERT_EQ(image[i]->build(frames_[i].frame), Status::kOk);
      cameras.camera[i].prepare(frames_[i], *image[i]);
    }
    cameras.count = 6;
    cameras.complete = true;
    core::CounterRng rng(9);
    for (int level = 0; level <= kBrickLevel; ++level) {
      const double half_m = 0.5 * PrecisionLattice{}.cell_size_m(level) * (level == 0 ? 0.5 : 1.0);
      std::vector<Vector3> center_W;
      for (int n = 0; n < 40; ++n) {
        const double x_m = rng.uniform(4.5, 9.0) + half_m;
        center_W.push_back(at_W + Vector3(x_m, x_m + rng.uniform(-0.9, 0.9) * half_m, 0.0));
      }
      const BlocksSeen seen = see_blocks(cameras, level, center_W);
      const std::uint64_t all = (std::uint64_t{1} << center_W.size()) - 1;
      EXPECT_EQ(seen.free, wall ? 0 : all) << level;
      EXPECT_EQ(seen.mixed, wall ? all : 0) << level << ": a part of it may be free";
    }
  }
}

TEST_F(BlockSight, TheCellsOfARowAreWhereItsPixelsEnd) {
  const PosedDepthFrame& posed = frames_[4];  // looks up or down: one of them sees the ground
  const PosedDepthFrame& down = posed.X_WC.R_RT(2, 0) < 0.0 ? posed : frames_[5];
  PixelLine line;
  line.low = {-1000, -1000, -1000};
  line.high = {1000, 1000, 1000};
  const double pitch = 2.0 / 45.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const double origin = 300.0 + down.X_WC.p_RT[k] / 0.3;
    line.origin[axis] = static_cast<std::int32_t>(std::floor(origin));
    line.rest[axis] = static_cast<float>(origin - std::floor(origin));
    line.step[axis] = static_cast<float>(-pitch / 0.3 * down.X_WC.R_RT(k, 1));
    const Vector3 first = down.X_WC.R_RT * Vector3(1.0, 1.0 - 0.5 * pitch, 1.0 - 22.5 * pitch) / 0.3;
    line.first[axis] = static_cast<float>(first[k]);
  }
  const auto depths = down.frame.depth_m.subspan(22 * 45, 45);
  auto row = std::make_unique<SurfaceRow>();
  end_cells(line, depths, {0.0F, down.frame.range_m}, *row);
  ASSERT_GT(row->count, 5U);
  std::size_t found = 0;
  for (std::size_t n = 0; n < row->count; ++n) {
    const Vector3 corner_W(0.3 * (row->cell[0][n] - 300), 0.3 * (row->cell[1][n] - 300),
                           0.3 * (row->cell[2][n] - 300));
    for (int u = 0; u < 45; ++u) {
      const double depth_m = static_cast<double>(depths[static_cast<std::size_t>(u)]);
      const Vector3 p_W = down.X_WC * (depth_m * Vector3(1.0, 1.0 - (u + 0.5) * pitch, 1.0 - 22.5 * pitch));
      if (((p_W - corner_W).array() > -1e-3).all() && ((p_W - corner_W).array() < 0.301).all()) {
        ++found;
        break;
      }
    }
  }
  EXPECT_EQ(found, row->count);
}

}  // namespace
}  // namespace roborun::stages
