#include "stages/perception/swept_ball.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random/counter_rng.hpp"
#include "tests/support/box_view.hpp"

namespace roborun::stages {
namespace {

constexpr double kCell_m = 0.3;

/// Cells of which some are not free, by their place.
class SpottedView final : public MapView {
 public:
  explicit SpottedView(double share, std::uint64_t seed) : share_(share), seed_(seed) {}
  [[nodiscard]] bool is_spot(double x, double y, double z) const {
    core::CounterRng rng(seed_, static_cast<std::uint64_t>((x + 1e3) + 1e4 * (y + 1e3) + 1e8 * (z + 1e3)));
    return rng.uniform() < share_;
  }
  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    const auto first = [](double m) { return std::floor(m / kCell_m); };
    for (double z = first(box_W.min_W.z()); z <= first(box_W.max_W.z()); ++z)
      for (double y = first(box_W.min_W.y()); y <= first(box_W.max_W.y()); ++y)
        for (double x = first(box_W.min_W.x()); x <= first(box_W.max_W.x()); ++x) {
          ++lookups;
          if (is_spot(x, y, z)) return false;
        }
    return true;
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return is_free(box_W, lookups);
  }
  [[nodiscard]] CellState at(const Vector3&, std::uint64_t&) const noexcept override {
    return CellState::kUnknown;
  }
  [[nodiscard]] double cell_m() const noexcept override { return kCell_m; }

 private:
  double share_;
  std::uint64_t seed_;
};

/// Distance from the piece to the nearest cell that is not free, by samples 1 mm apart.
double sampled_m(const SpottedView& view, const Vector3& a_W, const Vector3& b_W, double reach_m) {
  double least_m = std::numeric_limits<double>::infinity();
  const int samples = 1 + static_cast<int>((b_W - a_W).norm() / 1e-3);
  const Vector3 low = a_W.cwiseMin(b_W) - Vector3::Constant(reach_m);
  const Vector3 high = a_W.cwiseMax(b_W) + Vector3::Constant(reach_m);
  const auto first = [](double m) { return std::floor(m / kCell_m); };
  for (double z = first(low.z()); z <= first(high.z()); ++z)
    for (double y = first(low.y()); y <= first(high.y()); ++y)
      for (double x = first(low.x()); x <= first(high.x()); ++x) {
        if (!view.is_spot(x, y, z)) continue;
        const Vector3 corner = kCell_m * Vector3(x, y, z);
        for (int i = 0; i <= samples; ++i) {
          const Vector3 p_W = a_W + static_cast<double>(i) / samples * (b_W - a_W);
          const Vector3 nearest = p_W.cwiseMax(corner).cwiseMin(corner + Vector3::Constant(kCell_m));
          least_m = std::fmin(least_m, (p_W - nearest).norm());
        }
      }
  return least_m;
}

TEST(SweptBall, AgreesWithTheDistanceToEveryCell) {
  constexpr double kTolerance_m = 2e-3;  // of the samples
  core::CounterRng rng(4, 1);
  int free = 0, blocked = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const SpottedView view(0.004, i);
    const double radius_m = rng.uniform(0.2, 1.0);
    const Vector3 a_W(rng.uniform(-9.0, 9.0), rng.uniform(-9.0, 9.0), rng.uniform(-9.0, 9.0));
    const Vector3 b_W =
        a_W + radius_m * Vector3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    const double least_m = sampled_m(view, a_W, b_W, radius_m + 0.1);
    std::uint64_t lookups = 0;
    const bool answer = is_swept_free(view, a_W, b_W, radius_m, lookups);
    ++(answer ? free : blocked);
    if (answer) {
      EXPECT_GE(least_m, radius_m - kTolerance_m) << i;
    } else {
      EXPECT_LT(least_m, radius_m + kTolerance_m) << i;
    }
  }
  EXPECT_GT(free, 50);
  EXPECT_GT(blocked, 50);
}

TEST(SweptBall, PassesBetweenCornersWhereItsBoxDoesNot) {
  // Two blocks, from corner to corner 2.55 m: the ball has 0.37 m to spare on both sides, its box touches both.
  test::BoxView view;
  view.free_W = Aabb::around(Vector3::Zero(), 20.0);
  const double corner_m = 3.0 * kCell_m;
  view.occupied = {{{corner_m, -9.0, -9.0}, {9.0, -corner_m, 9.0}},
                   {{-9.0, corner_m, -9.0}, {-corner_m, 9.0, 9.0}}};
  const Vector3 a_W(-0.5, -0.5, 0.0), b_W(0.5, 0.5, 0.0);
  std::uint64_t lookups = 0;
  EXPECT_FALSE(view.is_free(Aabb::around(Vector3::Zero(), 0.9), lookups));
  EXPECT_TRUE(is_swept_free(view, a_W, b_W, 0.9, lookups));
  EXPECT_FALSE(is_swept_free(view, a_W, b_W, std::sqrt(2.0) * corner_m + 0.001, lookups));
}

TEST(SweptBall, WhatIsUnknownOrNoPlaceIsNotFree) {
  test::BoxView view;
  view.free_W = {{-3.0, -3.0, -3.0}, {3.0, 3.0, 3.0}};
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::uint64_t lookups = 0;
  EXPECT_TRUE(is_ball_free(view, Vector3::Zero(), 1.0, lookups));
  EXPECT_FALSE(is_ball_free(view, {2.5, 0.0, 0.0}, 1.0, lookups));
  for (const double bad : {kNan, kInf, -kInf}) {
    EXPECT_FALSE(is_ball_free(view, {0.0, bad, 0.0}, 1.0, lookups));
    EXPECT_FALSE(is_swept_free(view, Vector3::Zero(), {0.0, bad, 0.0}, 1.0, lookups));
    EXPECT_FALSE(is_ball_free(view, Vector3::Zero(), bad, lookups));
  }
  EXPECT_FALSE(is_ball_free(view, {9.0, 0.0, 0.0}, -1.0, lookups));
}

TEST(SweptBall, AsksForABoundedNumberOfBoxes) {
  // Spots in the corners of the box, where they are beside the ball, and cells that are small for it.
  test::BoxView view;
  view.free_W = Aabb::around(Vector3::Zero(), 100.0);
  for (const double x : {-29.9, 29.9})
    for (const double y : {-29.9, 29.9})
      for (double z = -29.9; z < 30.0; z += 0.6) view.occupied.push_back(Aabb::around({x, y, z}, 0.05));
  std::uint64_t lookups = 0;
  (void)is_ball_free(view, Vector3::Zero(), 30.0, lookups);
  EXPECT_LE(lookups, static_cast<std::uint64_t>(kMostBoxes) + 4);
}

}  // namespace
}  // namespace roborun::stages
