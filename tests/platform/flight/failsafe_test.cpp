#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "platform/flight/failsafe_monitor.hpp"
#include "platform/flight/landing_site.hpp"
#include "tests/platform/sitl/vehicle/flight.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::flight {
namespace {

using governor::bit;
using governor::Condition;
constexpr Nanos kFrame{2'500'000};

TEST(FailsafeMonitor, EachConditionHoldsAboveItsLimitForItsTimeAndNotBefore) {
  for (const FailsafeThreshold& row : kFailsafeThresholds) {
    for (const double excess : {0.0, 1e-6}) {
      FailsafeMonitor sut;
      MonotonicTime now{};
      FailsafeMeasures fine{};
      ASSERT_EQ(sut.step(now, fine), 0);
      FailsafeMeasures bad{};
      bad.*row.measure = row.limit + excess;
      const MonotonicTime begin = now;
      governor::ConditionSet set = 0;
      while (seconds(now - begin) < row.for_s + 0.1) {
        now += kFrame;
        set = sut.step(now, bad);
        if (seconds(now - begin) <= row.for_s) {
          ASSERT_EQ(set & bit(row.condition), 0) << governor::to_string(row.condition);
        }
      }
      EXPECT_EQ((set & bit(row.condition)) != 0, excess > 0.0) << governor::to_string(row.condition);
      now += kFrame;
      EXPECT_EQ(sut.step(now, fine), 0) << "gone with its cause";
    }
  }
}

TEST(FailsafeMonitor, OneGoodMomentStartsTheTimeAgain) {
  FailsafeMonitor sut;
  MonotonicTime now{};
  FailsafeMeasures m{};
  for (int i = 0; i < 4000; ++i) {
    now += kFrame;
    m.depth_age_s = i % 100 == 0 ? 0.0 : 9.0;  // a good one every 250 ms, the limit is 500 ms
    ASSERT_EQ(sut.step(now, m), 0);
  }
}

TEST(FailsafeMonitor, ABatteryThatSaysNothingIsLowAndNotCritical) {
  FailsafeMonitor sut;
  FailsafeMeasures m{};
  m.battery_used_ratio = std::numeric_limits<double>::quiet_NaN();
  governor::ConditionSet set = 0;
  MonotonicTime now{};
  for (int i = 0; i < 2000; ++i) set = sut.step(now += kFrame, m);
  EXPECT_EQ(set, bit(Condition::kBatteryLow));
}

TEST(FailsafeMonitor, EveryConditionHasARow) {
  governor::ConditionSet all = 0;
  for (const FailsafeThreshold& row : kFailsafeThresholds) all |= bit(row.condition);
  EXPECT_EQ(all, governor::kAllConditions);
}

TEST(LandingSite, IsRightBelowWhereThatIsFreeAndTheNearestFreePlaceOtherwise) {
  test::BoxView view;
  view.free_W = {{-20, -20, 0.3}, {20, 20, 10}};
  const Vector3 p_W(0, 0, 4);
  const test::NoAllocScope scope;
  auto site_W = landing_site_W(view, {}, p_W, 0.0, 0.9);
  EXPECT_EQ(scope.count(), 0U);
  ASSERT_TRUE(site_W.has_value());
  EXPECT_EQ(*site_W, p_W);
  view.occupied.push_back({{-1, -1, 0}, {1, 1, 2}});
  site_W = landing_site_W(view, {}, p_W, 0.0, 0.9);
  ASSERT_TRUE(site_W.has_value());
  EXPECT_NEAR((*site_W - p_W).norm(), 3.0, 1e-9) << "1.5 m away it would still touch";
  EXPECT_EQ(site_W->z(), p_W.z());
  view.free_W = {{-20, -20, 2.0}, {20, 20, 10}};
  EXPECT_FALSE(landing_site_W(view, {}, p_W, 0.0, 0.9).has_value()) << "what is unknown is not free";
}

TEST(LandingSite, StaysInsideTheFence) {
  test::BoxView view;
  view.free_W = {{-20, -20, 0.3}, {20, 20, 10}};
  view.occupied.push_back({{-1, -20, 0}, {1, 20, 2}});
  core::Fence fence;
  const std::array<core::FencePoint, 4> west{{{-15, -15}, {1, -15}, {1, 15}, {-15, 15}}};
  ASSERT_EQ(fence.add_polygon(core::FenceSide::kKeepIn, west), core::FenceFault::kNone);
  const auto site_W = landing_site_W(view, fence, Vector3(0, 0, 4), 0.0, 0.9);
  ASSERT_TRUE(site_W.has_value());
  EXPECT_LT(site_W->x(), -1.9);
}

TEST(FlightControl, BrakesOnTheCommittedPathAndHoversThere) {
  test::Flight flight(5);
  const Vector3 from_W = flight.lane().committed().end_W();
  flight.lane().offer(test::straight(from_W, from_W + Vector3(60.0, 0.0, 0.0), 6.0, flight.now() + kFrame));
  while (flight.truth().v_WB.x() < 5.5) flight.step();
  const double begin_m = flight.truth().p_WB.x();
  flight.lane().brake();
  flight.lane().offer(test::straight(from_W, from_W + Vector3(0.0, 60.0, 0.0), 6.0, flight.now() + kFrame));
  double aside_m = 0.0;
  const MonotonicTime end = flight.now() + from_seconds(6.0);
  while (flight.now() < end) {
    flight.step();
    aside_m = std::fmax(aside_m, std::fabs(flight.truth().p_WB.y() - from_W.y()));
  }
  EXPECT_TRUE(flight.lane().standing(flight.now()));
  EXPECT_LT(aside_m, 0.4) << "neither off the path nor to what was offered meanwhile";
  // 5.5^2 / (2 * 2.5) = 6 m, and the motors' lag; the trajectory itself goes on for 40 m.
  EXPECT_GT(flight.truth().p_WB.x() - begin_m, 4.0);
  EXPECT_LT(flight.truth().p_WB.x() - begin_m, 9.0);
}

TEST(FlightControl, DescendsTouchesDownSoftlyAndNoticesIt) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    test::Flight flight(seed);
    flight.lane().descend(flight.now(), 1.0);
    double sink_mps = 0.0;
    double touchdown_mps = 0.0;
    const MonotonicTime latest = flight.now() + from_seconds(25.0);
    MonotonicTime down{};
    while (!flight.lane().landed() && flight.now() < latest) {
      flight.step();
      if (flight.truth().on_ground && sink_mps > 0.0) {
        touchdown_mps = sink_mps;
        down = flight.now();
      }
      sink_mps = flight.truth().on_ground ? 0.0 : -flight.truth().v_WB.z();
      ASSERT_FALSE(flight.lane().landed() && !flight.truth().on_ground) << "in the air";
    }
    EXPECT_TRUE(flight.lane().landed()) << "seed " << seed;
    EXPECT_GT(touchdown_mps, 0.0);
    EXPECT_LT(touchdown_mps, 1.2) << "seed " << seed;
    EXPECT_LT(seconds(flight.now() - down), 3.0);
  }
}

TEST(FlightControl, AHoverIsNeverTakenForALanding) {
  test::Flight flight(3);
  for (int i = 0; i < 4000; ++i) {
    flight.step();
    ASSERT_FALSE(flight.lane().landed());
  }
}

}  // namespace
}  // namespace roborun::flight
