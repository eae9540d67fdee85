/// Cameras of any optics, size and place: what an image does not see stays unknown, what it sees is where it is.
#include <gtest/gtest.h>

#include <deque>
#include <memory>

#include "core/geometry/camera_pose.hpp"
#include "core/random/counter_rng.hpp"
#include "core/sensor_rig.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/perception/point_cloud.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

using test::kInfinity;
using test::kNanF;

/// A D455's: 640 x 480, 87 x 58 degrees, 0.3 to 10 m.
CameraSpec front() {
  CameraSpec camera;
  camera.width = 640;
  camera.height = 480;
  camera.tan_half_width = rig_detail::tan_of_half_deg(87.0);
  camera.tan_half_height = rig_detail::tan_of_half_deg(58.0);
  camera.range_min_m = 0.3;
  camera.range_m = 10.0;
  camera.mount.x_m = 0.3;
  return camera;
}
CameraSpec rear() {
  CameraSpec camera;
  camera.width = 96;
  camera.height = 128;
  camera.tan_half_width = rig_detail::tan_of_half_deg(50.0);
  camera.tan_half_height = rig_detail::tan_of_half_deg(70.0);
  camera.range_m = 6.0;
  camera.mount = {-0.2, 0.1, 0.0, 170.0, 15.0, 8.0};
  return camera;
}

class AnyCamera : public ::testing::Test {
 protected:
  AnyCamera() : block_(64U << 20U), arena_(block_) {
    config_.bounds_W = {Vector3(-12, -12, -3), Vector3(15, 12, 12)};
    config_.max_bricks = 2000;
    config_.max_frames = 2;
    config_.all_around_frames = 0;
    config_.max_image_width = 1280;
    config_.max_image_height = 720;
    scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)},
                    {Vector3(6, -2, 0), Vector3(8, 2, 12)},
                    {Vector3(-5, 1, 0), Vector3(-4, 3, 12)}};
    X_WB_.p_RT = Vector3(0.1, 0.2, 4.0);
  }
  PosedDepthFrame look(const CameraSpec& camera) {
    PosedDepthFrame posed;
    posed.X_WC = core::camera_pose(X_WB_, camera_mount(camera.mount));
    posed.p_BC_W = posed.X_WC.p_RT - X_WB_.p_RT;
    std::vector<float>& image = image_.emplace_back();
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const Vector3 ray(1.0, -(2.0 * (u + 0.5) / camera.width - 1.0) * camera.tan_half_width,
                          -(2.0 * (v + 0.5) / camera.height - 1.0) * camera.tan_half_height);
        const double depth_m = scene_.hit_m(posed.X_WC.p_RT, posed.X_WC.R_RT * ray);
        image.push_back(depth_m < camera.range_m ? static_cast<float>(depth_m)
                                                 : std::numeric_limits<float>::infinity());
      }
    }
    posed.frame.width = camera.width;
    posed.frame.height = camera.height;
    posed.frame.tan_half_width = static_cast<float>(camera.tan_half_width);
    posed.frame.tan_half_height = static_cast<float>(camera.tan_half_height);
    posed.frame.range_m = static_cast<float>(camera.range_m);
    posed.frame.range_min_m = static_cast<float>(camera.range_min_m);
    posed.frame.depth_m = image;
    return posed;
  }
  /// Every cell of the map against the truth of these cameras.
  void check(const std::vector<CameraSpec>& cameras, const std::vector<PosedDepthFrame>& frames, int level) {
    std::vector<std::byte> block(BrickMap::arena_bytes(config_));
    core::Arena arena(block);
    BrickMap map(config_, arena);
    ASSERT_FALSE(arena.exhausted());
    const std::array<Vector3, 1> here{X_WB_.p_RT};
    IntegrationResult result;
    for (int n = 0; n < 2; ++n) {
      const test::NoAllocScope scope;
      ASSERT_EQ(map.integrate({frames, level, kInfinity, here}, unlimited_, result), Status::kOk);
      ASSERT_EQ(scope.count(), 0U);
    }
    ASSERT_EQ(result.frames_refused, 0U);
    core::Work work;
    (void)map.export_view({0, kInfinity, X_WB_.p_RT}, unlimited_, work);
    std::uint64_t lookups = 0;
    int unseen = 0, free = 0, missed = 0, surfaces = 0;
    for (double x = -11.85; x < 15; x += 0.3) {
      for (double y = -11.85; y < 12; y += 0.3) {
        for (double z = -2.85; z < 12; z += 0.3) {
          const Vector3 p_W(x, y, z);
          if ((p_W - X_WB_.p_RT).norm() < 0.9) continue;  // the vehicle itself
          const CellState state = map.view().at(p_W, lookups);
          bool may_see = false, sees_well = false;
          for (std::size_t i = 0; i < cameras.size(); ++i) {
            const Vector3 p_C = frames[i].X_WC.inverse_times(p_W);
            // A cell's corner is 0.26 m from its middle.
            const double across = cameras[i].tan_half_width, along = cameras[i].tan_half_height;
            const auto inside = [&](double margin_m) {
              return std::fabs(p_C.y()) < across * p_C.x() - margin_m * std::hypot(1.0, across) &&
                     std::fabs(p_C.z()) < along * p_C.x() - margin_m * std::hypot(1.0, along);
            };
            may_see = may_see || (p_C.x() < cameras[i].range_m + 0.3 && inside(-0.27));
            const double hit = scene_.hit_m(frames[i].X_WC.p_RT, p_W - frames[i].X_WC.p_RT);
            // All of a sphere around the middle lies before the surface.
            sees_well = sees_well ||
                        (inside(0.6) && p_C.x() > 1.5 && p_C.x() < cameras[i].range_m - 0.6 && hit > 1.3);
          }
          const bool solid = scene_.occupied(p_W + Vector3(0.16, 0.16, 0.16)) &&
                             scene_.occupied(p_W - Vector3(0.16, 0.16, 0.16));
          if (!may_see) {
            ++unseen;
            ASSERT_EQ(state, CellState::kUnknown) << p_W.transpose() << " is seen by nobody";
          }
          if (solid) {
            ASSERT_NE(state, CellState::kFree) << p_W.transpose() << " is solid";
          }
          surfaces += state == CellState::kOccupied ? 1 : 0;
          if (sees_well && level == 0) ++(state == CellState::kFree ? free : missed);
        }
      }
    }
    EXPECT_GT(unseen, 50000);
    EXPECT_GT(surfaces, level < kBrickLevel ? 100 : -1) << "a coarse look only notes them";
    if (level == 0) {
      EXPECT_GT(free, 4000);
      EXPECT_LT(missed, free / 20) << "at the edges of the pillars alone";
    }
  }
  std::vector<std::byte> block_;
  core::Arena arena_;
  BrickMap::Config config_;
  test::Scene scene_;
  Pose X_WB_;
  std::deque<std::vector<float>> image_;
  core::UnlimitedBudget unlimited_;
};

