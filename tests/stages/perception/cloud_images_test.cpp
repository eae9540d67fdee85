#include "stages/perception/cloud_images.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "core/geometry/math.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/perception/point_cloud.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

/// A spinning LiDAR in the scene: a floor and a pillar, steps of 2 degrees, 45 down to 45 up.
class CloudImagesTest : public ::testing::Test {
 protected:
  CloudImagesTest() : block_(96U << 20U), arena_(block_), sut_({}, arena_) {
    scene_.solid = {{Vector3(-30, -30, -1), Vector3(30, 30, 0)}, {Vector3(6, -2, 0), Vector3(8, 2, 12)}};
    X_WL_.R_RT = Eigen::AngleAxisd(0.4, Vector3::UnitZ()).toRotationMatrix();
    X_WL_.p_RT = Vector3(0.1, 0.2, 3.0);
    constexpr double kStep = 2.0 * 3.14159265358979 / 180.0;
    for (int e = -22; e <= 22; ++e) {
      for (int a = 0; a < 180; ++a) {
        const Vector3 ray_L(std::cos(e * kStep) * std::cos(a * kStep),
                            std::cos(e * kStep) * std::sin(a * kStep), std::sin(e * kStep));
        const double hit_m = scene_.hit_m(X_WL_.p_RT, X_WL_.R_RT * ray_L);
        if (!(hit_m < 30.0)) continue;
        const Vector3 p_L = hit_m * ray_L;
        point_.push_back(
            {static_cast<float>(p_L.x()), static_cast<float>(p_L.y()), static_cast<float>(p_L.z())});
      }
    }
  }
  static BrickMap::Config map_of(const Aabb& bounds_W) {
    BrickMap::Config config;
    config.bounds_W = bounds_W;
    config.max_bricks = 3000;
    config.max_image_width = config.max_image_height = 64;
    return config;
  }

  std::vector<std::byte> block_;
  core::Arena arena_;
  CloudImages sut_;
  test::Scene scene_;
  Pose X_WL_;
  std::vector<std::array<float, 3>> point_;
  core::UnlimitedBudget unlimited_;
};

TEST_F(CloudImagesTest, EachPointIsItsPixel) {
  ASSERT_EQ(sut_.make({point_, {}, 20.0F, X_WL_}), Status::kOk);
  int pixels = 0;
  for (const PosedDepthFrame& posed : sut_.frames()) {
    EXPECT_NEAR((posed.X_WC.R_RT.transpose() * posed.X_WC.R_RT - Matrix3::Identity()).norm(), 0.0, 1e-12);
    EXPECT_NEAR(posed.X_WC.R_RT.determinant(), 1.0, 1e-12);
    for (int v = 0; v < 32; ++v) {
      for (int u = 0; u < 32; ++u) {
        const float depth_m = posed.frame.depth_m[static_cast<std::size_t>(32 * v + u)];
        if (!(depth_m > 0.0F)) continue;
        ++pixels;
        const Vector3 ray(1.0, 1.0 - (u + 0.5) / 16.0, 1.0 - (v + 0.5) / 16.0);
        const Vector3 p_L = X_WL_.inverse_times(posed.X_WC * (static_cast<double>(depth_m) * ray));
        double nearest_m = 1e9;
        for (const auto& p : point_)
          nearest_m = std::min(nearest_m, (Vector3(p[0], p[1], p[2]) - p_L).norm());
        EXPECT_LT(nearest_m, 0.5 * std::sqrt(2.0) / 16.0 * static_cast<double>(depth_m) + 1e-3)
            << "half a pixel";
      }
    }
  }
  EXPECT_GT(pixels, 1000);
}

