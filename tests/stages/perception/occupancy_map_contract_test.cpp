#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "stages/perception/brick_map.hpp"
#include "stages/perception/octomap_backend/octomap_backend.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;

/// The same promises for both backends.
class OccupancyMapContract : public ::testing::TestWithParam<const char*> {
 protected:
  OccupancyMapContract() : block_(64U << 20U), arena_(block_) {
    const Aabb bounds{Vector3(-30, -30, -3), Vector3(30, 30, 12)};
    if (std::string(GetParam()) == "own") {
      BrickMap::Config config;
      config.bounds_W = bounds;
      config.max_bricks = 2000;
      config.max_image_width = config.max_image_height = 64;
      sut_ = std::make_unique<BrickMap>(config, arena_);
    } else {
      sut_ = make_octomap_backend({.bounds_W = bounds});
    }
    scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)}, {Vector3(8, -2, 0), Vector3(12, 2, 12)}};
  }
  Status see(const std::vector<PosedDepthFrame>& frames, int level = 0, double volume_m3 = kInfinity) {
    const std::array<Vector3, 1> here{at_};
    const Status status = sut_->integrate({frames, level, volume_m3, here}, unlimited_, result_);
    core::Work work;
    (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
    return status;
  }
  CellState at(const Vector3& p) { return sut_->view().at(p, lookups_); }

  std::vector<std::byte> block_;
  core::Arena arena_;
  std::unique_ptr<OccupancyMap> sut_;
  test::Scene scene_;
  Vector3 at_{0, 0, 5};
  core::UnlimitedBudget unlimited_;
  IntegrationResult result_;
  std::uint64_t lookups_{0};
};

TEST_P(OccupancyMapContract, IsUnknownBeforeAnythingWasSeen) {
  core::Work work;
  (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  EXPECT_EQ(at(at_), CellState::kUnknown);
  EXPECT_FALSE(sut_->view().is_free(Aabb::around(at_, 0.1), lookups_));
}

TEST_P(OccupancyMapContract, SeesFreeSpaceAndSurfaces) {
  ASSERT_EQ(see(scene_.look(at_)), Status::kOk);
  EXPECT_EQ(at(Vector3(4, 0, 5)), CellState::kFree);
  EXPECT_EQ(at(Vector3(-10, 3, 5)), CellState::kFree);
  bool surface = false;
  for (const double x : {7.85, 8.15}) surface = surface || at(Vector3(x, 0.1, 5.1)) == CellState::kOccupied;
  EXPECT_TRUE(surface) << "the front of the pillar";
  EXPECT_EQ(at(Vector3(15, 0, 5)), CellState::kUnknown) << "behind the pillar";
  EXPECT_EQ(at(Vector3(0, 0, 40)), CellState::kUnknown) << "out of bounds";
}

TEST_P(OccupancyMapContract, NeverCallsSolidSpaceFree) {
  const auto frames = scene_.look(at_);
  for (const int level : {0, 1, 2}) ASSERT_EQ(see(frames, level), Status::kOk);
  int checked = 0;
  int wrong = 0;
  for (double x = -15; x <= 15; x += 0.3) {
    for (double y = -15; y <= 15; y += 0.3) {
      for (double z = -0.9; z <= 9; z += 0.3) {
        const Vector3 p(x, y, z);
        // Half a cell and more inside the solid, where a cell has nothing to do with free space.
        if (!scene_.occupied(p + Vector3(0, 0, 0.35)) || !scene_.occupied(p - Vector3(0.35, 0.35, 0)) ||
            !scene_.occupied(p + Vector3(0.35, 0.35, 0)))
          continue;
        ++checked;
        wrong += at(p) == CellState::kFree ? 1 : 0;
      }
    }
  }
  EXPECT_GT(checked, 5000);
  // Stock ray insertion frees a few cells at grazing angles; the own map none.
  EXPECT_LE(wrong, std::string(GetParam()) == "own" ? 0 : checked / 50);
}

TEST_P(OccupancyMapContract, RefusesBadFramesWhole) {
  auto frames = scene_.look(at_);
  const std::vector<float> black(64 * 64, 0.0F);
  const std::vector<float> holes(64 * 64, std::numeric_limits<float>::quiet_NaN());
  for (auto& f : frames) f.frame.depth_m = black;
  EXPECT_EQ(see(frames), Status::kInvalidArgument);
  for (auto& f : frames) f.frame.depth_m = holes;
  EXPECT_EQ(see(frames), Status::kInvalidArgument);
  frames = scene_.look(at_);
  for (auto& f : frames) f.frame.width = 63;  // does not fit the pixels
  EXPECT_EQ(see(frames), Status::kInvalidArgument);
  frames = scene_.look(at_);
  for (auto& f : frames) f.X_WC.p_RT.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(see(frames), Status::kInvalidArgument);
  EXPECT_EQ(result_.frames_refused, 6U);
  EXPECT_EQ(at(Vector3(4, 0, 5)), CellState::kUnknown) << "nothing of it was used";
}

TEST_P(OccupancyMapContract, ClearsWhatMovedAwayWithinTenScansAndKeepsWhatStays) {
  const auto with = scene_.look(at_);
  for (int i = 0; i < 12; ++i) (void)see(with);
  const Vector3 front(8.15, 0.1, 5.1);
  const bool seen = at(front) == CellState::kOccupied || at(Vector3(7.85, 0.1, 5.1)) == CellState::kOccupied;
  ASSERT_TRUE(seen) << "twelve scans of it standing there";
  test::Scene empty;
  empty.solid = {scene_.solid[0]};
  const auto without = empty.look(at_);
  for (int i = 0; i < 10; ++i) (void)see(without);
  EXPECT_EQ(at(front), CellState::kFree);
}

TEST_P(OccupancyMapContract, TheSameCallsGiveTheSameMap) {
  (void)see(scene_.look(at_));
  const std::uint64_t first = sut_->digest();
  EXPECT_NE(first, 0U);
  (void)see(scene_.look(at_));
  EXPECT_NE(sut_->digest(), first) << "evidence grew";
}

TEST_P(OccupancyMapContract, SpendsTheVolumeNearestFirst) {
  EXPECT_EQ(see(scene_.look(at_), 0, 3000.0), Status::kBudgetSpent);
  EXPECT_EQ(at(Vector3(0, 0, 3)), CellState::kFree);
  EXPECT_EQ(at(Vector3(-18, 0, 5)), CellState::kUnknown);
}

TEST_P(OccupancyMapContract, AViewEndsWhereItsVolumeIsSpent) {
  const Vector3 far(-10, 3, 5);
  ASSERT_EQ(see(scene_.look(at_)), Status::kOk);
  ASSERT_EQ(at(far), CellState::kFree);
  core::Work work;
  (void)sut_->export_view({0, 1000.0, at_}, unlimited_, work);
  EXPECT_LE(work.volume_m3, 1000.0);
  EXPECT_EQ(at(Vector3(0, 0, 3)), CellState::kFree);
  EXPECT_EQ(at(far), CellState::kUnknown);
}

TEST_P(OccupancyMapContract, ACoarserViewIsNeverFreer) {
  ASSERT_EQ(see(scene_.look(at_)), Status::kOk);
  std::vector<Vector3> points;
  for (double x = -9; x <= 9.5; x += 1.3)
    for (double y = -9; y <= 9; y += 1.3) points.emplace_back(x, y, 4.7);
  std::vector<CellState> finest;
  for (const Vector3& p : points) finest.push_back(at(p));
  ASSERT_GT(std::count(finest.begin(), finest.end(), CellState::kFree), 20);
  ASSERT_GT(std::count(finest.begin(), finest.end(), CellState::kOccupied), 0);
  for (int level = 1; level < kPrecisionLevels; ++level) {
    core::Work work;
    ASSERT_EQ(sut_->export_view({level, kInfinity, at_}, unlimited_, work), Status::kOk);
    EXPECT_EQ(sut_->view().cell_m(), PrecisionLattice{}.cell_size_m(level));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const CellState coarse = at(points[i]);
      if (finest[i] == CellState::kOccupied) {
        EXPECT_EQ(coarse, CellState::kOccupied) << level << ": " << points[i].transpose();
      } else if (coarse == CellState::kFree) {
        EXPECT_EQ(finest[i], CellState::kFree) << level << ": " << points[i].transpose();
      }
      const Aabb box = Aabb::around(points[i], 0.4);
      if (sut_->view().is_free(box, lookups_)) {
        EXPECT_TRUE(sut_->view().is_free_at_finest(box, lookups_)) << level << ": " << points[i].transpose();
      }
    }
  }
}

