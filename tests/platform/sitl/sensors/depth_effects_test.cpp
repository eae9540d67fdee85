#include "platform/sitl/sensors/depth_effects.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "platform/sitl/sensors/depth_camera.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::sitl {
namespace {

using test::kInfinity;

/// A camera before a scene that is given by its depth at (u, v), and what it makes of it.
class Studio {
 public:
  Studio(CameraModel model, std::uint16_t width, double invalid_ratio, DepthModel errors = dark(),
         std::uint64_t seed = 3)
      : spec_(spec_of(model, width, invalid_ratio)), effects_(spec_, seed, 0, errors) {
    for (int v = 0; v < spec_.height; ++v)
      for (int u = 0; u < spec_.width; ++u)
        ray_C_.emplace_back(1.0, 1.0 - 2.0 * (u + 0.5) / spec_.width, 1.0 - 2.0 * (v + 0.5) / spec_.height);
  }
  /// Without a sun.
  static DepthModel dark() {
    DepthModel m;
    m.glare_deg = 0.0;
    return m;
  }
  static CameraSpec spec_of(CameraModel model, std::uint16_t width, double invalid_ratio) {
    CameraSpec spec;
    spec.width = spec.height = width;
    spec.range_m = 10.0;
    spec.model = model;
    spec.invalid_ratio = invalid_ratio;
    return spec;
  }
  template <typename Depth>
  const std::vector<float>& image(std::uint32_t sequence, Depth&& depth_m, const Pose& X_WC = {}) {
    image_.clear();
    for (int v = 0; v < spec_.height; ++v)
      for (int u = 0; u < spec_.width; ++u) image_.push_back(static_cast<float>(depth_m(u, v)));
    Exposure e;
    e.sequence = sequence;
    e.stamp = MonotonicTime{} + sequence * Nanos{20'000'000};
    effects_.apply(e, X_WC, ray_C_, image_);
    return image_;
  }
  [[nodiscard]] float at(int u, int v) const { return image_[static_cast<std::size_t>(v * spec_.width + u)]; }
  [[nodiscard]] int width() const { return spec_.width; }
  [[nodiscard]] DepthEffects& effects() { return effects_; }

 private:
  CameraSpec spec_;
  DepthEffects effects_;
  std::vector<Vector3> ray_C_;
  std::vector<float> image_;
};

constexpr auto wall(double depth_m) {
  return [depth_m](int, int) { return depth_m; };
}

double sigma_of(const std::vector<double>& x) {
  double sum = 0.0, squares = 0.0;
  for (const double value : x) {
    sum += value;
    squares += value * value;
  }
  const double mean = sum / static_cast<double>(x.size());
  return std::sqrt(squares / static_cast<double>(x.size()) - mean * mean);
}

double correlation(const std::vector<float>& a, const std::vector<float>& b, double mean) {
  double ab = 0.0, aa = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double x = static_cast<double>(a[i]) - mean, y = static_cast<double>(b[i]) - mean;
    if (std::isnan(x) || std::isnan(y)) continue;
    ab += x * y;
    aa += x * x;
    bb += y * y;
  }
  return ab / std::sqrt(aa * bb);
}

TEST(DepthEffects, TheErrorOfStereoGrowsWithDepthSquaredAsItsOpticsSay) {
  for (const CameraModel model : {CameraModel::kD435, CameraModel::kD455, CameraModel::kOakD}) {
    Studio sut(model, 96, 0.0);
    for (const double depth_m : {1.5, 3.0, 6.0}) {
      std::vector<double> depths_m;
      // Far apart in time, so that steady noise counts as noise.
      for (std::uint32_t n = 0; n < 6; ++n)
        for (const float z : sut.image(100 * n, wall(depth_m)))
          if (!std::isnan(z)) depths_m.push_back(static_cast<double>(z));
      ASSERT_GT(depths_m.size(), 6U * 96U * 80U);
      const double wanted_m = std::sqrt(stereo_of(model)->variance_per_m4()) * depth_m * depth_m;
      EXPECT_NEAR(sigma_of(depths_m) / wanted_m, 1.0, 0.08) << to_string(model) << " at " << depth_m;
    }
  }
  // The D455 of products: 2.4 mm at 1 m, less than the 2 % at 4 m of its data sheet.
  EXPECT_NEAR(std::sqrt(kD455.variance_per_m4()), 0.0024, 0.0001);
  EXPECT_LT(std::sqrt(kD455.variance_per_m4()) * 4.0, 0.02);
}

