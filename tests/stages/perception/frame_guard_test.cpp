// Each kind of frame that must not be believed, alone, and in the map: refused whole, nothing cleared.
#include "stages/perception/frame_guard.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "stages/perception/brick_map.hpp"
#include "stages/perception/cloud_images.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

using test::kNanF;
constexpr float kNothing = std::numeric_limits<float>::infinity();

MonotonicTime at_s(double time_s) { return MonotonicTime{} + from_seconds(time_s); }

/// Six frames of one instant that own their pixels.
struct Shot {
  explicit Shot(test::Scene& scene, double time_s, const Vector3& p_W = Vector3(0.1, 0.2, 5.0))
      : frames(scene.look(p_W)), image(scene.image) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      frames[i].frame.stamp = at_s(time_s);
      frames[i].frame.depth_m = image[i];
    }
  }
  Shot(const Shot&) = delete;
  Shot& operator=(const Shot&) = delete;
  std::vector<PosedDepthFrame> frames;
  std::vector<std::vector<float>> image;
};

class FrameGuardTest : public ::testing::Test {
 protected:
  FrameGuardTest() {
    scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)}, {Vector3(6, -2, 0), Vector3(8, 2, 12)}};
  }
  int refused(std::span<const PosedDepthFrame> frames) {
    sut_.begin(frames);
    int count = 0;
    for (const PosedDepthFrame& f : frames) count += sut_.check(f) == Status::kOk ? 0 : 1;
    return count;
  }
  test::Scene scene_;
  FrameGuard sut_;
};

TEST_F(FrameGuardTest, TakesAGoodScanAndTheSameScanAgain) {
  const Shot shot(scene_, 1.0);
  EXPECT_EQ(refused(shot.frames), 0);
  EXPECT_EQ(refused(shot.frames), 0);
}

TEST_F(FrameGuardTest, RefusesAFrozenCameraForAsLongAsItIsFrozen) {
  Shot first(scene_, 1.0);
  EXPECT_EQ(refused(first.frames), 0);
  for (int n = 1; n < 100; ++n) {
    Shot next(scene_, 1.0 + 0.1 * n, Vector3(0.1 + 0.01 * n, 0.2, 5.0 + 0.01 * n));
    next.frames[0].frame.depth_m = first.image[0];
    ASSERT_EQ(refused(next.frames), 1) << n;
  }
  const Shot again(scene_, 12.0, Vector3(0.1, 0.25, 5.2));
  EXPECT_EQ(refused(again.frames), 0) << "and no longer";
}

TEST_F(FrameGuardTest, AnOpenSkyMayRepeat) {
  for (int n = 0; n < 5; ++n) {
    Shot shot(scene_, 1.0 + n, Vector3(0.1 + 0.01 * n, 0.2, 5.0 + 0.01 * n));
    shot.image[4].assign(shot.image[4].size(), kNothing);
    EXPECT_EQ(refused(shot.frames), 0) << n;
  }
}

/// A stereo camera has no values on sky: forward, the upper half of an image; upwards, all of it.
TEST_F(FrameGuardTest, SkyWithoutValuesIsOrdinary) {
  Shot shot(scene_, 1.0);
  for (std::size_t i = 0; i < 4; ++i)
    std::fill(shot.image[i].begin(),
              shot.image[i].begin() + static_cast<std::ptrdiff_t>(shot.image[i].size() / 2), kNanF);
  shot.image[4].assign(shot.image[4].size(), kNanF);
  ASSERT_GT(shot.frames[4].X_WC.R_RT(2, 0), 0.9) << "looks up";
  EXPECT_EQ(refused(shot.frames), 0);
  shot.image[5].assign(shot.image[5].size(), kNanF);
  EXPECT_EQ(refused(shot.frames), 1) << "where the ground should be";
}

TEST_F(FrameGuardTest, AStillCameraWithoutNoiseIsNotFrozen) {
  const Shot first(scene_, 1.0);
  for (int n = 0; n < 5; ++n) {
    Shot next(scene_, 1.0 + 0.1 * n);
    EXPECT_EQ(refused(next.frames), n == 0 ? 0 : 5) << "noise never repeats; sky may";
  }
  FrameGuard fresh;
  sut_ = fresh;
  for (int n = 0; n < 5; ++n) {
    Shot next(scene_, 1.0 + 0.1 * n);
    for (PosedDepthFrame& f : next.frames) f.error = {0.0, 0.0};
    EXPECT_EQ(refused(next.frames), 0) << n;
  }
}