TEST_P(OccupancyMapContract, EndsWhenTheBudgetIsSpentAndKeepsWhatItHas) {
  class Spent final : public core::StageBudget {
   public:
    [[nodiscard]] bool spent(const core::Work& done) noexcept override { return done.units > 0; }
  } budget;
  const auto frames = scene_.look(at_);
  const std::array<Vector3, 1> here{at_};
  EXPECT_EQ(sut_->integrate({frames, 0, kInfinity, here}, budget, result_), Status::kBudgetSpent);
  const std::uint64_t units = result_.work.units;
  EXPECT_EQ(sut_->integrate({frames, 0, kInfinity, here}, unlimited_, result_), Status::kOk);
  EXPECT_LT(units, result_.work.units);
}

TEST_P(OccupancyMapContract, AnswersAsANewOneAfterForgetting) {
  const std::uint64_t empty = sut_->digest();
  ASSERT_EQ(see(scene_.look(at_)), Status::kOk);
  const std::uint64_t first = sut_->digest();
  ASSERT_EQ(at(Vector3(4, 0, 5)), CellState::kFree);
  sut_->forget();
  EXPECT_EQ(sut_->digest(), empty);
  EXPECT_EQ(sut_->known_volume_m3(), 0.0);
  EXPECT_EQ(at(Vector3(4, 0, 5)), CellState::kUnknown) << "without an export";
  ASSERT_EQ(see(scene_.look(at_)), Status::kOk);
  EXPECT_EQ(sut_->digest(), first);
  EXPECT_EQ(at(Vector3(4, 0, 5)), CellState::kFree);
}

TEST_P(OccupancyMapContract, SaysHowMuchMemoryItTakes) {
  const std::size_t empty = sut_->bytes();
  ASSERT_EQ(see(scene_.look(at_)), Status::kOk);
  EXPECT_GT(sut_->bytes(), 0U);
  EXPECT_GE(sut_->bytes(), empty);
  EXPECT_EQ(sut_->refusals(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Backends, OccupancyMapContract, ::testing::Values("own", "octomap"),
                         [](const auto& instance) { return std::string(instance.param); });

}  // namespace
}  // namespace roborun::stages
