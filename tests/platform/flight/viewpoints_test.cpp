#include "platform/flight/viewpoints.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "stages/perception/swept_ball.hpp"
#include "tests/support/box_view.hpp"

namespace roborun::flight {
namespace {

constexpr double kRadius_m = 0.45;

/// A room of 20 m whose wall at x = 5 .. 5.6 m has an opening of 1.2 m in the middle; what `unknown_W` covers is not known.
class Scene final : public stages::MapView {
 public:
  Scene() {
    free_.free_W = {{-10.0, -10.0, 0.0}, {10.0, 10.0, 6.0}};
    free_.occupied = {{{5.0, -10.0, 0.0}, {5.6, -0.6, 6.0}},
                      {{5.0, 0.6, 0.0}, {5.6, 10.0, 6.0}},
                      {{5.0, -0.6, 0.0}, {5.6, 0.6, 2.4}},
                      {{5.0, -0.6, 3.6}, {5.6, 0.6, 6.0}}};
  }
  Aabb unknown_W{Vector3::Constant(100.0), Vector3::Constant(101.0)};

  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    const bool meets = (box_W.min_W.array() <= unknown_W.max_W.array()).all() &&
                       (box_W.max_W.array() >= unknown_W.min_W.array()).all();
    return !meets && free_.is_free(box_W, lookups);
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return is_free(box_W, lookups);
  }
  [[nodiscard]] stages::CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    const stages::CellState state = free_.at(p_W, lookups);
    return state == stages::CellState::kFree && unknown_W.contains(p_W) ? stages::CellState::kUnknown : state;
  }
  [[nodiscard]] double cell_m() const noexcept override { return 0.1; }

 private:
  test::BoxView free_;
};

class Budget final : public core::StageBudget {
 public:
  std::uint64_t most{100'000'000};
  [[nodiscard]] bool spent(const core::Work& done) noexcept override { return done.units >= most; }
};

class ViewpointsTest : public testing::Test {
 protected:
  std::optional<Vector3> next() {
    const stages::PolledView view(scene_, budget_, work_);
    return sut_.next(view, {place_W_, kRadius_m, view_ratio_, bounds_W_}, work_.units);
  }

  Scene scene_;
  Budget budget_;
  core::Work work_;
  Vector3 place_W_{4.2, 0.0, 3.0};
  double view_ratio_{1.0};
  Aabb bounds_W_{{-9.0, -9.0, 1.0}, {5.0, 9.0, 5.0}};  // on this side of the wall
  Viewpoints sut_;
};

TEST_F(ViewpointsTest, WhatAJambHidesIsSeenFromTheOtherSide) {
  for (const double side : {-1.0, 1.0}) {
    sut_ = {};
    // At the far end of the jamb at y = 0.6 side.
    scene_.unknown_W = {{5.4, side > 0.0 ? 0.45 : -0.6, 2.4}, {5.6, side > 0.0 ? 0.6 : -0.45, 3.6}};
    const auto p_W = next();
    ASSERT_TRUE(p_W.has_value());
    EXPECT_LT(side * p_W->y(), 0.6);  // from beyond it the jamb is in between
    EXPECT_TRUE(stages::is_ball_free(scene_, *p_W, kRadius_m, work_.units));
  }
}

TEST_F(ViewpointsTest, WhatASillHidesIsSeenFromWhereTheCameraIsLevelWithIt) {
  scene_.unknown_W = {{5.0, -0.6, 2.4}, {5.6, 0.6, 2.6}};
  view_ratio_ = 0.1;
  const auto p_W = next();
  ASSERT_TRUE(p_W.has_value());
  EXPECT_NEAR(p_W->z(), 2.5, 0.6);
}

TEST_F(ViewpointsTest, LooksAgainFromOtherSides) {
  scene_.unknown_W = {{5.0, -0.6, 2.4}, {5.6, 0.6, 3.6}};
  const Vector3 middle_W{5.0, 0.0, 3.0};
  std::vector<Vector3> ways;
  for (std::size_t k = 0; k < Viewpoints::kRemembered; ++k) {
    const auto p_W = next();
    ASSERT_TRUE(p_W.has_value()) << k;
    EXPECT_TRUE(bounds_W_.contains(*p_W));
    ways.push_back((middle_W - *p_W).normalized());
    for (std::size_t i = 0; i < k; ++i) EXPECT_LT(ways[i].dot(ways[k]), 0.98) << i << ' ' << k;
  }
}

TEST_F(ViewpointsTest, WhereNoOtherSideIsLeftThereIsNone) {
  scene_.unknown_W = {{5.0, -0.6, 2.4}, {5.6, 0.6, 3.6}};
  bounds_W_ = {{2.0, -0.3, 2.7}, {5.0, 0.3, 3.3}};  // a corridor
  EXPECT_TRUE(next().has_value());
  EXPECT_FALSE(next().has_value());
  // Another place far from the first one.
  scene_.unknown_W = {{0.0, -9.0, 2.0}, {1.0, -8.0, 4.0}};
  bounds_W_ = {{-9.0, -9.0, 1.0}, {5.0, 9.0, 5.0}};
  place_W_ = {0.5, -7.0, 3.0};
  EXPECT_TRUE(next().has_value());
}

TEST_F(ViewpointsTest, WhereAllIsKnownThereIsNone) { EXPECT_FALSE(next().has_value()); }

TEST_F(ViewpointsTest, EndsWithTheBudget) {
  scene_.unknown_W = {{5.0, -0.6, 2.4}, {5.6, 0.6, 3.6}};
  budget_.most = 1000;
  EXPECT_FALSE(next().has_value());
  EXPECT_LT(work_.units, 20'000U);
}

}  // namespace
}  // namespace roborun::flight