TEST_F(AnyCamera, WhatItDoesNotSeeStaysUnknown) {
  for (const int level : {0, 1, 2, 4}) check({front()}, {look(front())}, level);
}

TEST_F(AnyCamera, TwoDifferentOnesDoNotVouchForWhatIsBetweenThem) {
  for (const int level : {0, 2}) check({front(), rear()}, {look(front()), look(rear())}, level);
}

TEST_F(AnyCamera, TheSmallestAndTheLargestImageAreTaken) {
  CameraSpec large = front(), small = rear();
  large.width = 1280;
  large.height = 720;
  small.width = small.height = 8;
  check({large, small}, {look(large), look(small)}, 0);
}

TEST_F(AnyCamera, WhatIsTooNearSaysNothing) {
  PosedDepthFrame posed = look(front());
  std::vector<float>& image = image_.back();
  // The left half shows something at 0.2 m: no information, like NaN.
  for (std::size_t i = 0; i < image.size(); ++i)
    if (i % 640 < 200) image[i] = 0.2F;
  const auto digest = [&] {
    std::vector<std::byte> block(64U << 20U);
    core::Arena arena(block);
    BrickMap map(config_, arena);
    const std::array<Vector3, 1> here{X_WB_.p_RT};
    IntegrationResult result;
    EXPECT_EQ(map.integrate({{&posed, 1}, 0, kInfinity, here}, unlimited_, result), Status::kOk);
    return map.digest();
  };
  const std::uint64_t near = digest();
  for (std::size_t i = 0; i < image.size(); ++i)
    if (i % 640 < 200) image[i] = kNanF;
  EXPECT_EQ(digest(), near);
  for (std::size_t i = 0; i < image.size(); ++i)
    if (i % 640 < 200) image[i] = 0.31F;
  EXPECT_NE(digest(), near) << "a surface";
}

