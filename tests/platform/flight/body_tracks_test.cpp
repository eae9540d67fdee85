#include "platform/flight/body_tracks.hpp"

#include <gtest/gtest.h>

#include <array>

#include "core/random/counter_rng.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::flight {
namespace {

constexpr double kPlanned_m = 0.9;
constexpr double kOwn_m = 0.6;
constexpr DepthError kExact{.constant_m = 0.01, .quadratic_per_m = 0.0};
const Vector3 kEye_W{0, 0, 3};  // where the vehicle sees them from

MonotonicTime at_s(double time_s) { return MonotonicTime{from_seconds(time_s)}; }

void see(BodyTracks& sut, double time_s, const Vector3& p_W) {
  const std::array<Vector3, 1> place_W{p_W};
  sut.observe(at_s(time_s), kEye_W, place_W, kExact);
}

/// Seen every 0.2 s up to `until_s`, crossing from the right at 2 m/s; in front of (10, 0) after 5 s.
Vector3 crosser_W(double time_s) { return {10.0, -10.0 + 2.0 * time_s, 3.0}; }
BodyTracks crossing_until(double until_s) {
  BodyTracks sut;
  for (double t = 0.0; t <= until_s + 1e-9; t += 0.2) see(sut, t, crosser_W(t));
  return sut;
}

/// Straight along x at this speed, through (x0, 0, 3) at time zero.
Trajectory straight(double x0_m, double speed_mps) {
  Trajectory t;
  t.start_time = at_s(0.0);
  t.segment_count = 1;
  t.segment[0].duration_s = 60.0;
  t.segment[0].coefficient[0] = Vector3(x0_m, 0, 3);
  t.segment[0].coefficient[1] = Vector3(speed_mps, 0, 0);
  return t;
}

TEST(BodyTracks, KnowNothingFromOneLookOrFromWhatStands) {
  BodyTracks sut;
  see(sut, 0.0, {5, 0, 3});
  EXPECT_EQ(sut.count(at_s(0.0)), 0U);
  core::CounterRng rng(3);
  // The same surface discovered late, a little beside itself each time.
  for (double t = 0.2; t < 3.0; t += 0.2)
    see(sut, t, {5.0 + rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05), 3});
  EXPECT_EQ(sut.count(at_s(3.0)), 0U);
  EXPECT_EQ(sut.meets(straight(0.0, 1.0), at_s(3.0), kPlanned_m, kOwn_m).near_s, BodyTracks::kNever);
}

// A pole that few looks meet appears again and again; the mean of three points is less wrong than each.
TEST(BodyTracks, DoNotTakeNoiseForMotion) {
  for (const double error_m : {0.01, 0.25}) {
    BodyTracks sut;
    core::CounterRng rng(5);
    std::size_t moved = 0;
    for (double t = 0.0; t < 6.0; t += 0.1) {
      const std::array<Vector3, 1> place_W{
          Vector3(8.0 + rng.uniform(-0.3, 0.3), rng.uniform(-0.1, 0.1), 3.0 + rng.uniform(-0.5, 0.5))};
      sut.observe(at_s(t), kEye_W, place_W, {.constant_m = error_m, .quadratic_per_m = 0.0});
      moved += sut.count(at_s(t));
    }
    if (error_m < 0.1) {
      EXPECT_GT(moved, 0U) << "this test sees no difference";
    } else {
      EXPECT_EQ(moved, 0U);
    }
  }
}

TEST(BodyTracks, PredictWhereABodyCrosses) {
  const BodyTracks sut = crossing_until(2.0);
  ASSERT_EQ(sut.count(at_s(2.0)), 1U);
  // At 2 m/s through the origin: both are at (10, 0) after 5 s, 3 s from now.
  const BodyTracks::Meeting meeting = sut.meets(straight(0.0, 2.0), at_s(2.0), kPlanned_m, kOwn_m);
  EXPECT_NEAR(meeting.touch_s, 3.0 - 1.2 / 2.8, 0.35);
  EXPECT_LT(meeting.near_s, meeting.touch_s);
  EXPECT_GT(meeting.own_mps, 1.0);
  // At half the speed it has gone by; what stands beside its way is not met.
  EXPECT_EQ(sut.meets(straight(0.0, 1.0), at_s(2.0), kPlanned_m, kOwn_m).near_s, BodyTracks::kNever);
  EXPECT_EQ(sut.meets(Trajectory::hold({5, 0, 3}, at_s(0.0)), at_s(2.0), kPlanned_m, kOwn_m).near_s,
            BodyTracks::kNever);
}

