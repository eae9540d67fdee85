// What a map makes of images as real cameras give them: holes, mixed pixels, noise, thin things.
#include <gtest/gtest.h>

#include <bit>
#include <functional>
#include <memory>

#include "core/random/counter_rng.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/perception/pixel_kinds.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;
using test::kNanF;
constexpr int kPixels = 64;

class NoisyImages : public ::testing::Test {
 protected:
  NoisyImages() : block_(64U << 20U), arena_(block_) {
    begin();
    scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)}, {Vector3(8, -2, 0), Vector3(12, 2, 12)}};
  }
  /// With an empty map.
  void begin(double finest_m = kPublishedCell_m) {
    arena_.~Arena();
    new (&arena_) core::Arena(block_);
    BrickMap::Config config;
    config.bounds_W = {Vector3(-30, -30, -3), Vector3(30, 30, 12)};
    config.lattice.finest_m = finest_m;
    config.max_bricks = 2000;
    config.max_image_width = config.max_image_height = kPixels;
    sut_ = std::make_unique<BrickMap>(config, arena_);
  }
  using Change = std::function<void(std::vector<float>&)>;
  /// One scan of all six cameras, each image changed.
  void see(const Change& change, const DepthError& error = {0.0, 0.0}, int level = 0) {
    auto frames = scene_.look(at_, kPixels);
    const MonotonicTime now = MonotonicTime{} + from_seconds(0.1 * ++scans_);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      change(scene_.image[i]);
      frames[i].frame.depth_m = scene_.image[i];
      frames[i].frame.stamp = now;
      frames[i].error = error;
    }
    const std::array<Vector3, 1> here{at_};
    IntegrationResult result;
    ASSERT_EQ(sut_->integrate({frames, level, kInfinity, here}, unlimited_, result), Status::kOk);
    ASSERT_EQ(result.frames_refused, 0U);
    thin_pixels_ = result.thin_pixels;
    core::Work work;
    (void)sut_->export_view({0, kInfinity, at_}, unlimited_, work);
  }
  CellState at(const Vector3& p_W) { return sut_->view().at(p_W, lookups_); }
  /// Cells of a box.
  int count(const Aabb& box, CellState state) {
    int cells = 0;
    for (double x = box.min_W.x(); x <= box.max_W.x(); x += 0.3)
      for (double y = box.min_W.y(); y <= box.max_W.y(); y += 0.3)
        for (double z = box.min_W.z(); z <= box.max_W.z(); z += 0.3)
          cells += at(Vector3(x, y, z)) == state ? 1 : 0;
    return cells;
  }

  /// Vague cells in the block around p_W.
  int vague_around(const Vector3& p_W) {
    const MapView& view = sut_->view();
    const double edge_m = block_m(view.finest_m());
    const Vector3 corner_W = edge_m * (p_W / edge_m).array().floor().matrix();
    CellBlock cells;
    if (view.read(corner_W, view.finest_m(), cells, lookups_) != BlockContent::kMixed) return 0;
    int sum = 0;
    for (const std::uint16_t row : cells.vague) sum += std::popcount(row);
    return sum;
  }

  std::vector<std::byte> block_;
  core::Arena arena_;
  std::unique_ptr<BrickMap> sut_;
  test::Scene scene_;
  Vector3 at_{0.1, 0.2, 5.0};
  core::UnlimitedBudget unlimited_;
  std::uint64_t lookups_{0};
  int scans_{0};
  std::uint32_t thin_pixels_{0};  ///< Of the last scan.
};

/// The whole sphere has a tenth of its pixels lost at random: nearly as much is free after two scans as of whole images.
TEST_F(NoisyImages, LostPixelsHereAndThereCostLittle) {
  const Aabb around{Vector3(-6.15, -6.15, 1.05), Vector3(6.15, 6.15, 8.85)};
  see([](auto&) {});
  const int whole = count(around, CellState::kFree);
  ASSERT_GT(whole, 20000);
  for (const double lost_ratio : {0.05, 0.3}) {
    begin();
    core::CounterRng rng(3);
    for (int n = 0; n < 2; ++n)
      see([&](auto& image) {
        for (float& d : image)
          if (rng.uniform() < lost_ratio) d = kNanF;
      });
    EXPECT_GT(count(around, CellState::kFree), 95 * whole / 100) << lost_ratio;
  }
}

