#include "platform/flight/gaze.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::flight {
namespace {

constexpr double kFrame_s = 0.0025;

/// Straight on at a constant velocity for so long.
Trajectory straight(const Vector3& v_W, double duration_s, MonotonicTime start) {
  Trajectory t;
  t.start_time = start;
  t.segment_count = 1;
  t.segment[0].duration_s = duration_s;
  t.segment[0].coefficient[1] = v_W;
  return t;
}

class GazeTest : public ::testing::Test {
 protected:
  /// Runs for so long; every step is within the yaw rate. Returns the last yaw.
  double run(Gaze& sut, const Trajectory& flown, double for_s) {
    for (double t = 0.0; t < for_s; t += kFrame_s) {
      now_ += from_seconds(kFrame_s);
      const double yaw = sut.step({now_, flown, number_, target_});
      EXPECT_LE(std::fabs(core::wrap_angle(yaw - yaw_)), kFrame_s * config_.yaw_rate_radps + 1e-12);
      turned_ += core::wrap_angle(yaw - yaw_);
      yaw_ = yaw;
    }
    return yaw_;
  }
  /// Until it may fly.
  void look_round(Gaze& sut) {
    sut.begin(0.5);
    (void)run(sut, straight({0, 0, 1.5}, 0.1, now_), 9.0);
    EXPECT_TRUE(sut.ready());
  }
  GazeConfig config_{.follows = true, .yaw_rate_radps = 0.8};
  MonotonicTime now_{};
  std::uint64_t number_{1};
  double yaw_{0.5}, turned_{0.0};
  std::optional<GazeTarget> target_{};
};

TEST_F(GazeTest, KeepsItsYawWhereEverythingIsSeen) {
  Gaze sut({}, kFrame_s);
  sut.begin(0.5);
  EXPECT_TRUE(sut.ready());
  EXPECT_EQ(run(sut, straight({0, 3, 0}, 5.0, now_), 20.0), 0.5);
}

TEST_F(GazeTest, LooksRoundOnceWhileItClimbsAndIsReadyAfterBoth) {
  const double turn_s = 2.0 * core::kPi / config_.yaw_rate_radps;
  for (const double climb_s : {3.0, 2.0 * turn_s}) {
    Gaze sut(config_, kFrame_s);
    sut.begin(0.5);
    yaw_ = 0.5;
    turned_ = 0.0;
    const Trajectory climb = straight({0, 0, 1.5}, climb_s, now_);
    const double both_s = std::max(climb_s, turn_s);
    (void)run(sut, climb, 2.9);
    EXPECT_GT(turned_, 2.0) << "it has begun";
    (void)run(sut, climb, both_s - 2.9 - 0.1);
    EXPECT_FALSE(sut.ready()) << climb_s;
    (void)run(sut, climb, 0.2);
    EXPECT_TRUE(sut.ready()) << climb_s;
    EXPECT_NEAR(turned_, 2.0 * core::kPi, 0.01) << "not twice where the climb is long";
  }
}

TEST_F(GazeTest, LooksWhereItFliesAndRoundWhenItIsStuck) {
  Gaze sut(config_, kFrame_s);
  look_round(sut);
  ++number_;
  const Trajectory left = straight({0, 2, 0}, 10.0, now_);
  EXPECT_NEAR(run(sut, left, 5.0), 0.5 * core::kPi, 1e-6);
  ++number_;
  const Trajectory back = straight({-2, -0.01, 0}, 5.0, now_);
  EXPECT_NEAR(run(sut, back, 4.0), core::atan2(-0.01, -2.0), 1e-6);
  EXPECT_NEAR(run(sut, back, 3.5), core::atan2(-0.01, -2.0), 1e-6) << "it hovers, for less than 3 s";
  turned_ = 0.0;
  (void)run(sut, back, 10.0);
  EXPECT_GT(turned_, 2.0 * core::kPi);
}

TEST_F(GazeTest, LooksAtWhatItHasToSeeAlsoWhileItStepsBack) {
  Gaze sut(config_, kFrame_s);
  look_round(sut);
  target_ = GazeTarget{Vector3(20, 0, 0)};
  ++number_;
  const Trajectory back = straight({-1, 0, 0}, 5.0, now_);
  EXPECT_NEAR(run(sut, back, 4.5), 0.0, 1e-6);
  (void)run(sut, back, config_.stuck_s);
  turned_ = 0.0;
  (void)run(sut, back, 10.0);
  EXPECT_GT(turned_, 2.0 * core::kPi) << "it is stuck all the same";
}

TEST_F(GazeTest, LooksAsideOfItsFlightAsFarAsTheWayAheadStaysInView) {
  Gaze sut(config_, kFrame_s);
  look_round(sut);
  ++number_;
  const Trajectory on = straight({1, 0, 0}, 12.0, now_);
  target_ = GazeTarget{Vector3(100, 20, 0), true};
  EXPECT_NEAR(run(sut, on, 4.0), core::atan2(20.0, 96.0), 1e-3) << "in view as well";
  target_ = GazeTarget{Vector3(4, -50, 0), true};
  const double aside_rad = run(sut, on, 4.0);
  EXPECT_LT(aside_rad, -0.2);
  EXPECT_GT(aside_rad, -0.5) << "what is ahead has to stay in view";
  ++number_;
  (void)run(sut, straight({0, 0, 0}, 0.1, now_), 2.5);
  EXPECT_NEAR(yaw_, -0.5 * core::kPi, 0.4) << "where it does not fly it looks there";
}

}  // namespace
}  // namespace roborun::flight