TEST_F(AnyCamera, ThePointCloudKnowsTheFieldOfView) {
  scene_.solid.clear();
  PointCloud cloud({}, arena_);
  const std::array<PosedDepthFrame, 1> frames{look(front())};
  core::Work work;
  ASSERT_EQ(cloud.step(frames, 0, unlimited_, work), Status::kOk);
  const double pyramid_m3 = 4.0 * front().tan_half_width * front().tan_half_height * 1000.0 / 3.0;
  EXPECT_NEAR(cloud.seen_volume_m3(), pyramid_m3, 1e-3 * pyramid_m3);
  EXPECT_TRUE(cloud.points().empty());
  scene_.solid = {{Vector3(6, -20, -20), Vector3(8, 20, 20)}};
  const std::array<PosedDepthFrame, 1> wall{look(front())};
  ASSERT_EQ(cloud.step(wall, 0, unlimited_, work), Status::kOk);
  double left_m = 0.0, top_m = 0.0;
  for (const CloudPoint& p : cloud.points()) {
    EXPECT_NEAR(p.p_W.x(), 6.0, 1e-3);
    left_m = std::max(left_m, p.p_W.y() - X_WB_.p_RT.y());
    top_m = std::max(top_m, p.p_W.z() - X_WB_.p_RT.z());
  }
  EXPECT_NEAR(left_m, 5.6 * front().tan_half_width, 0.3);
  EXPECT_NEAR(top_m, 5.6 * front().tan_half_height, 0.3);
}

TEST_F(AnyCamera, OnlyTheUnknownIsAssumedToBeFree) {
  BrickMap map(config_, arena_);
  const std::array<PosedDepthFrame, 1> frames{look(front())};
  const std::array<Vector3, 1> here{X_WB_.p_RT};
  IntegrationResult result;
  IntegrationRequest request{frames, 0, kInfinity, here};
  request.assumed_half_m = Vector3(7.0, 2.0, 2.0);
  for (int n = 0; n < 20; ++n) ASSERT_EQ(map.integrate(request, unlimited_, result), Status::kOk);
  core::Work work;
  (void)map.export_view({0, kInfinity, X_WB_.p_RT}, unlimited_, work);
  std::uint64_t lookups = 0;
  EXPECT_EQ(map.view().at(Vector3(0.1, 0.2, 5.4), lookups), CellState::kFree) << "above, not seen";
  EXPECT_EQ(map.view().at(Vector3(-3.0, 0.2, 4.0), lookups), CellState::kFree) << "behind, not seen";
  EXPECT_EQ(map.view().at(Vector3(0.1, 0.2, 6.6), lookups), CellState::kUnknown) << "outside of the box";
  int surface = 0;
  for (const double x : {5.85, 6.15})
    surface += map.view().at(Vector3(x, 0.15, 4.0), lookups) == CellState::kOccupied;
  EXPECT_GT(surface, 0) << "the pillar was seen";
}