/// Rays of a LiDAR that meet nothing end at its range, in every sweep alike, whatever the image's depths say of them.
TEST_F(FrameGuardTest, TheEndOfALidarsRangeMayRepeat) {
  constexpr float kRange_m = 70.0F;
  std::vector<std::byte> memory(CloudImages::arena_bytes({}));
  core::Arena arena(memory);
  CloudImages images({}, arena);
  const auto sweep = [&](double time_s, float first_m) {
    std::vector<std::array<float, 3>> points;
    for (int ring = -45; ring <= 45; ring += 3) {
      for (int turn = 0; turn < 360; turn += 1) {
        const float up = static_cast<float>(ring) * 0.0174533F,
                    around = static_cast<float>(turn) * 0.0174533F;
        const float range_m = turn < 60 ? first_m : 1.01F * kRange_m;
        points.push_back({range_m * std::cos(up) * std::cos(around),
                          range_m * std::cos(up) * std::sin(around), range_m * std::sin(up)});
      }
    }
    EXPECT_EQ(images.make({points, at_s(time_s), kRange_m, {}, Vector3::Zero(), 0.3F}), Status::kOk);
    return refused(images.frames());
  };
  for (int n = 0; n < 5; ++n) EXPECT_EQ(sweep(1.0 + 0.1 * n, 10.0F + 0.01F * static_cast<float>(n)), 0) << n;
  EXPECT_GT(sweep(2.0, 10.04F), 0) << "a surface that repeats is frozen";
}

TEST_F(FrameGuardTest, RefusesFramesOfAnotherTime) {
  Shot shot(scene_, 10.0);
  shot.frames[2].frame.stamp = at_s(9.7);
  shot.frames[5].frame.stamp = at_s(1e9);
  EXPECT_EQ(refused(shot.frames), 2);
  shot.frames[5].frame.stamp = MonotonicTime::max();
  shot.frames[2].frame.stamp = MonotonicTime::min();
  EXPECT_EQ(refused(shot.frames), 2);
}

TEST_F(FrameGuardTest, RefusesAScanOlderThanTheOneBeforeOnce) {
  const Shot now(scene_, 10.0), old(scene_, 5.0, Vector3(0.0, 0.1, 5.1)),
      older(scene_, 5.1, Vector3(0.0, 0.2, 5.2));
  EXPECT_EQ(refused(now.frames), 0);
  EXPECT_EQ(refused(old.frames), 6);
  EXPECT_EQ(refused(older.frames), 0) << "the clock was set";
}

TEST_F(FrameGuardTest, DoesNotAllocate) {
  const Shot shot(scene_, 1.0);
  const test::NoAllocScope scope;
  EXPECT_EQ(refused(shot.frames), 0);
  EXPECT_EQ(scope.count(), 0U);
}

struct Fault {
  const char* name;
  std::function<void(Shot&, std::size_t)> break_frame;
};

class GuardedMap : public ::testing::Test {
 protected:
  GuardedMap() : block_(64U << 20U), arena_(block_) {
    BrickMap::Config config;
    config.bounds_W = {Vector3(-30, -30, -3), Vector3(30, 30, 12)};
    config.max_bricks = 2000;
    config.max_image_width = config.max_image_height = 64;
    sut_ = std::make_unique<BrickMap>(config, arena_);
    scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)}, {Vector3(6, -2, 0), Vector3(8, 2, 12)}};
  }
  Status see(const Shot& shot, std::span<const Vector3> moved_W = {}) {
    const std::array<Vector3, 1> here{Vector3(0.1, 0.2, 5.0)};
    return sut_->integrate({shot.frames, 0, 1e18, here, moved_W}, unlimited_, result_);
  }
  std::vector<std::byte> block_;
  core::Arena arena_;
  std::unique_ptr<BrickMap> sut_;
  test::Scene scene_;
  core::UnlimitedBudget unlimited_;
  IntegrationResult result_;
};

class BadFrame : public GuardedMap, public ::testing::WithParamInterface<Fault> {};

