#include "stages/planning/way_out.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/box_view.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

class WayOutTest : public ::testing::Test {
 protected:
  WayOutTest() {
    view_.free_W = {Vector3(-25, -25, 0), Vector3(25, 25, 12)};
    request_.start_W = Vector3(0, 0, 5);
    request_.bounds_W = {Vector3(-20, -20, 1.5), Vector3(20, 20, 10)};
    request_.limits = {0.5, 4.0, 20.0, 6.0, 6.0};
    request_.body_m = 0.6;
    request_.room_m = 0.9;
  }
  void box(double x0, double y0, double x1, double y1) {
    view_.occupied.push_back({Vector3(x0, y0, 0), Vector3(x1, y1, 20)});
  }
  bool leaves() { return find_way_out(request_, view_, view_, unlimited_, work_, out_); }
  /// Of the vehicle from all that is occupied, at its nearest.
  [[nodiscard]] double nearest_m(double from_s) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (double at_s = from_s; at_s <= out_.duration_s(); at_s += 0.01) {
      const Vector3 p_W = out_.at_s(at_s).p_W;
      for (const Aabb& o : view_.occupied)
        nearest = std::fmin(nearest, (p_W - p_W.cwiseMax(o.min_W).cwiseMin(o.max_W)).norm());
    }
    return nearest;
  }
  test::BoxView view_;
  WayOutRequest request_;
  core::UnlimitedBudget unlimited_;
  core::Work work_;
  Trajectory out_;
};

TEST_F(WayOutTest, LeadsStraightAndSlowlyToTheNearestPlaceWithRoom) {
  box(0.7, -20, 1.5, 20);  // 0.7 m away, 0.9 are wanted
  ASSERT_TRUE(leaves());
  EXPECT_TRUE(out_.end_W().isApprox(Vector3(-0.3, 0, 5))) << out_.end_W().transpose();
  EXPECT_GE(nearest_m(0.0), 0.7 - 1e-9);
  for (double at_s = 0.0; at_s < out_.duration_s(); at_s += 0.01) EXPECT_LE(out_.at_s(at_s).v_W.norm(), 0.51);
}

TEST_F(WayOutTest, LeavesASurfaceThatTheVehiclesOwnBoxTouches) {
  // Where a pillar was noted in a forest: 3 cm inside a corner of the vehicle's box, 6 cm outside its radius.
  box(0.57, 0.3, 1.5, 1.5);
  ASSERT_FALSE(view_.is_free(Aabb::around(request_.start_W, request_.body_m), work_.units));
  ASSERT_TRUE(leaves());
  EXPECT_LT(out_.end_W().x() + out_.end_W().y(), 0.0);
  EXPECT_GE(nearest_m(0.0), std::hypot(0.57, 0.3) - 1e-9) << "it comes no nearer";
  // The same deep inside the radius: straight away from it, nowhere along it.
  view_.occupied.clear();
  box(0.4, -3, 1.5, 3);
  ASSERT_TRUE(leaves());
  EXPECT_TRUE(out_.end_W().isApprox(Vector3(-0.6, 0, 5))) << out_.end_W().transpose();
  EXPECT_GE(nearest_m(0.0), 0.4 - 1e-9);
}

TEST_F(WayOutTest, FindsRoomThatIsNarrowerThanACell) {
  box(-3, 0.85, 3, 2);
  box(-3, -2, 3, -1.1);  // 1.95 m between them, 1.8 are wanted
  ASSERT_TRUE(leaves());
  EXPECT_TRUE(out_.end_W().isApprox(Vector3(0, -0.1, 5))) << out_.end_W().transpose();
}

TEST_F(WayOutTest, GoesAsideFirstWhereItIsTooNearForTheWayOut) {
  box(-1, 0.92, 1, 2);
  box(-1, -2, 1, -0.59);  // 1 cm inside the vehicle: on the way out of the slot it would come nearer
  ASSERT_TRUE(leaves());
  EXPECT_TRUE(out_.end_W().isApprox(Vector3(0, 0.1, 5))) << out_.end_W().transpose();
  EXPECT_GE(nearest_m(0.0), 0.59 - 1e-9);
  request_.start_W = out_.end_W();
  ASSERT_TRUE(leaves());
  EXPECT_GE(std::fabs(out_.end_W().x()), 1.5);
  EXPECT_GE(nearest_m(0.0), 0.6);
  view_.occupied.back().max_W.y() = -0.2;  // 1.12 m between them: nowhere is there room for its radius
  request_.start_W = Vector3(0, 0, 5);
  EXPECT_FALSE(leaves());
}

TEST_F(WayOutTest, NeverThroughWhatIsOccupiedOrUnknownWithTheVehiclesRadius) {
  // Room behind a gap that is narrower than the vehicle.
  box(-0.7, -20, -0.65, -0.5), box(-0.7, 0.5, -0.65, 20);
  box(0.65, -20, 0.7, 20), box(-20, 0.65, 20, 0.7), box(-20, -0.7, 20, -0.65);
  EXPECT_FALSE(leaves());
  view_.occupied.clear();
  view_.free_W = {Vector3(-0.7, -0.7, 4.3), Vector3(0.7, 0.7, 5.7)};
  EXPECT_FALSE(leaves()) << "nothing is known around it";
  EXPECT_EQ(out_.segment_count, 0U);
}

TEST_F(WayOutTest, StaysInsideTheBoundsAndTheBudget) {
  class None final : public core::StageBudget {
   public:
    [[nodiscard]] bool spent(const core::Work&) noexcept override { return true; }
  } none;
  box(0.7, -20, 1.5, 20);
  EXPECT_FALSE(find_way_out(request_, view_, view_, none, work_, out_));
  request_.bounds_W.min_W.x() = -0.05;
  EXPECT_FALSE(leaves());
}

TEST_F(WayOutTest, DoesNotAllocate) {
  box(0.4, -20, 1.5, 20);
  const test::NoAllocScope scope;
  (void)leaves();
  EXPECT_EQ(scope.count(), 0U);
}

TEST(StandingView, FreesWhereTheVehicleStandsAndNothingElse) {
  test::BoxView map;
  map.free_W = {Vector3(-5, -5, 0), Vector3(5, 5, 10)};
  map.occupied = {{Vector3(0.9, -0.5, 4.5), Vector3(1.5, 0.5, 5.5)}};
  const StandingView sut(map, Aabb::around(Vector3(0, 0, 5), 1.0));
  std::uint64_t lookups = 0;
  const auto is_free = [&](double x, double half_m) {
    return sut.is_free(Aabb::around(Vector3(x, 0, 5), half_m), lookups);
  };
  EXPECT_TRUE(is_free(0, 1.0));
  EXPECT_TRUE(is_free(-0.5, 1.0)) << "away from what it touches";
  EXPECT_FALSE(is_free(0.01, 1.0)) << "deeper into it";
  EXPECT_FALSE(is_free(1.2, 0.1));
  EXPECT_FALSE(is_free(-4.5, 1.0)) << "unknown";
  EXPECT_FALSE(is_free(std::nan(""), 1.0));
  EXPECT_FALSE(sut.is_free({Vector3(1, 0, 5), Vector3(0, 1, 6)}, lookups)) << "inside out";
}

}  // namespace
}  // namespace roborun::stages
