#include "platform/flight/surface_middle.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace roborun::flight {
namespace {

/// Points every 0.2 m along y, from `from_m` to `to_m`, 5 m ahead.
std::vector<stages::CloudPoint> row(double from_m, double to_m) {
  std::vector<stages::CloudPoint> points;
  for (double y_m = from_m; y_m <= to_m + 1e-9; y_m += 0.2) points.push_back({{5.0, y_m, 3.0}, 1});
  return points;
}

TEST(SurfaceMiddle, IsThatOfWhatStandsApartThoughItsEdgeWasSeenFirst) {
  const auto body = row(-0.4, 0.4);
  for (const double seen_m : {-0.4, 0.0, 0.4}) {
    const auto middle_W = surface_middle_W({5.0, seen_m, 3.0}, body);
    ASSERT_TRUE(middle_W.has_value()) << seen_m;
    EXPECT_NEAR(middle_W->y(), 0.0, 1e-9) << seen_m;
  }
}

TEST(SurfaceMiddle, OfAWallThatGoesOnAroundItIsNowhere) {
  EXPECT_FALSE(surface_middle_W({5.0, 0.0, 3.0}, row(-3.0, 3.0)).has_value());
}

TEST(SurfaceMiddle, OneOfFourPointsMayLieAround) {
  auto points = row(-0.4, 0.4);  // five
  points.push_back({{5.0, 1.2, 3.0}, 1});
  EXPECT_TRUE(surface_middle_W({5.0, 0.0, 3.0}, points).has_value());
  points.push_back({{5.0, -1.2, 3.0}, 1});
  EXPECT_FALSE(surface_middle_W({5.0, 0.0, 3.0}, points).has_value());
  points.back().p_W.y() = -1.8;  // too far off to be the same surface
  EXPECT_TRUE(surface_middle_W({5.0, 0.0, 3.0}, points).has_value());
}

TEST(SurfaceMiddle, OfTwoPointsIsNowhere) {
  EXPECT_FALSE(surface_middle_W({5.0, 0.0, 3.0}, row(0.0, 0.2)).has_value());
  EXPECT_TRUE(surface_middle_W({5.0, 0.0, 3.0}, row(-0.2, 0.2)).has_value());
  EXPECT_FALSE(surface_middle_W({5.0, 0.0, 3.0}, {}).has_value());
}

}  // namespace
}  // namespace roborun::flight