TEST_F(CloudImagesTest, CloudsGoIntoTheSameMapAndPointCloud) {
  BrickMap map(map_of({Vector3(-30, -30, -3), Vector3(30, 30, 12)}), arena_);
  PointCloud cloud({}, arena_);
  ASSERT_FALSE(arena_.exhausted());
  ASSERT_EQ(sut_.make({point_, {}, 20.0F, X_WL_}), Status::kOk);
  const std::array<Vector3, 1> here{X_WL_.p_RT};
  IntegrationResult result;
  core::Work work;
  {
    const test::NoAllocScope scope;
    ASSERT_EQ(sut_.make({point_, {}, 20.0F, X_WL_}), Status::kOk);
    ASSERT_EQ(map.integrate({sut_.frames(), 0, 1e18, here}, unlimited_, result), Status::kOk);
    ASSERT_EQ(cloud.step(sut_.frames(), 1, unlimited_, work), Status::kOk);
    EXPECT_EQ(scope.count(), 0U);
  }
  EXPECT_EQ(result.frames_refused, 0U);
  EXPECT_GT(cloud.points().size(), 300U);
  (void)map.export_view({0, 1e18, X_WL_.p_RT}, unlimited_, work);
  std::uint64_t lookups = 0;
  int surface = 0;
  for (double z = 0.45; z < 6; z += 0.3)
    for (const double x : {5.85, 6.15, 6.45})
      surface += map.view().at(Vector3(x, 0.2, z), lookups) == CellState::kOccupied ? 1 : 0;
  EXPECT_GT(surface, 5) << "the front of the pillar";
  EXPECT_EQ(map.view().at(Vector3(4.0, 0.2, 3.0), lookups), CellState::kFree) << "in front of it";
  EXPECT_EQ(map.view().at(Vector3(-4.0, 0.2, 1.8), lookups), CellState::kFree) << "above the floor";
  EXPECT_EQ(map.view().at(Vector3(-4.0, 0.2, 6.0), lookups), CellState::kUnknown) << "no point came back";
  EXPECT_EQ(map.view().at(Vector3(10.0, 0.2, 3.0), lookups), CellState::kUnknown) << "behind the pillar";
}

TEST_F(CloudImagesTest, ABandOfRaysSeesABandAllAround) {
  // 1.4 degrees apart, 20 degrees up and down, into a round room of 12 m that is 100 m high.
  std::vector<std::array<float, 3>> band;
  for (int ring = -14; ring <= 14; ++ring)
    for (int column = 0; column < 360; ++column) {
      const double up = ring * 1.4 * core::kPi / 180.0, turn = column * core::kPi / 180.0;
      band.push_back({static_cast<float>(12.0 * std::cos(turn)), static_cast<float>(12.0 * std::sin(turn)),
                      static_cast<float>(12.0 * std::tan(up))});
    }
  BrickMap map(map_of({Vector3(-30, -30, -12), Vector3(30, 30, 12)}), arena_);
  ASSERT_FALSE(arena_.exhausted());
  const std::array<Vector3, 1> here{Vector3::Zero()};
  IntegrationResult result;
  core::Work work;
  ASSERT_EQ(sut_.make({band, {}, 20.0F, {}}), Status::kOk);
  ASSERT_EQ(sut_.frames().size(), CloudImages::kImages);
  ASSERT_EQ(map.integrate({sut_.frames(), 0, 1e18, here}, unlimited_, result), Status::kOk);
  (void)map.export_view({0, 1e18, here[0]}, unlimited_, work);
  std::uint64_t lookups = 0;
  int free = 0;
  for (int column = 0; column < 72; ++column) {
    // In steps of 5 degrees, the borders of the images among them.
    const double turn = column * core::kPi / 36.0, x = 6.0 * std::cos(turn), y = 6.0 * std::sin(turn);
    free += map.view().at(Vector3(x, y, 0.1), lookups) == CellState::kFree ? 1 : 0;
    EXPECT_EQ(map.view().at(Vector3(x, y, 4.0), lookups), CellState::kUnknown) << "above the band";
    EXPECT_EQ(map.view().at(Vector3(x, y, -4.0), lookups), CellState::kUnknown) << "below the band";
    EXPECT_EQ(map.view().at(Vector3(2.2 * x, 2.2 * y, 0.1), lookups), CellState::kUnknown)
        << "behind the wall";
  }
  EXPECT_EQ(free, 72);
  EXPECT_EQ(map.view().at(Vector3(0.1, 0.1, 3.0), lookups), CellState::kUnknown) << "straight up";
}