TEST_F(NoisyImages, BehindAHoleNothingIsKnown) {
  // Straight ahead, 20 x 20 pixels of the image that looks forward.
  const auto lose = [this](auto& image) {
    if (&image != &scene_.image[0]) return;
    for (std::size_t v = 22; v < 42; ++v)
      for (std::size_t u = 22; u < 42; ++u) image[v * kPixels + u] = kNanF;
  };
  for (int n = 0; n < 10; ++n) see(lose);
  const Aabb hole{Vector3(4.05, -0.75, 4.35), Vector3(7.35, 0.75, 5.55)};
  EXPECT_EQ(count(hole, CellState::kFree), 0);
  EXPECT_EQ(count(hole, CellState::kOccupied), 0);
  EXPECT_EQ(at(Vector3(5.0, 3.0, 5.0)), CellState::kFree) << "beside it";
  see([](auto&) {});
  EXPECT_GT(count(hole, CellState::kFree), 100) << "and once it is seen, it is free at once";
}

TEST_F(NoisyImages, HolesDoNotClearWhatWasSeen) {
  const Aabb front{Vector3(7.85, -1.65, 1.05), Vector3(8.15, 1.65, 8.0)};
  for (int n = 0; n < 3; ++n) see([](auto&) {});
  const int before = count(front, CellState::kOccupied);
  ASSERT_GT(before, 200);
  for (int n = 0; n < 30; ++n)
    see([this](auto& image) {
      if (&image != &scene_.image[0]) return;
      for (std::size_t i = 0; i < image.size() / 2; ++i) image[i] = kNanF;
    });
  EXPECT_EQ(count(front, CellState::kOccupied), before);
}

/// A block of 0.4 m right ahead is 12 x 12 pixels: 10 of them may be in a hole at one look, 40 at each of two.
TEST_F(NoisyImages, WhatALookDoesNotDivideMayHideAsMuchAsACellOf30cm) {
  constexpr int kBlocks = 2;  // the level of 0.4 m
  const Aabb block{Vector3(1.25, 0.05, 4.85), Vector3(1.56, 0.36, 5.16)};
  const auto free_after = [&](std::size_t side, int looks, int level) {
    begin(0.1);
    for (int n = 0; n < looks; ++n)
      see(
          [&](auto& image) {
            if (&image != scene_.image.data()) return;
            for (std::size_t v = 32 - side / 2; v < 32 - side / 2 + side; ++v)
              for (std::size_t u = 32 - side / 2; u < 32 - side / 2 + side; ++u)
                image[v * kPixels + u] = kNanF;
          },
          {0.0, 0.0}, level);
    return count(block, CellState::kFree) == 8;  // its corners, 0.3 m apart
  };
  EXPECT_TRUE(free_after(3, 1, kBlocks)) << "5 pixels: its corners count as their neighbours";
  EXPECT_FALSE(free_after(6, 1, kBlocks)) << "32";
  EXPECT_TRUE(free_after(6, 2, kBlocks));
  EXPECT_FALSE(free_after(9, 10, kBlocks)) << "77";
}

/// What a product makes of sky: no value.
constexpr DepthError kDarkSky{0.0, 0.0, 0.0, 0.0, false, true};
void lose_sky(std::vector<float>& image) {
  for (float& d : image)
    if (std::isinf(d)) d = kNanF;
}

TEST_F(NoisyImages, SkyWithoutValuesIsFreeWhereTheGroundIsSeenBelowIt) {
  const Aabb ahead{Vector3(2.0, 4.05, 4.05), Vector3(9.0, 9.0, 8.0)};
  see([](auto&) {});
  const int whole = count(ahead, CellState::kFree);
  ASSERT_GT(whole, 4000);
  begin();
  see(lose_sky, {0.0, 0.0});
  EXPECT_LT(count(ahead, CellState::kFree), whole / 2)
      << "of a camera that should have values there, it is a hole";
  begin();
  see(lose_sky, kDarkSky);
  EXPECT_GT(count(ahead, CellState::kFree), 95 * whole / 100);
}