TEST(DepthEffects, DisparitiesAreMultiplesOfTheSmallestStep) {
  Studio sut(CameraModel::kOakD, 96, 0.0);
  int depths = 0;
  for (const float z : sut.image(1, wall(7.0))) {
    if (std::isnan(z)) continue;
    const double steps = kOakD.focal_px * kOakD.baseline_m / static_cast<double>(z) / kOakD.step_px;
    EXPECT_NEAR(steps, std::round(steps), 1e-4);
    ++depths;
  }
  EXPECT_GT(depths, 8000);
}

TEST(DepthEffects, PatchesHaveTheShareAndTheSizeThatIsAsked) {
  for (const double ratio : {0.05, 0.3}) {
    double holes = 0.0, pixels = 0.0, runs = 0.0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      Studio sut(CameraModel::kD455, 96, ratio, Studio::dark(), seed);
      sut.image(1, wall(5.0));
      for (int v = 0; v < 96; ++v)
        for (int u = 5; u < 96; ++u) {  // what the right camera does not see is no patch
          const bool hole = std::isnan(sut.at(u, v));
          holes += hole ? 1.0 : 0.0;
          runs += hole && !std::isnan(sut.at(u - 1, v)) ? 1.0 : 0.0;
          pixels += 1.0;
        }
    }
    EXPECT_NEAR(holes / pixels, ratio, 0.15 * ratio);
    // Cells of 1 m at 5 m are 9.6 pixels wide; lone pixels would make runs of 1.05 to 1.4.
    EXPECT_GT(holes / runs, 3.5);
    EXPECT_LT(holes / runs, 12.0);
  }
}

TEST(DepthEffects, PatchesStayOnTheirSurface) {
  Studio sut(CameraModel::kD455, 96, 0.3);
  const std::vector<float> first = sut.image(1, wall(5.0)), next = sut.image(2, wall(5.0));
  // One metre to the left is 9.6 pixels: textures go with the wall, and the view of reflections changes.
  const std::vector<float> moved = sut.image(3, wall(5.0), {Matrix3::Identity(), Vector3(0.0, 1.0, 0.0)});
  double both = 0.0, before = 0.0, shifted = 0.0, unshifted = 0.0;
  for (std::size_t v = 0; v < 96; ++v)
    for (std::size_t u = 5; u < 82; ++u) {
      const std::size_t i = v * 96 + u;
      if (!std::isnan(first[i])) continue;
      before += 1.0;
      both += std::isnan(next[i]) ? 1.0 : 0.0;
      shifted += std::isnan(moved[i + 10]) ? 1.0 : 0.0;
      unshifted += std::isnan(moved[i]) ? 1.0 : 0.0;
    }
  EXPECT_GT(both / before, 0.8);
  EXPECT_LT(both / before, 0.99) << "their borders are not the same in two images";
  EXPECT_GT(shifted / before, 0.5);
  EXPECT_LT(unshifted / before, 0.5);
}

TEST(DepthEffects, HalfOfTheNoiseIsThereInTheNextImageAndNoneALittleLater) {
  Studio sut(CameraModel::kD455, 96, 0.0);
  const std::vector<float> first = sut.image(5, wall(4.0)), next = sut.image(6, wall(4.0)),
                           later = sut.image(105, wall(4.0));
  EXPECT_NEAR(correlation(first, next, 4.0), 0.5, 0.06);
  EXPECT_NEAR(correlation(first, later, 4.0), 0.0, 0.05);
}