TEST_F(CloudImagesTest, RaysThatMetNothingClearUpToTheRangeAndShowNoSurface) {
  constexpr double kRange_m = 10.0;
  std::vector<std::array<float, 3>> rays;
  for (int ring = -44; ring <= 44; ++ring)
    for (int column = 0; column < 360; ++column) {
      const double up = ring * core::kPi / 180.0, turn = column * core::kPi / 180.0;
      const double r_m = 1.01 * kRange_m;
      rays.push_back({static_cast<float>(r_m * std::cos(up) * std::cos(turn)),
                      static_cast<float>(r_m * std::cos(up) * std::sin(turn)),
                      static_cast<float>(r_m * std::sin(up))});
    }
  BrickMap map(map_of({Vector3(-15, -15, -12), Vector3(15, 15, 12)}), arena_);
  PointCloud cloud({}, arena_);
  ASSERT_FALSE(arena_.exhausted());
  const std::array<Vector3, 1> here{Vector3::Zero()};
  IntegrationResult result;
  core::Work work;
  ASSERT_EQ(sut_.make({rays, {}, static_cast<float>(kRange_m), {}}), Status::kOk);
  ASSERT_EQ(cloud.step(sut_.frames(), 1, unlimited_, work), Status::kOk);
  EXPECT_EQ(cloud.points().size(), 0U);
  ASSERT_EQ(map.integrate({sut_.frames(), 0, 1e18, here}, unlimited_, result), Status::kOk);
  (void)map.export_view({0, 1e18, here[0]}, unlimited_, work);
  std::uint64_t lookups = 0;
  // At 45 degrees the range ends where the depth along the image's axis is 7.1 m.
  for (const double turn : {0.0, 0.4, core::kPi / 4.0, 2.0}) {
    const Vector3 ray(std::cos(turn), std::sin(turn), 0.0);
    EXPECT_EQ(map.view().at(9.0 * ray, lookups), CellState::kFree) << turn;
    for (double m = 9.5; m < 14.0; m += 0.1)
      EXPECT_NE(map.view().at(m * ray, lookups), CellState::kOccupied) << m << " " << turn;
    EXPECT_EQ(map.view().at(10.7 * ray, lookups), CellState::kUnknown) << turn;
  }
}

TEST_F(CloudImagesTest, FarPointsClearAndNearOnesSayNothing) {
  const auto depth_of = [&](std::array<float, 3> p) {
    const std::vector<std::array<float, 3>> points{p, {0.0F, 5.0F, 0.0F}};
    EXPECT_EQ(sut_.make({points, {}, 20.0F, {}, Vector3::Zero(), 0.5F}), Status::kOk);
    for (const float depth_m : sut_.frames()[0].frame.depth_m)
      if (depth_m > 0.0F) return depth_m;
    return -1.0F;
  };
  EXPECT_EQ(depth_of({7.0F, 0.0F, 0.0F}), 7.0F);
  EXPECT_EQ(depth_of({50.0F, 0.0F, 0.0F}), std::numeric_limits<float>::infinity());
  EXPECT_EQ(depth_of({0.4F, 0.0F, 0.0F}), -1.0F);
}

TEST_F(CloudImagesTest, NoPointsAreNoScan) {
  EXPECT_EQ(sut_.make({{}, {}, 20.0F, X_WL_}), Status::kInvalidArgument);
  EXPECT_TRUE(sut_.frames().empty());
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::array<float, 3>> bad{{kNan, 1, 1}, {1, kNan, 1}, {0, 0, 0}, {0, 0, 0}};
  EXPECT_EQ(sut_.make({bad, {}, 20.0F, X_WL_}), Status::kInvalidArgument);
  EXPECT_EQ(sut_.counters().points_refused, 2U);
  EXPECT_EQ(sut_.make({point_, {}, kNan, X_WL_}), Status::kInvalidArgument);
  Pose bad_pose = X_WL_;
  bad_pose.p_RT.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(sut_.make({point_, {}, 20.0F, bad_pose}), Status::kInvalidArgument);
  EXPECT_EQ(sut_.counters().clouds_refused, 4U);
  EXPECT_TRUE(sut_.frames().empty());
}

}  // namespace
}  // namespace roborun::stages