TEST(WidePyramid, BoundsEveryRectangleOfTheLargestImage) {
  core::CounterRng rng(5);
  std::vector<float> depth(1280 * 720);
  for (float& d : depth) d = static_cast<float>(rng.uniform(0.5, 30.0));
  for (int i = 0; i < 500; ++i) {
    const auto at = static_cast<std::size_t>(rng.below(depth.size()));
    depth[at] = i % 2 == 0 ? kNanF : 0.2F;
    if (at + 1281 < depth.size() && i % 5 == 0) depth[at + 1] = depth[at + 1280] = kNanF;
  }
  for (std::size_t v = 100; v < 140; ++v)  // a hole
    std::fill_n(depth.begin() + static_cast<std::ptrdiff_t>(1280 * v + 300), 57, kNanF);
  {}
  firmware_if::DepthFrame frame;
  frame.width = 1280;
  frame.height = 720;
  frame.tan_half_width = 1.0F;
  frame.tan_half_height = 0.5F;
  frame.range_m = 25.0F;
  frame.range_min_m = 0.3F;
  frame.depth_m = depth;
  std::vector<std::byte> block(DepthPyramid::arena_bytes(1280, 720));
  core::Arena arena(block);
  DepthPyramid sut(arena, 1280, 720);
  ASSERT_FALSE(arena.exhausted());
  // Not in a hole: has information, or most of the pixels around it have.
  std::vector<bool> seen(depth.size());
  for (int v = 0; v < 720; ++v)
    for (int u = 0; u < 1280; ++u) {
      int pixels = 0, known = 0;
      for (int y = std::max(v - 1, 0); y <= std::min(v + 1, 719); ++y)
        for (int x = std::max(u - 1, 0); x <= std::min(u + 1, 1279); ++x, ++pixels)
          known += depth[static_cast<std::size_t>(y * 1280 + x)] > 0.3F ? 1 : 0;
      seen[static_cast<std::size_t>(v * 1280 + u)] =
          depth[static_cast<std::size_t>(v * 1280 + u)] > 0.3F || 2 * known > pixels;
    }
  for (int n = 0; n < 400; ++n) {
    if (n % 100 == 0) {
      ASSERT_EQ(sut.build(frame, n / 100), Status::kOk);
      ASSERT_TRUE(sut.has_holes() && sut.shows_anything());
    }
    const int wide = n % 10 == 0 ? 1280 : 60;
    const int u0 = static_cast<int>(rng.below(1280)), v0 = static_cast<int>(rng.below(720));
    const int u1 = std::min(1279, u0 + static_cast<int>(rng.below(static_cast<std::uint64_t>(wide)))),
              v1 = std::min(719, v0 + static_cast<int>(rng.below(static_cast<std::uint64_t>(wide))));
    const DepthPyramid::Bound bound = sut.bound(u0, v0, u1, v1);
    const int side = 1 << (n / 100);
    const DepthPyramid::SeenSums sums = sut.seen_sums();
    ASSERT_EQ(1 << sums.shift, side);
    const auto sum = [&](int x, int y) { return sums.seen[y * sums.row + x]; };
    const std::uint32_t seen_pixels = sum(u1 / side + 1, v1 / side + 1) - sum(u0 / side, v1 / side + 1) -
                                      sum(u1 / side + 1, v0 / side) + sum(u0 / side, v0 / side);
    std::uint32_t counted = 0;
    for (int v = v0 / side * side; v < std::min((v1 / side + 1) * side, 720); ++v) {
      for (int u = u0 / side * side; u < std::min((u1 / side + 1) * side, 1280); ++u) {
        counted += seen[static_cast<std::size_t>(v) * 1280 + static_cast<std::size_t>(u)] ? 1U : 0U;
      }
    }
    ASSERT_EQ(seen_pixels, counted);
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) {
        const float d = depth[static_cast<std::size_t>(v) * 1280 + static_cast<std::size_t>(u)];
        if (!(d > 0.3F)) continue;
        ASSERT_LE(bound.least_m, std::min(d, 25.0F));
        ASSERT_GE(bound.most_m, std::min(d, 25.0F) - 1e-3F);
      }
    }
  }
  EXPECT_EQ(sut.build(frame, 0), Status::kOk);
  frame.width = 1281;
  EXPECT_EQ(sut.build(frame, 0), Status::kCapacity);
}

TEST(FrameShape, RefusesOpticsThatCannotBe) {
  test::Scene scene;
  const auto status = [&](auto&& change) {
    PosedDepthFrame posed = scene.look(Vector3::Zero())[0];
    change(posed.frame);
    return check_shape(posed);
  };
  EXPECT_EQ(status([](auto&) {}), Status::kOk);
  EXPECT_EQ(status([](auto& f) { f.tan_half_height = 0.5F; }), Status::kOk);
  for (const float bad : {0.0F, -1.0F, 2.5F, kNanF}) {
    EXPECT_EQ(status([bad](auto& f) { f.tan_half_width = bad; }), Status::kInvalidArgument);
    EXPECT_EQ(status([bad](auto& f) { f.tan_half_height = bad; }), Status::kInvalidArgument);
  }
  for (const float bad : {-0.1F, 20.0F, 30.0F, kNanF})
    EXPECT_EQ(status([bad](auto& f) { f.range_min_m = bad; }), Status::kInvalidArgument);
}

}  // namespace
}  // namespace roborun::stages