TEST(DepthEffects, NoiseIsTheSameWithinAMatchingWindow) {
  DepthModel errors = Studio::dark();
  errors.steady_ratio = 1.0;
  Studio sut(CameraModel::kD455, 640, 0.0, errors);
  sut.image(1, wall(4.0));
  // 447 pixels of focal length against 320: a window of 7 is 5 of these.
  EXPECT_EQ(sut.at(300, 300), sut.at(304, 304));
  int same = 0;
  for (int u = 305; u < 600; u += 5) same += sut.at(u, 300) == sut.at(u + 5, 300) ? 1 : 0;
  EXPECT_LT(same, 12);
}

TEST(DepthEffects, FlyingPixelsStandOnlyAtStepsOfDepth) {
  for (const CameraModel model :
       {CameraModel::kD435, CameraModel::kD455, CameraModel::kOakD, CameraModel::kTof}) {
    Studio sut(model, 96, 0.0);
    int flying = 0;
    for (std::uint32_t n = 0; n < 10; ++n) {
      sut.image(n, [](int u, int) { return u < 48 ? 1.2 : 2.4; });
      for (int v = 0; v < 96; ++v)
        for (int u = 0; u < 96; ++u) {
          const float z = sut.at(u, v);
          if (std::isnan(z) || z < 1.35F || z > 2.15F) continue;
          ++flying;
          EXPECT_LE(std::abs(u - 48), 2) << to_string(model);
        }
    }
    EXPECT_GT(flying, 10 * 96 / 10) << to_string(model);
    EXPECT_LT(flying, 10 * 96) << to_string(model);
    // A floor that is seen at a flat angle has no steps.
    sut.image(1, [](int, int v) { return v > 60 ? 1.0 / (1.0 - 2.0 * (v + 0.5) / 96.0) * -0.8 : 2.2; });
    for (int v = 64; v < 96; ++v)
      for (int u = 20; u < 96; ++u) {
        const double true_m = 0.8 / (2.0 * (v + 0.5) / 96.0 - 1.0);
        const float z = sut.at(u, v);
        if (std::isnan(z)) continue;
        EXPECT_NEAR(z, true_m, 0.02 + 0.03 * true_m * true_m) << to_string(model) << " row " << v;
      }
  }
}

TEST(DepthEffects, WhatIsInFrontGrowsByPartOfTheWindow) {
  DepthModel errors = Studio::dark();
  errors.flying_ratio = 0.0;
  for (const int width : {64, 256}) {
    Studio sut(CameraModel::kD455, static_cast<std::uint16_t>(width), 0.0, errors);
    double grown = 0.0;
    constexpr std::uint32_t kImages = 200;
    for (std::uint32_t n = 0; n < kImages; ++n) {
      sut.image(n, [width](int u, int) { return u < width / 2 ? 2.0 : 6.0; });
      for (int u = width / 2; u < width / 2 + 10; ++u) grown += sut.at(u, width / 3) < 3.0F ? 1.0 : 0.0;
    }
    // A quarter of the window of 7 pixels, in pixels of this image.
    EXPECT_NEAR(grown / kImages, 0.25 * 7.0 / (447.0 / (0.5 * width)), 0.1) << width;
  }
}

TEST(DepthEffects, BesideWhatIsInFrontTheRightCameraSeesNothing) {
  DepthModel errors = Studio::dark();
  errors.flying_ratio = 0.0;
  errors.fatten_ratio = 0.0;
  Studio sut(CameraModel::kD455, 640, 0.0, errors);
  sut.image(1, [](int u, int) { return u < 320 ? 6.0 : 2.0; });
  int hidden = 0, left = 0;
  for (int u = 100; u < 640; ++u) hidden += std::isnan(sut.at(u, 300)) ? 1 : 0;
  for (int u = 0; u < 100; ++u) left += std::isnan(sut.at(u, 300)) ? 1 : 0;
  const double native = 447.0 / 320.0, fb = 447.0 * 0.095;
  EXPECT_NEAR(hidden, (fb / 2.0 - fb / 6.0) / native, 1.5);
  EXPECT_TRUE(std::isnan(sut.at(318, 300)));
  EXPECT_FALSE(std::isnan(sut.at(321, 300)));
  EXPECT_NEAR(left, fb / 6.0 / native, 1.5) << "and nothing at the left border";
}