// Of what comes towards it the near side is seen: it touches 0.4 m later than it would around that.
TEST(BodyTracks, HaveTheirMiddleBehindWhatIsSeen) {
  BodyTracks sut;
  for (double t = 0.0; t <= 2.0 + 1e-9; t += 0.2) see(sut, t, {12.0 - 2.0 * t, 0, 3});
  const BodyTracks::Meeting meeting =
      sut.meets(Trajectory::hold({0, 0, 3}, at_s(0.0)), at_s(2.0), kPlanned_m, kOwn_m);
  constexpr double kTouches_m = kOwn_m + 0.6 - 0.4;
  EXPECT_NEAR(meeting.touch_s, (8.0 - kTouches_m) / 2.0 + 0.05, 0.0501);
}

// Seen from where the vehicle was, though it will have passed by when the trajectory begins.
TEST(BodyTracks, KeepTheirMiddleWhereverTheTrajectoryBegins) {
  BodyTracks sut;
  for (double t = 0.0; t <= 2.0 + 1e-9; t += 0.2) see(sut, t, {2.5, -6.0 + 2.0 * t, 3});
  // It crosses x = 2.5 in front of (2.5, 0) after one more second; what stands 1.4 m behind that meets what is 0.4 m behind.
  EXPECT_NE(sut.meets(Trajectory::hold({4.0, 0, 3}, at_s(0.0)), at_s(2.0), kPlanned_m, kOwn_m).touch_s,
            BodyTracks::kNever);
}

TEST(BodyTracks, PreferKeepingOffThenPassingThenStanding) {
  const BodyTracks sut = crossing_until(2.0);
  const auto score = [&](const Trajectory& t) { return sut.meets(t, at_s(2.0), kPlanned_m, kOwn_m).score(); };
  const double away = score(Trajectory::hold({4, 0, 3}, at_s(0.0)));
  const double beside = score(Trajectory::hold({8.4, 0, 3}, at_s(0.0)));
  const double stands = score(Trajectory::hold({10, 0, 3}, at_s(0.0)));
  const double flies_into = score(straight(0.0, 2.0));
  EXPECT_EQ(away, BodyTracks::kNever);
  EXPECT_GT(away, beside);
  EXPECT_GT(beside, stands);
  EXPECT_GT(stands, flies_into);
}

TEST(BodyTracks, WhatPartsDoesNotMeet) {
  const BodyTracks sut = crossing_until(5.6);  // 1.2 m past the line, going on
  EXPECT_EQ(sut.meets(Trajectory::hold({10, 0, 3}, at_s(0.0)), at_s(5.6), kPlanned_m, kOwn_m).near_s,
            BodyTracks::kNever);
}

// Whatever leads out of a touch is as good as keeping off.
TEST(BodyTracks, WhatTouchesAlreadyIsMetOnlyIfItComesNearerStill) {
  const BodyTracks sut =
      crossing_until(2.0);  // at (10, -6), seen from the left: its middle is a little farther
  const auto meeting = [&](double y_m) {
    return sut.meets(Trajectory::hold({10.2, y_m, 3}, at_s(0.0)), at_s(2.0), kPlanned_m, kOwn_m);
  };
  EXPECT_NEAR(meeting(-5.5).touch_s, 0.1, 1e-9) << "ahead of it";
  EXPECT_EQ(meeting(-6.8).touch_s, BodyTracks::kNever) << "behind it";
  EXPECT_EQ(meeting(-6.8).near_s, BodyTracks::kNever);
}

TEST(BodyTracks, BoundsGrowWithTimeUnseenAndTracksEnd) {
  const BodyTracks sut = crossing_until(2.0);
  // At rest 2.2 m beside its way: far enough now, not after a while without a look.
  const Trajectory beside = Trajectory::hold({7.9, 0, 3}, at_s(0.0));
  EXPECT_GT(sut.meets(beside, at_s(2.0), kPlanned_m, kOwn_m).near_s, 0.0);
  EXPECT_EQ(sut.count(at_s(3.9)), 1U);
  EXPECT_EQ(sut.count(at_s(4.1)), 0U) << "two seconds without being seen";
}

/// What is seen of a body: nine points, the middle of which lies 0.3 m behind what came into free space first.
std::array<stages::CloudPoint, 9> surface(const Vector3& p_W) {
  std::array<stages::CloudPoint, 9> points;
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {p_W + Vector3(0.0, 0.15 * static_cast<double>(i) - 0.9, 0.0), 1};
  return points;
}