/// The camera that looks at the pillar and the ground goes bad for 20 scans while the world behind it is
/// empty.
TEST_P(BadFrame, IsRefusedWholeAndClearsNothing) {
  ASSERT_EQ(see(Shot(scene_, 1.0)), Status::kOk);
  const auto occupied = [this] {
    core::Work work;
    (void)sut_->export_view({0, 1e18, Vector3(0.1, 0.2, 5.0)}, unlimited_, work);
    std::uint64_t lookups = 0;
    int count = 0;
    for (double y = -1.95; y < 2; y += 0.3)
      for (double z = 0.45; z < 9; z += 0.3)
        for (const double x : {5.85, 6.15})
          count += sut_->view().at(Vector3(x, y, z), lookups) == CellState::kOccupied ? 1 : 0;
    return count;
  };
  const int before = occupied();
  ASSERT_GT(before, 200);
  for (int n = 1; n <= 20; ++n) {
    // The cameras tremble, as they do, and noise is never the same twice.
    Shot shot(scene_, 1.0 + 0.1 * n, Vector3(0.1, 0.2, 5.0 + 0.001 * n));
    GetParam().break_frame(shot, 0);
    ASSERT_EQ(see(shot), Status::kOk) << "the other cameras go on";
    ASSERT_EQ(result_.frames_refused, 1U) << n;
  }
  EXPECT_EQ(occupied(), before);
}

/// All of them: then nothing at all may change.
TEST_P(BadFrame, AScanOfNothingElseChangesNothing) {
  const Shot good(scene_, 1.0);
  ASSERT_EQ(see(good), Status::kOk);
  const std::uint64_t before = sut_->digest();
  Shot shot(scene_, 1.1, Vector3(0.1, 0.2, 5.01));
  shot.frames.erase(shot.frames.begin() + 1, shot.frames.end());
  GetParam().break_frame(shot, 0);
  EXPECT_EQ(see(shot), Status::kInvalidArgument);
  EXPECT_EQ(sut_->digest(), before);
}

/// What a body left in the map is no reason to disbelieve the camera that now sees the open sky.
TEST_F(GuardedMap, BodyOverheadIsClearedByAWhiteImageWhereItWasSeenToMove) {
  scene_.solid = {{Vector3(-0.6, -0.5, 8.0), Vector3(0.8, 0.9, 9.0)}};
  const std::array<Vector3, 1> body_W{Vector3(0.1, 0.2, 8.0)};
  const std::array<Vector3, 1> elsewhere_W{Vector3(0.1, 4.2, 8.0)};
  const auto is_free = [this, &body_W] {
    core::Work work;
    (void)sut_->export_view({0, 1e18, Vector3(0.1, 0.2, 5.0)}, unlimited_, work);
    std::uint64_t lookups = 0;
    return sut_->view().at(body_W[0] + Vector3(0.0, 0.0, 0.15), lookups) == CellState::kFree;
  };
  ASSERT_EQ(see(Shot(scene_, 1.0)), Status::kOk);
  ASSERT_FALSE(is_free());
  scene_.solid = {};
  const auto see_nothing = [this](int n, std::span<const Vector3> moved_W) {
    return see(Shot(scene_, 1.0 + 0.1 * n, Vector3(0.1, 0.2, 5.0 + 0.001 * n)), moved_W);
  };
  for (int n = 1; n <= 10; ++n) {
    ASSERT_EQ(see_nothing(n, elsewhere_W), Status::kOk);
    ASSERT_EQ(result_.frames_refused, 1U) << n;
  }
  EXPECT_FALSE(is_free());
  for (int n = 11; n <= 20; ++n) ASSERT_EQ(see_nothing(n, body_W), Status::kOk);
  EXPECT_EQ(result_.frames_refused, 0U);
  EXPECT_TRUE(is_free());
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, BadFrame,
    ::testing::Values(
        Fault{"Black", [](Shot& s, std::size_t i) { s.image[i].assign(s.image[i].size(), 0.0F); }},
        Fault{"White", [](Shot& s, std::size_t i) { s.image[i].assign(s.image[i].size(), kNothing); }},
        Fault{"Nan", [](Shot& s, std::size_t i) { s.image[i].assign(s.image[i].size(), kNanF); }},
        Fault{"Half",
              [](Shot& s, std::size_t i) {
                std::fill(s.image[i].begin() + static_cast<std::ptrdiff_t>(s.image[i].size() / 2),
                          s.image[i].end(), 0.0F);
              }},
        Fault{"WrongSize",
              [](Shot& s, std::size_t i) {
                s.frames[i].frame.depth_m = s.frames[i].frame.depth_m.first(64 * 63);
              }},
        Fault{"WrongPose",
              [](Shot& s, std::size_t i) {
                s.frames[i].X_WC.p_RT.y() = std::numeric_limits<double>::quiet_NaN();
              }},
        Fault{"Frozen",
              [](Shot& s, std::size_t i) {
                test::Scene scene;
                scene.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)},
                               {Vector3(6, -2, 0), Vector3(8, 2, 12)}};
                const Shot first(scene, 1.0);
                std::copy(first.image[i].begin(), first.image[i].end(), s.image[i].begin());
              }}),
    [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace roborun::stages