TEST(DepthEffects, NoValueOnSkyNorTooNearButBeyondTheRangeWhileThereIsDisparity) {
  Studio sut(CameraModel::kD455, 96, 0.0);
  for (const float z : sut.image(1, wall(kInfinity))) EXPECT_TRUE(std::isnan(z));
  for (const float z : sut.image(1, wall(0.3))) EXPECT_TRUE(std::isnan(z)) << "126 pixels are 0.337 m";
  sut.image(1, wall(0.36));
  EXPECT_NEAR(sut.at(60, 40), 0.36, 0.01);
  sut.image(1, wall(20.0));
  EXPECT_GT(sut.at(60, 40), 14.0F) << "nothing within its 10 m";
  EXPECT_NEAR(sut.effects().reach_m(), 42.5, 0.1);
}

TEST(DepthEffects, TheSunBlindsWhatIsBesideIt) {
  DepthModel errors;
  errors.sun_elevation_deg = 0.0;
  Studio sut(CameraModel::kD455, 96, 0.0, errors);
  // All round: the sun is in one of four images, and is as large as it should be.
  int blind = 0;
  for (const Vector3& ahead : {Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(-1, 0, 0), Vector3(0, -1, 0)}) {
    Matrix3 R_WC;
    R_WC << ahead.x(), -ahead.y(), 0, ahead.y(), ahead.x(), 0, 0, 0, 1;
    sut.image(1, wall(4.0), {R_WC, Vector3::Zero()});
    for (int v = 0; v < 96; ++v)
      for (int u = 5; u < 96; ++u) blind += std::isnan(sut.at(u, v)) ? 1 : 0;
  }
  const double radius_px = std::tan(8.0 * core::kPi / 180.0) * 48.0;
  EXPECT_GT(blind, 0.5 * core::kPi * radius_px * radius_px);
  EXPECT_LT(blind, 3.0 * core::kPi * radius_px * radius_px);
}

TEST(DepthEffects, TimeOfFlightSeesAsFarAsItsLightComesBack) {
  Studio sut(CameraModel::kTof, 96, 0.0);
  double least = 2.0;
  for (const double depth_m : {1.0, 4.0, 7.0, 11.0}) {
    double valid = 0.0;
    std::vector<double> depths_m;
    for (const float z : sut.image(1, wall(depth_m))) {
      if (std::isnan(z)) continue;
      valid += 1.0 / (96.0 * 96.0);
      depths_m.push_back(static_cast<double>(z));
    }
    EXPECT_LT(valid, least - (depth_m > 3.0 ? 0.05 : 0.0)) << depth_m;
    least = valid;
    if (valid < 0.05) continue;
    const double added_m = 0.0012 * depth_m * depth_m;
    EXPECT_NEAR(sigma_of(depths_m), 0.002 + added_m, 0.1 * added_m + 4e-4);
  }
  EXPECT_EQ(least, 0.0) << "80 % of the light at 11 m is less than 10 % at 3.5 m";
}