/// The pillar has no values, nor has the sky above it: it stands where the ground ends.
TEST_F(NoisyImages, AWallWithoutTextureStandsWhereItsFootIs) {
  for (int n = 0; n < 10; ++n)
    see(
        [this](auto& image) {
          lose_sky(image);
          if (&image != scene_.image.data()) return;
          for (std::size_t v = 0; v < kPixels; ++v)
            for (std::size_t u = 0; u < kPixels; ++u)
              if (float& d = image[v * kPixels + u]; d > 7.89F && d < 7.91F) d = kNanF;
        },
        kDarkSky);
  EXPECT_EQ(count({Vector3(8.1, -1.65, 0.45), Vector3(11.9, 1.65, 11.0)}, CellState::kFree), 0);
  EXPECT_GT(count({Vector3(4.05, -0.75, 4.35), Vector3(6.45, 0.75, 5.55)}, CellState::kFree), 100)
      << "in front of it";
}

/// A room with a ceiling of no texture: its wall is seen over the horizon, and what is above that is not sky.
TEST_F(NoisyImages, ACeilingWithoutTextureIsNoSky) {
  scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)},
                  {Vector3(15, -30, 0), Vector3(16, 30, 8)},
                  {Vector3(-30, -30, 8), Vector3(30, 30, 9)}};
  for (int n = 0; n < 10; ++n)
    see(
        [this](auto& image) {
          lose_sky(image);
          if (&image != scene_.image.data()) return;
          for (std::size_t v = 0; v < kPixels; ++v)
            for (std::size_t u = 0; u < kPixels; ++u) {
              const double up = 1.0 - (static_cast<double>(v) + 0.5) * 2.0 / kPixels;
              if (float& d = image[v * kPixels + u]; up > 0.0 && up * static_cast<double>(d) > 2.99)
                d = kNanF;
            }
        },
        kDarkSky);
  EXPECT_EQ(count({Vector3(4.05, -3.0, 8.15), Vector3(14.0, 3.0, 8.9)}, CellState::kFree), 0);
}

/// A patch that the wall's values surround is as far as they are: free up to it, and nothing of the wall.
TEST_F(NoisyImages, APatchWithoutTextureIsAsFarAsWhatIsAroundIt) {
  for (int n = 0; n < 10; ++n)
    see(
        [this](auto& image) {
          if (&image != scene_.image.data()) return;
          for (std::size_t v = 26; v < 38; ++v)
            for (std::size_t u = 26; u < 38; ++u) image[v * kPixels + u] = kNanF;
        },
        kDarkSky);
  EXPECT_GT(count({Vector3(4.05, -0.45, 4.65), Vector3(6.45, 0.45, 5.25)}, CellState::kFree), 70);
  EXPECT_EQ(count({Vector3(8.1, -1.65, 1.05), Vector3(11.9, 1.65, 11.0)}, CellState::kFree), 0);
}

/// Pixels at the edge of the pillar end between it and what is behind, each scan elsewhere.
TEST_F(NoisyImages, MixedPixelsLeaveNoObstacles) {
  scene_.solid.push_back({Vector3(18, -30, 0), Vector3(19, 30, 12)});
  core::CounterRng rng(11);
  DepthError error{0.0, 0.0};
  error.mixes = true;
  for (int n = 0; n < 20; ++n)
    see(
        [&](auto& image) {
          const std::vector<float> true_m = image;
          for (std::size_t i = 0; i + 1 < image.size(); ++i)
            if (std::isfinite(true_m[i]) && std::isfinite(true_m[i + 1]) &&
                std::fabs(true_m[i] - true_m[i + 1]) > 5.0F && rng.uniform() < 0.3)
              image[i] = true_m[i] + static_cast<float>(rng.uniform()) * (true_m[i + 1] - true_m[i]);
        },
        error);
  EXPECT_LE(count({Vector3(13.05, -7.95, 1.05), Vector3(16.95, 7.95, 9.0)}, CellState::kOccupied), 2);
}