/// At 1 m/s along y, past (10, 0) after 5 s. It appears in free space for a second, then stays in cells that are not free.
Vector3 slow_W(double time_s) { return {10.0, -5.0 + time_s, 3.0}; }

TEST(BodyTracks, FollowWhatIsSlowThroughCellsThatAreNotFree) {
  BodyTracks sut;
  double t = 0.0;
  for (; t <= 1.0; t += 0.2) see(sut, t, slow_W(t));
  ASSERT_EQ(sut.count(at_s(1.0)), 1U);
  for (; t <= 5.0; t += 0.2) sut.follow(at_s(t), kEye_W, surface(slow_W(t)));
  ASSERT_EQ(sut.count(at_s(t)), 1U);
  // At 2 m/s it would be in front of (10, 0) after 5 s, too; the body is there until about 6 s.
  EXPECT_LT(sut.meets(straight(0.0, 2.0), at_s(4.0), kPlanned_m, kOwn_m).touch_s, 1.2);
  EXPECT_TRUE(sut.near(at_s(5.0), {5, 0, 3}, {1, 0, 0}, 15.0));
  EXPECT_FALSE(sut.near(at_s(5.0), {5, 0, 3}, {1, 0, 0}, 4.0)) << "too far";
  EXPECT_FALSE(sut.near(at_s(5.0), {15, 0, 3}, {1, 0, 0}, 15.0)) << "behind";
}

TEST(BodyTracks, DoNotFollowWhatStands) {
  BodyTracks sut = crossing_until(1.0);
  ASSERT_EQ(sut.count(at_s(1.0)), 1U);
  const auto wall = surface(crosser_W(1.2));
  for (double t = 1.2; t <= 3.0; t += 0.2) sut.follow(at_s(t), kEye_W, wall);
  EXPECT_EQ(sut.count(at_s(3.0)), 0U);
  EXPECT_FALSE(sut.near(at_s(3.0), {5, 0, 3}, {1, 0, 0}, 15.0));
}

/// Along y, and back from 5 s on: in between it stands for an instant, in cells that are not free.
Vector3 turning_W(double time_s) { return {10.0, time_s < 5.0 ? -5.0 + time_s : 5.0 - time_s, 3.0}; }

TEST(BodyTracks, FollowWhatTurnsRound) {
  BodyTracks sut;
  double t = 0.0;
  for (; t <= 1.0; t += 0.2) see(sut, t, turning_W(t));
  bool stood = false;
  for (; t <= 8.0; t += 0.2) {
    sut.follow(at_s(t), kEye_W, surface(turning_W(t)));
    stood = stood || sut.count(at_s(t)) == 0;
  }
  EXPECT_TRUE(stood) << "one estimate said that it stands";
  EXPECT_EQ(sut.count(at_s(8.0)), 1U);
}

TEST(BodyTracks, PlacesThatStandPushOutNoBodyThatMoves) {
  BodyTracks sut = crossing_until(2.0);
  ASSERT_EQ(sut.count(at_s(2.0)), 1U);
  std::array<Vector3, BodyTracks::kMost + 2> places_W;  // newer than it, far away
  for (std::size_t i = 0; i < places_W.size(); ++i)
    places_W[i] = Vector3(100.0 + 8.0 * static_cast<double>(i), 0.0, 3.0);
  sut.observe(at_s(2.4), kEye_W, places_W, kExact);
  EXPECT_EQ(sut.count(at_s(2.4)), 1U);
}

TEST(BodyTracks, FollowManyAtOnceAndForgetTheOldest) {
  BodyTracks sut;
  for (double t = 0.0; t < 1.01; t += 0.2) {
    std::array<Vector3, 16> places_W;
    for (std::size_t i = 0; i < places_W.size(); ++i)
      places_W[i] = Vector3(8.0 * static_cast<double>(i), 1.5 * t, 3.0);
    const test::NoAllocScope scope;
    sut.observe(at_s(t), kEye_W, places_W, kExact);
    sut.follow(at_s(t), kEye_W, {});
    (void)sut.meets(straight(0.0, 2.0), at_s(t), kPlanned_m, kOwn_m);
    EXPECT_EQ(scope.count(), 0U);
  }
  EXPECT_LE(sut.count(at_s(1.0)), BodyTracks::kMost);
  EXPECT_GE(sut.count(at_s(1.0)), 8U);
}

}  // namespace
}  // namespace roborun::flight