TEST(DepthEffects, AnImageDependsOnNothingButSeedCameraTimeAndPlace) {
  for (const CameraModel model : {CameraModel::kD455, CameraModel::kTof}) {
    Studio one(model, 64, 0.2), other(model, 64, 0.2), seeded(model, 64, 0.2, Studio::dark(), 4);
    const auto scene = [](int u, int v) { return (u / 8 + v / 8) % 2 == 0 ? 2.0 : 3.0; };
    for (std::uint32_t n = 0; n < 5; ++n) one.image(n, wall(1.0 + n));
    const std::vector<float> a = one.image(7, scene), b = other.image(7, scene), c = seeded.image(7, scene);
    int different = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      ASSERT_TRUE(a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i])));
      different += a[i] != c[i] && !(std::isnan(a[i]) && std::isnan(c[i])) ? 1 : 0;
    }
    EXPECT_GT(different, 2000);
  }
}

TEST(DepthEffects, TheMountIsALittleWrong) {
  double squares_rad2 = 0.0, squares_m2 = 0.0;
  constexpr int kSeeds = 300;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const DepthEffects sut(Studio::spec_of(CameraModel::kD455, 16, 0.1), seed, 0);
    const Pose X_CE = sut.true_pose({});
    squares_rad2 += Eigen::AngleAxisd(X_CE.R_RT).angle() * Eigen::AngleAxisd(X_CE.R_RT).angle();
    squares_m2 += X_CE.p_RT.squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares_rad2 / 3.0 / kSeeds) * 180.0 / core::kPi, 0.2, 0.02);
  EXPECT_NEAR(std::sqrt(squares_m2 / 3.0 / kSeeds), 0.003, 0.0003);
}

WorldDescription boxed() {
  WorldDescription d;
  d.bounds_W = {{-50.0, -50.0, 0.5}, {50.0, 50.0, 15.0}};
  d.start_W = {0.0, 0.0, 5.0};
  d.goal_W = {5.0, 0.0, 5.0};
  d.boxes = {{{8.0, -40.0, 0.0}, {9.0, 40.0, 40.0}}, {{4.0, -0.5, 0.0}, {4.5, 0.5, 20.0}}};
  return d;
}

TEST(ProductCamera, LooksFromItsTruePlaceAndSaysItsOwnTime) {
  const World world(boxed());
  CameraSpec spec = Studio::spec_of(CameraModel::kD455, 48, 0.1);
  spec.rate_Hz = 20.0;
  SimulatedDepthCamera sut(world, spec, six_camera_mounts()[0], DepthNoise{}, 5, 0);
  const Pose at_5m{Matrix3::Identity(), Vector3(0.0, 0.0, 5.0)};
  firmware_if::DepthFrame frame;
  double sum_s = 0.0, squares_s2 = 0.0, latency_s = 0.0;
  int frames = 0, lone = 0;
  for (int k = 0; k < 400 * 60; ++k) {
    const MonotonicTime now = MonotonicTime{} + (k + 40) * Nanos{2'500'000};
    sut.expose(now, at_5m);
    const test::NoAllocScope scope;
    if (sut.read(frame) != Status::kOk) continue;
    ASSERT_EQ(scope.count(), 0U);
    // Looks are taken at multiples of 50 ms.
    const double true_s = 0.1 + 0.05 * (frame.sequence - 1);
    const double error_s = seconds(frame.stamp.time_since_epoch()) - true_s;
    EXPECT_LE(frame.stamp, now);
    sum_s += error_s;
    squares_s2 += error_s * error_s;
    latency_s += seconds(now.time_since_epoch()) - true_s;
    ++frames;
    for (const float z : frame.depth_m) lone += z > 20.0F ? 1 : 0;
  }
  ASSERT_GT(frames, 1000);
  const double mean_s = sum_s / frames;
  EXPECT_NE(mean_s, 0.0);
  EXPECT_LT(std::fabs(mean_s), 0.009);
  EXPECT_NEAR(std::sqrt(squares_s2 / frames - mean_s * mean_s), 0.001, 0.0002);
  EXPECT_NEAR(latency_s / frames, 0.030 + 0.005 + 0.00125, 0.002)
      << "least latency, what comes on top, and half a frame";
  EXPECT_EQ(lone, 0);
}

}  // namespace
}  // namespace roborun::sitl
