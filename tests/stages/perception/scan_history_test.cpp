#include "stages/perception/scan_history.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "tests/stages/perception/scene.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

constexpr int kPixels = 64;

MonotonicTime at_s(double time_s) { return MonotonicTime{from_seconds(time_s)}; }

/// A wall at x = 10, seen from the origin by six cameras.
class Scans : public ::testing::Test {
 protected:
  Scans() { wall_.solid.push_back({Vector3(10, -50, -50), Vector3(11, 50, 50)}); }

  void scan(double time_s) {
    if (!history_.begin(at_s(time_s))) return;
    for (const PosedDepthFrame& frame : wall_.look(Vector3::Zero(), kPixels))
      history_.add(frame, frame.frame);
    history_.set_complete(true);
  }
  [[nodiscard]] bool saw_through(double time_s, const Vector3& p_W) const {
    const std::array<Vector3, 1> center_W{p_W};
    return history_.saw_through(at_s(time_s), center_W) == 1U;
  }

  test::Scene wall_;
  std::vector<std::byte> memory_ = std::vector<std::byte>(ScanHistory::arena_bytes(6, kPixels, kPixels));
  core::Arena arena_{memory_};
  ScanHistory history_{arena_, 6, kPixels, kPixels};
};

TEST_F(Scans, SawThroughWhatLiesBeforeASurface) {
  scan(1.0);
  ASSERT_FALSE(arena_.exhausted());
  EXPECT_TRUE(saw_through(1.5, {9, 0.3, 0.2}));
  EXPECT_FALSE(saw_through(1.5, {9.95, 0.3, 0.2})) << "on the surface";
  EXPECT_FALSE(saw_through(1.5, {10.5, 0.3, 0.2}));
  EXPECT_FALSE(saw_through(1.5, {12, 0.3, 0.2})) << "behind it";
  const std::array<Vector3, 3> center_W{Vector3(12, 0, 0), Vector3(5, 1, 1), Vector3(8, -3, 0)};
  EXPECT_EQ(history_.saw_through(at_s(1.5), center_W), 0b110U);
}

TEST_F(Scans, TellNothingWhenTooYoungTooOldOrForgotten) {
  EXPECT_FALSE(saw_through(1.0, {9, 0, 0})) << "no scan yet";
  scan(1.0);
  EXPECT_FALSE(saw_through(1.2, {9, 0, 0}));
  EXPECT_TRUE(saw_through(1.3, {9, 0, 0}));
  EXPECT_TRUE(saw_through(2.9, {9, 0, 0}));
  EXPECT_FALSE(saw_through(3.1, {9, 0, 0}));
  history_.forget();
  EXPECT_FALSE(saw_through(1.3, {9, 0, 0}));
}

TEST_F(Scans, KeepOneThatIsOldEnoughHoweverFastTheyCome) {
  scan(0.0);
  for (double t = 0.02; t < 6.0; t += 0.02) {
    EXPECT_EQ(saw_through(t, {9, 0, 0}), t > 0.249) << t;
    scan(t);
  }
}

TEST_F(Scans, KeepOneThatIsOldEnoughHoweverSlowlyTheyCome) {
  scan(0.0);
  for (double t = 1.5; t < 9.0; t += 1.5) {
    EXPECT_TRUE(saw_through(t, {9, 0, 0})) << t;
    scan(t);
  }
}

TEST_F(Scans, KeepOfLargeImagesTheirTiles) {
  std::vector<std::byte> memory(ScanHistory::arena_bytes(6, 640, 640));
  core::Arena arena(memory);
  ScanHistory large(arena, 6, 640, 640);
  ASSERT_FALSE(arena.exhausted());
  EXPECT_LT(memory.size(), 6 * DepthPyramid::arena_bytes(640, 640) / 4);
  ASSERT_TRUE(large.begin(at_s(1.0)));
  for (const PosedDepthFrame& frame : wall_.look(Vector3::Zero(), 640)) large.add(frame, frame.frame);
  large.set_complete(true);
  const std::array<Vector3, 2> center_W{Vector3(9, 0.3, 0.2), Vector3(12, 0.3, 0.2)};
  EXPECT_EQ(large.saw_through(at_s(1.5), center_W), 1U);
}

TEST_F(Scans, SawThroughWhereOneOfThemDid) {
  scan(1.0);
  wall_.solid[0] = {Vector3(6, -50, -50), Vector3(7, 50, 50)};  // it came nearer
  scan(1.6);
  EXPECT_TRUE(saw_through(2.0, {9, 0, 0}));
  EXPECT_TRUE(saw_through(2.0, {5, 0, 0}));
  const test::NoAllocScope scope;
  EXPECT_FALSE(saw_through(2.0, {11, 0, 0}));
  EXPECT_EQ(scope.count(), 0U);
}

/// A point stands in the middle of its pixel, the surface that it was seen on anywhere in it: beside a post is not yet seen through.
TEST_F(Scans, SawThroughWhatLiesAPixelBesideAnEdge) {
  wall_.solid[0] = {Vector3(10, -0.5, -50), Vector3(10.5, 0.5, 50)};
  scan(1.0);
  const double pixel_m = 10.0 * 2.0 / kPixels;
  const double side_m = 0.5 + 0.5 * ScanHistory::kCube_m;
  EXPECT_FALSE(saw_through(1.5, {10.2, side_m + 0.6 * pixel_m, 0}));
  EXPECT_TRUE(saw_through(1.5, {10.2, side_m + 1.6 * pixel_m, 0}));
}

}  // namespace
}  // namespace roborun::stages