TEST_F(NoisyImages, ANoisySurfaceIsNeverFree) {
  const DepthError error{0.01, 0.003};
  core::CounterRng rng(12);
  for (int n = 0; n < 30; ++n)
    see(
        [&](auto& image) {
          for (float& d : image)
            if (d < 20.0F) d += static_cast<float>(rng.normal() * error.at_m(static_cast<double>(d)));
        },
        error);
  EXPECT_EQ(count({Vector3(8.25, -1.65, 1.05), Vector3(9.15, 1.65, 8.0)}, CellState::kFree), 0);
  EXPECT_GT(count({Vector3(7.35, -1.65, 1.05), Vector3(8.55, 1.65, 8.0)}, CellState::kOccupied), 200);
}

/// Where the error is larger than a cell, "a surface is here" would be wrong for nearly all of them.
TEST_F(NoisyImages, FarSurfacesOfANoisyCameraAreUnknownUntilTheyAreNear) {
  const DepthError error{0.01, 0.01};
  see([](auto&) {}, error);
  const Aabb front{Vector3(7.85, -1.65, 1.05), Vector3(8.15, 1.65, 8.0)};
  EXPECT_EQ(count(front, CellState::kOccupied), 0) << "0.65 m at 8 m";
  EXPECT_EQ(count(front, CellState::kFree), 0);
  const int vague = vague_around(Vector3(8.0, 0.5, 5.0));
  EXPECT_GT(vague, 100) << "but something is about there";
  at_ = Vector3(4.0, 0.2, 5.0);
  see(
      [](auto& image) {
        for (float& d : image) d *= 1.001F;
      },
      error);
  EXPECT_GT(count(front, CellState::kOccupied), 100) << "0.17 m at 4 m";
  EXPECT_LT(vague_around(Vector3(8.0, 0.5, 5.0)), vague / 2);
}

/// A surface that a mixing camera shows is where it says with 1.5 sigma in a cell, or it is not occupied.
TEST_F(NoisyImages, SurfacesOfAMixingCameraNeedMoreEvidence) {
  const Aabb front{Vector3(7.85, -1.65, 1.05), Vector3(8.15, 1.65, 8.0)};
  DepthError error{0.01, 0.0035};  // 0.23 m at 8 m
  see([](auto&) {}, error);
  EXPECT_GT(count(front, CellState::kOccupied), 200);
  begin();
  error.mixes = true;
  see([](auto&) {}, error);
  EXPECT_EQ(count(front, CellState::kOccupied), 0);
  EXPECT_EQ(count(front, CellState::kFree), 0);
}

/// A pole of 5 cm at 5 m, met by every third image, with noise, with pixels that mix it with what is behind.
TEST_F(NoisyImages, APoleIsKeptByACameraThatMixes) {
  const test::Scene missed = scene_;
  scene_.solid.push_back({Vector3(5.1, 1.972, 0), Vector3(5.15, 2.022, 12)});
  const test::Scene seen = scene_;
  const DepthError error{0.0, 0.0024, 0.003, 0.0035, true};
  core::CounterRng rng(21);
  const auto measure = [&](auto& image) {
    const std::vector<float> true_m = image;
    for (std::size_t i = 0; i + 1 < image.size(); ++i) {
      const float far_m = std::min(true_m[i + 1], 20.0F);
      if (true_m[i] > 4.9F && true_m[i] < 5.3F && far_m > 6.0F && rng.uniform() < 0.3)
        image[i] += static_cast<float>(rng.uniform()) * (far_m - true_m[i]);
      if (image[i] < 20.0F)
        image[i] += static_cast<float>(rng.normal() * error.at_m(static_cast<double>(image[i])));
    }
  };
  for (int n = 0; n < 60; ++n) {
    scene_ = n % 3 == 0 ? seen : missed;
    see(measure, error);
    if (n < 12) continue;
    int whole = 0;
    for (double z = 4.05; z < 6.0; z += 0.3)
      whole += count({Vector3(4.95, 1.95, z), Vector3(5.25, 1.95, z)}, CellState::kOccupied) > 0 ? 1 : 0;
    ASSERT_EQ(whole, 7) << n;
  }
}

