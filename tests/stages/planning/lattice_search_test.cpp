#include "stages/planning/lattice_search.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/box_view.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

class LatticeSearchTest : public ::testing::Test {
 protected:
  LatticeSearchTest() {
    view_.free_W = {Vector3(-12, -24, 0), Vector3(52, 24, 12)};
    request_.start_W = Vector3(0, 0, 5);
    request_.goal_W = Vector3(40, 0, 5);
    request_.bounds_W = {Vector3(-10, -20, 1.5), Vector3(50, 20, 10)};
    request_.radius_m = 0.9;
    request_.horizon_m = 100.0;
  }
  /// A wall across everything at x, but for an opening.
  void wall(double x, double y0, double y1, double z0 = 0.0, double z1 = 20.0) {
    view_.occupied.push_back({Vector3(x, -30, 0), Vector3(x + 0.6, y0, 20)});
    view_.occupied.push_back({Vector3(x, y1, 0), Vector3(x + 0.6, 30, 20)});
    view_.occupied.push_back({Vector3(x, y0, 0), Vector3(x + 0.6, y1, z0)});
    view_.occupied.push_back({Vector3(x, y0, z1), Vector3(x + 0.6, y1, 20)});
  }
  Status connect() { return sut_.connect(request_, view_, unlimited_, work_, path_W_); }
  void expect_way() {
    ASSERT_GE(path_W_.size(), 2U);
    EXPECT_EQ(path_W_[0], request_.start_W);
    EXPECT_EQ(path_W_.back(), request_.goal_W);
    std::uint64_t lookups = 0;
    for (std::size_t i = 0; i + 1 < path_W_.size(); ++i)
      EXPECT_TRUE(is_segment_free(view_, path_W_[i], path_W_[i + 1], request_.radius_m, lookups)) << i;
  }
  std::vector<std::byte> block_ = std::vector<std::byte>(LatticeSearch::arena_bytes(1U << 20U));
  core::Arena arena_{block_};
  LatticeSearch sut_{1U << 20U, arena_};
  test::BoxView view_;
  PlanRequest request_;
  core::UnlimitedBudget unlimited_;
  core::Work work_;
  Path path_W_;
};

TEST_F(LatticeSearchTest, FindsASlotThatIsOneCellWiderThanTheVehicle) {
  wall(20, 9.0, 11.4);
  ASSERT_EQ(connect(), Status::kOk);
  expect_way();
}

TEST_F(LatticeSearchTest, FindsAWindow) {
  wall(12, -14.1, -11.7, 6.0, 8.4);
  wall(24, 9.0, 11.4, 3.0, 5.4);
  ASSERT_EQ(connect(), Status::kOk);
  expect_way();
}

TEST_F(LatticeSearchTest, FindsAGapOnASlantThatNoBoxFitsInto) {
  request_.radius_m = 0.8;
  view_.occupied.push_back({Vector3(20.1, -30, 0), Vector3(20.7, 0, 20)});
  view_.occupied.push_back({Vector3(22.2, 1.2, 0), Vector3(22.8, 30, 20)});
  ASSERT_EQ(connect(), Status::kOk);
  expect_way();
  view_.occupied[0].max_W.y() = 0.9;
  EXPECT_EQ(connect(), Status::kNoPath);
}

TEST_F(LatticeSearchTest, SaysThatThereIsNoWay) {
  wall(20, 9.0, 10.5);  // narrower than the vehicle
  EXPECT_EQ(connect(), Status::kNoPath);
  EXPECT_TRUE(path_W_.empty());
}

TEST_F(LatticeSearchTest, KeepsWithinTheHorizon) {
  wall(20, 16.0, 20.0);
  request_.horizon_m = 41.0;
  ASSERT_EQ(connect(), Status::kOk);
  expect_way();
  request_.horizon_m = 20.0;
  request_.goal_W = Vector3(18, -3, 5);
  view_.occupied.clear();
  wall(10, 19.0, 24.0);
  EXPECT_EQ(connect(), Status::kNoPath);
}

TEST_F(LatticeSearchTest, EndsWithItsBudget) {
  wall(20, 9.0, 10.5);
  class Little final : public core::StageBudget {
   public:
    [[nodiscard]] bool spent(const core::Work& done) noexcept override { return done.units > 500; }
  } little;
  EXPECT_EQ(sut_.connect(request_, view_, little, work_, path_W_), Status::kBudgetSpent);
  EXPECT_LT(work_.units, 2000U);
}

TEST_F(LatticeSearchTest, DoesNotAllocate) {
  wall(20, 9.0, 11.4);
  const test::NoAllocScope scope;
  (void)connect();
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::stages