/// A pole that falls between two pixels in nine of ten images.
TEST_F(NoisyImages, APoleSeenOnceIsKept) {
  test::Scene missed = scene_;
  scene_.solid.push_back({Vector3(3.0, 1.02, 0), Vector3(3.05, 1.07, 12)});
  const Aabb pole{Vector3(3.0, 1.05, 4.05), Vector3(3.0, 1.05, 6.0)};
  see([](auto&) {});
  ASSERT_EQ(count(pole, CellState::kOccupied), 7);
  EXPECT_GT(thin_pixels_, 20U);
  const test::Scene seen = scene_;
  int least = 7;
  for (int n = 1; n <= 200; ++n) {
    scene_ = n % 10 == 0 ? seen : missed;
    see([](auto&) {});
    least = std::min(least, count(pole, CellState::kOccupied));
    EXPECT_EQ(thin_pixels_ > 0, n % 10 == 0) << n;
  }
  EXPECT_EQ(least, 7);
  // But not for ever: one that was taken away is free after some hundred looks that could have met it.
  scene_ = missed;
  for (int n = 0; n < 700; ++n) see([](auto&) {});
  EXPECT_EQ(count(pole, CellState::kOccupied), 0);
}

TEST(PixelKinds, KnowsMixedAndThinOnes) {
  constexpr std::size_t kWidth = 21, kHeight = 9;
  std::vector<float> depth(kWidth * kHeight, 10.0F);
  const auto at = [&](std::size_t u, std::size_t v) -> float& { return depth[v * kWidth + u]; };
  for (std::size_t v = 0; v < kHeight; ++v) {
    at(4, v) = 3.0F;                                        // a pole
    for (std::size_t u = 12; u < 16; ++u) at(u, v) = 5.0F;  // a body
  }
  at(16, 4) = 7.0F;  // between it and what is behind
  at(8, 6) = 4.0F;   // a small thing alone
  at(3, 2) = kNanF;
  at(19, 7) = at(19, 8) = 8.0F;  // a pole that ends below what is nearer
  for (std::size_t u = 18; u < 21; ++u) at(u, 5) = at(u, 6) = 6.0F;
  firmware_if::DepthFrame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.range_m = 20.0F;
  frame.depth_m = depth;
  PixelRow row;
  constexpr PixelRules kMixing{0.3F, 0.0F, true, 0.3F, 0.0F};
  // One neighbour at most is as far away, and another one is nearer.
  const auto may_be_mixed = [](std::size_t u, std::size_t v) {
    return (u == 19 && v == 7) || (u == 20 && v > 6);
  };
  for (std::size_t v = 0; v < kHeight; ++v) {
    tell_pixels(frame, v, 0, kWidth, {0.3F, 0.0F, false}, row);
    EXPECT_EQ((row.thin[0] >> 8U) & 1U, v == 6 ? 1U : 0U) << "of an ideal camera it is there";
    EXPECT_EQ((row.thin[0] >> 19U) & 1U, v == 7 || v == 8 ? 1U : 0U) << v;
    tell_pixels(frame, v, 0, kWidth, kMixing, row);
    for (std::size_t u = 0; u < kWidth; ++u) {
      const bool is_lost = (u == 16 && v == 4) || (u == 3 && v == 2) || may_be_mixed(u, v);
      EXPECT_EQ(row.depth_m[u], is_lost ? 0.0F : at(u, v)) << u << ", " << v;
      EXPECT_EQ((row.thin[0] >> u) & 1U, u == 4 || (u == 19 && v == 8) ? 1U : 0U) << u << ", " << v;
    }
    EXPECT_EQ((row.surely_thin[0] >> 4U) & 1U, v == 2 ? 0U : 1U) << "nobody knows what is beside it";
    // A part of a row is told as it is in the whole.
    const PixelRow whole = row;
    tell_pixels(frame, v, 4, 17, kMixing, row);
    for (std::size_t u = 4; u < 17; ++u) {
      EXPECT_EQ(row.depth_m[u - 4], whole.depth_m[u]);
      EXPECT_EQ((row.thin[0] >> (u - 4)) & 1U, (whole.thin[0] >> u) & 1U);
    }
  }
}

}  // namespace
}  // namespace roborun::stages
