#include "stages/planning/smoother.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

test::BoxView open_view() {
  test::BoxView view;
  view.free_W = {Vector3(-200, -200, -50), Vector3(200, 200, 50)};
  return view;
}

SmoothRequest request_of(const std::vector<Vector3>& path, const Vector3& v_W = Vector3::Zero()) {
  SmoothRequest r;
  r.path_W = path;
  r.start.p_W = path.front();
  r.start.v_W = v_W;
  r.start_time = MonotonicTime{Nanos{1'000'000'000}};
  r.limits = {6.0, 4.0};
  r.radius_m = 0.9;
  return r;
}

void expect_continuous(const Trajectory& t) {
  for (std::size_t k = 0; k + 1 < t.segment_count; ++k) {
    Trajectory a, b;
    a.segment_count = b.segment_count = 2;  // so that the end of the first is not "at rest"
    a.segment[0] = t.segment[k];
    a.segment[1] = t.segment[k + 1];
    const TrajectoryPoint end = a.at_s(t.segment[k].duration_s);
    b.segment[0] = t.segment[k + 1];
    b.segment[1] = t.segment[k + 1];
    const TrajectoryPoint begin = b.at_s(1e-12);
    EXPECT_LT((end.p_W - begin.p_W).norm(), 1e-6);
    EXPECT_LT((end.v_W - begin.v_W).norm(), 1e-6);
    EXPECT_LT((end.a_W - begin.a_W).norm(), 1e-5);
  }
}

// The first leg begins beside the path's first point, so that its corner bends more than the path does. Where the next stop is so near
// that the corner must be flown no faster than it can be braked, that little more was "too fast" for any curve at speed.
TEST(Smoother, KeepsItsSpeedIntoACornerThatItMustBrakeAfter) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  const std::vector<Vector3> path{Vector3(20.95, -2.76, 3.27), Vector3(28.31, -3.01, 3.92),
                                  Vector3(34.20, -3.00, 4.50)};
  SmoothRequest request = request_of(path, Vector3(5.98, 0.41, -0.17));
  request.limits.jerk_mps3 = 15.0;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request, view, unlimited, result), Status::kOk);
  EXPECT_LT(result.trajectory.duration_s(),
            3.2);  // 13.3 m at 6 m/s, and the stop; 3.6 s at half of the speed
}

TEST(Smoother, IsContinuousUpToAccelerationWithinTheLimitsAndEndsAtRest) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  core::CounterRng rng(1);
  int flown = 0;
  for (int n = 0; n < 200; ++n) {
    std::vector<Vector3> path{Vector3::Zero()};
    Vector3 heading(1, 0, 0);
    const int count = 2 + static_cast<int>(rng.below(5));
    for (int i = 0; i < count; ++i) {
      heading = (heading + Vector3(rng.uniform(-0.8, 0.8), rng.uniform(-0.8, 0.8), rng.uniform(-0.2, 0.2)))
                    .normalized();
      path.push_back(path.back() + rng.uniform(1.5, 12.0) * heading);
    }
    const double v0 = rng.uniform(0.0, 5.0);
    const SmoothRequest r = request_of(path, v0 * (path[1] - path[0]).normalized());
    SmoothResult result;
    if (sut.smooth(r, view, unlimited, result) != Status::kOk) continue;
    ++flown;
    const Trajectory& t = result.trajectory;
    expect_continuous(t);
    const TrajectoryPoint first = t.at_s(0.0);
    EXPECT_LT((first.p_W - r.start.p_W).norm(), 1e-9);
    EXPECT_LT((first.v_W - r.start.v_W).norm(), 1e-9);
    EXPECT_LT((t.end_W() - path.back()).norm(), 1e-6);
    EXPECT_LT(t.at_s(t.duration_s() * (1.0 - 1e-9)).v_W.norm(), 1e-3) << "at rest at its end";
    for (double s = 0.0; s < t.duration_s(); s += 0.01) {
      const TrajectoryPoint p = t.at_s(s);
      ASSERT_LE(p.v_W.norm(), 6.0 * 1.0001);
      ASSERT_LE(p.a_W.norm(), 4.0 * 1.0001);
      ASSERT_LE(p.j_W.norm(), 20.0 * 1.001);
    }
    EXPECT_GT(t.brake_begin_s, 0.0);
    EXPECT_LT(t.brake_begin_s, t.duration_s());
  }
  EXPECT_EQ(flown, 200) << "in the open there is always a way, after a stop at worst";
}

TEST(Smoother, FliesFastAndBrakesLate) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request_of({Vector3::Zero(), Vector3(40, 0, 0)}), view, unlimited, result),
            Status::kOk);
  // Up and down in 6 / 4 + 4 / 20 = 1.7 s and 5.1 m each, 29.8 m at 6 m/s in 4.97 s: 8.37 s; the last 1.7 s brake.
  const double duration_s = result.trajectory.duration_s();
  EXPECT_NEAR(duration_s, 2.0 * 1.7 + 29.8 / 6.0, 1e-3);
  EXPECT_NEAR(result.trajectory.brake_begin_s, duration_s - 1.7, 1e-3);
  EXPECT_NEAR(result.trajectory.at_s(duration_s * 0.5).v_W.norm(), 6.0, 1e-3);
}

// To slow down first and then to brake takes more way than to brake once: speeds between are too fast, the start's is not.
TEST(Smoother, KeepsItsSpeedWhileOneStopFits) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  const std::vector<Vector3> path{Vector3(0, 0, 5), Vector3(7.12, 0.17, 5.02)};
  SmoothRequest request = request_of(path, Vector3(8.97, 0.24, 0.05));
  request.limits = {25.0, 18.3, 30.0};
  for (const double a_mps2 : {0.0, 0.9, 2.0, -1.0}) {
    request.start.a_W = Vector3(a_mps2, -0.16, -0.15);
    SmoothResult result;
    ASSERT_EQ(sut.smooth(request, view, unlimited, result), Status::kOk) << a_mps2;
    // A stop from 9 m/s at 30 m/s3 takes 1.1 s and 4.9 m; before it, 2.2 m at 9 m/s.
    EXPECT_LT(result.trajectory.duration_s(), 1.4) << a_mps2 << ": 1.9 with two changes";
    EXPECT_GT(result.trajectory.at_s(0.2).v_W.norm(), 8.7) << a_mps2;
  }
}

TEST(Smoother, SpeedsUpAgainstDragAndBrakesWithoutIt) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  std::vector<Vector3> path{Vector3::Zero(), Vector3(40, 0, 0)};
  SmoothRequest r = request_of(path);
  r.limits.speeding_up_mps2 = 2.0;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(r, view, unlimited, result), Status::kOk);
  // Up in 6 / 2 + 2 / 20 = 3.1 s and 9.3 m, down in 1.7 s and 5.1 m as before.
  const double duration_s = result.trajectory.duration_s();
  EXPECT_NEAR(duration_s, 3.1 + 1.7 + (40.0 - 9.3 - 5.1) / 6.0, 1e-3);
  EXPECT_NEAR(result.trajectory.brake_begin_s, duration_s - 1.7, 1e-3);
  // Replanned at any instant: never harder, and it still arrives.
  for (double s = 0.1; s < duration_s - 0.8; s += 0.1) {
    r.start = result.trajectory.at_s(s);
    path.front() = r.start.p_W;
    SmoothResult again;
    ASSERT_EQ(sut.smooth(r, view, unlimited, again), Status::kOk) << s;
    for (double t = 0.0; t < again.trajectory.duration_s(); t += 0.01)
      ASSERT_LE(again.trajectory.at_s(t).a_W.x(), std::max(2.0, r.start.a_W.x()) * 1.0001) << s << " " << t;
    EXPECT_LT((again.trajectory.end_W() - Vector3(40, 0, 0)).norm(), 0.05) << s;
  }
}

TEST(Smoother, StaysInFreeSpaceAroundACorner) {
  Smoother sut;
  test::BoxView view = open_view();
  view.occupied = {{Vector3(1.5, -20, -20), Vector3(20, -1.2, 20)},
                   {Vector3(-20, 1.2, -20), Vector3(9, 20, 20)}};
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request_of({Vector3(-8, 0, 0), Vector3(11, 0, 0), Vector3(11, 12, 0)}), view,
                       unlimited, result),
            Status::kOk);
  std::uint64_t lookups = 0;
  for (double s = 0.0; s < result.trajectory.duration_s(); s += 0.005) {
    ASSERT_TRUE(view.is_free(Aabb::around(result.trajectory.at_s(s).p_W, 0.9), lookups));
  }
  EXPECT_TRUE(is_trajectory_free(view, result.trajectory, 0.0, 0.9, lookups));
  view.occupied.push_back({Vector3(10, 5, -1), Vector3(12, 6, 1)});
  EXPECT_FALSE(is_trajectory_free(view, result.trajectory, 0.0, 0.9, lookups));
}

TEST(Smoother, IsNeverWorseThanStopping) {
  Smoother sut;
  test::BoxView view = open_view();
  view.occupied = {{Vector3(3, -5, -5), Vector3(4, 5, 5)}};
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  result.trajectory = Trajectory::hold(Vector3(7, 7, 7), {});
  EXPECT_EQ(sut.smooth(request_of({Vector3::Zero(), Vector3(10, 0, 0)}), view, unlimited, result),
            Status::kNoPath);
  EXPECT_EQ(result.trajectory.hold_W, Vector3(7, 7, 7)) << "untouched";
}

TEST(Smoother, CutsACornerWhereTheBoxOfTheVehicleHasNoRoom) {
  // A slot that leaves two centimetres around the vehicle: its box would touch on any curve, its ball does not, for the edge
  // inside the corner is sqrt(2) times as far away as the walls.
  Smoother sut;
  test::BoxView view = open_view();
  const double side = 0.92;
  view.occupied = {{Vector3(-5, side, -5), Vector3(20, 8, 5)},
                   {Vector3(6.0 + side, -20, -5), Vector3(20, side, 5)},
                   {Vector3(-5, -20, -5), Vector3(6.0 - side, -side, 5)}};
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  const Vector3 corner(6, 0, 0);
  const std::vector<Vector3> path{Vector3::Zero(), corner, Vector3(6, -8, 0)};
  const SmoothRequest request = request_of(path);
  ASSERT_EQ(sut.smooth(request, view, unlimited, result), Status::kOk);
  EXPECT_LT((result.trajectory.end_W() - Vector3(6, -8, 0)).norm(), 1e-9);
  double slowest_mps = request.limits.speed_mps, nearest_m = side;
  for (double t = 0.0; t < result.trajectory.duration_s(); t += 0.01) {
    const TrajectoryPoint p = result.trajectory.at_s(t);
    EXPECT_LE(p.v_W.norm(), request.limits.speed_mps * 1.001);
    EXPECT_LE(p.a_W.norm(), request.limits.acceleration_mps2 * 1.001);
    if ((p.p_W - corner).norm() < 1.0) slowest_mps = std::min(slowest_mps, p.v_W.norm());
    for (const Aabb& wall : view.occupied)
      nearest_m = std::min(nearest_m, (p.p_W - p.p_W.cwiseMax(wall.min_W).cwiseMin(wall.max_W)).norm());
  }
  EXPECT_GT(slowest_mps, 0.5);
  EXPECT_GE(nearest_m, request.radius_m - 1e-3) << "of the chords";
}

TEST(Smoother, KeepsThePointsThatANarrowPathNeeds) {
  // A tunnel with a step of 0.2 m to the side: a path without one of its two corners touches the walls.
  test::BoxView view = open_view();
  view.occupied = {{Vector3(-5, 0.35, -9), Vector3(1.65, 9, 9)},
                   {Vector3(-5, -9, -9), Vector3(2.35, -0.35, 9)},
                   {Vector3(2.35, -9, -9), Vector3(9, -0.15, 9)},
                   {Vector3(1.65, 0.55, -9), Vector3(9, 9, 9)}};
  const std::vector<Vector3> path{Vector3::Zero(), Vector3(2, 0, 0), Vector3(2, 0.2, 0), Vector3(5, 0.2, 0)};
  SmoothRequest request = request_of(path);
  request.radius_m = 0.3;
  Smoother sut;
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request, view, unlimited, result), Status::kOk);
  EXPECT_LT((result.trajectory.end_W() - request.path_W.back()).norm(), 1e-6);
  std::uint64_t lookups = 0;
  EXPECT_TRUE(is_trajectory_free(view, result.trajectory, 0.0, 0.3, lookups));
}

TEST(Smoother, FliesAStraightPieceThatTouchesAtTwoCorners) {
  // At (1.23, 1.23) the vehicle's box has a micrometre to walls on either side: any chord across that place has a box with more.
  test::BoxView view = open_view();
  const double near = 1.23 - 0.3 - 1e-6, far = 1.23 + 0.3 + 1e-6;
  view.occupied = {{Vector3(far, -9, -9), Vector3(9, near, 9)}, {Vector3(-9, far, -9), Vector3(near, 9, 9)}};
  const std::vector<Vector3> path{Vector3::Zero(), Vector3(4.1, 4.1, 0)};
  SmoothRequest request = request_of(path);
  request.radius_m = 0.3;
  std::uint64_t lookups = 0;
  ASSERT_TRUE(is_segment_free(view, path[0], path[1], 0.3, lookups));
  Smoother sut;
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request, view, unlimited, result), Status::kOk);
  const Trajectory& t = result.trajectory;
  ASSERT_GT(t.duration_s(), 1.0);
  for (double s = 0.0; s < t.duration_s(); s += 0.001)
    ASSERT_TRUE(view.is_free(Aabb::around(t.at_s(s).p_W, 0.3), lookups)) << s;
  view.occupied.push_back({Vector3(3, 3, -1), Vector3(3.1, 3.1, 1)});
  EXPECT_EQ(sut.smooth(request, view, unlimited, result), Status::kNoPath);
}

TEST(Smoother, NamesDegenerateInput) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  const std::vector<std::vector<Vector3>> bad{
      {Vector3::Zero()}, {Vector3::Zero(), Vector3::Zero()}, {Vector3::Zero(), Vector3(std::nan(""), 0, 0)}};
  for (const auto& path : bad)
    EXPECT_EQ(sut.smooth(request_of(path), view, unlimited, result), Status::kInvalidArgument);
  EXPECT_EQ(
      sut.smooth(request_of({Vector3::Zero(), Vector3(9, 0, 0)}, Vector3(99, 0, 0)), view, unlimited, result),
      Status::kInvalidArgument);
}

TEST(Smoother, TurnsInTheOpenWithoutAStop) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request_of({Vector3::Zero(), Vector3(20, 0, 0), Vector3(20, 20, 0)}), view, unlimited,
                       result),
            Status::kOk);
  const Trajectory& t = result.trajectory;
  // A right angle at 6 m/s changes the velocity by 8.49 m/s in 8.49 / 4 + 0.2 s, along a line through 4.24 m/s.
  double least_mps = 6.0;
  for (double s = 1.8; s < t.duration_s() - 1.8; s += 0.01)
    least_mps = std::min(least_mps, t.at_s(s).v_W.norm());
  EXPECT_NEAR(least_mps, 6.0 / std::sqrt(2.0), 0.02);
  EXPECT_NEAR(t.duration_s(), 40.0 / 6.0 + 1.7, 1e-3)
      << "as much shorter than the corner as it is slower there";
}

TEST(Smoother, GoesOnFromTheMiddleOfItsOwnTrajectory) {
  // Replanned along the same corners at any instant it does not arrive later: nothing is braked for twice.
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  const std::vector<Vector3> path{Vector3::Zero(), Vector3(14, 0, 0), Vector3(24, 9, 1), Vector3(40, 9, 1)};
  SmoothResult whole;
  ASSERT_EQ(sut.smooth(request_of(path), view, unlimited, whole), Status::kOk);
  const double duration_s = whole.trajectory.duration_s();
  for (double s = 0.1; s < duration_s - 0.8; s += 0.1) {
    const TrajectoryPoint at = whole.trajectory.at_s(s);
    std::vector<Vector3> rest{at.p_W};
    for (const Vector3& p_W : path) {
      const Vector3 next_W = &p_W == &path.back() ? p_W : *(&p_W + 1);
      if ((p_W - at.p_W).dot(next_W - p_W) > 0.0 && (p_W - at.p_W).dot(at.v_W) > 0.0) rest.push_back(p_W);
    }
    if ((rest.back() - path.back()).norm() > 0.0) rest.push_back(path.back());
    SmoothRequest r = request_of(rest);
    r.start = at;
    SmoothResult result;
    ASSERT_EQ(sut.smooth(r, view, unlimited, result), Status::kOk) << s;
    EXPECT_LT((result.trajectory.at_s(0.0).a_W - at.a_W).norm(), 1e-9);
    EXPECT_LT((result.trajectory.end_W() - path.back()).norm(), 0.05) << s;
    EXPECT_LT(s + result.trajectory.duration_s(), duration_s + 0.5) << s;
  }
}

TEST(Smoother, LeavesAPathThatBeginsAcrossItsVelocity) {
  // 5 m/s to the side of the path: it bends onto a line to the next point, or stops first.
  Smoother sut;
  test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  const std::vector<Vector3> path{Vector3::Zero(), Vector3(15, 0, 0), Vector3(15, 15, 0)};
  const SmoothRequest r = request_of(path, Vector3(0, 5, 0));
  ASSERT_EQ(sut.smooth(r, view, unlimited, result), Status::kOk);
  EXPECT_EQ(result.trajectory.at_s(0.0).v_W, Vector3(0, 5, 0));
  EXPECT_LT((result.trajectory.end_W() - r.path_W.back()).norm(), 1e-6);
  const double open_s = result.trajectory.duration_s();
  // Where it would bend: slower, that is sharper, it passes.
  const double bends_m = result.trajectory.at_s(1.5).p_W.x();
  view.occupied = {{Vector3(bends_m, result.trajectory.at_s(1.5).p_W.y(), -9), Vector3(14, 9, 9)}};
  std::uint64_t before = 0;
  ASSERT_FALSE(is_trajectory_free(view, result.trajectory, 0.0, 0.9, before));
  ASSERT_EQ(sut.smooth(r, view, unlimited, result), Status::kOk);
  std::uint64_t lookups = 0;
  EXPECT_TRUE(is_trajectory_free(view, result.trajectory, 0.0, 0.9, lookups));
  EXPECT_GT(result.trajectory.duration_s(), open_s);
}

TEST(Smoother, ClimbsWithinTheVerticalLimit) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  const std::vector<Vector3> path{Vector3::Zero(), Vector3(10, 0, 0), Vector3(14, 0, 12), Vector3(30, 0, 12)};
  SmoothRequest r = request_of(path);
  r.limits = {20.0, 15.0, 100.0, 8.0, 4.0, 4.5};
  SmoothResult result;
  ASSERT_EQ(sut.smooth(r, view, unlimited, result), Status::kOk);
  double most_mps2 = 0.0;
  for (double s = 0.0; s < result.trajectory.duration_s(); s += 0.005)
    most_mps2 = std::max(most_mps2, std::fabs(result.trajectory.at_s(s).a_W.z()));
  EXPECT_LE(most_mps2, 4.5 * 1.001);
  EXPECT_GT(most_mps2, 2.0);
}

TEST(Smoother, LeavesAClimbWithinTheVerticalLimit) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  const std::vector<Vector3> level{Vector3::Zero(), Vector3(40, 0, 0)};
  SmoothRequest r = request_of(level, Vector3(16.0, 0.0, 3.3));
  r.limits = {20.0, 18.0, 100.0, 8.0, 4.0, 4.5};
  SmoothResult result;
  ASSERT_EQ(sut.smooth(r, view, unlimited, result), Status::kOk);
  for (double s = 0.0; s < result.trajectory.duration_s(); s += 0.005)
    ASSERT_LE(std::fabs(result.trajectory.at_s(s).a_W.z()), 4.5 * 1.001) << s;
}

TEST(Smoother, FliesLongWindingPathsInParts) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  std::vector<Vector3> path{Vector3::Zero()};
  for (int i = 0; i < 30; ++i) path.push_back(path.back() + Vector3(2.0, i % 2 == 0 ? 3.0 : -3.0, 0.0));
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request_of(path), view, unlimited, result), Status::kOk);
  double nearest_m = 1e9;
  for (const Vector3& p_W : path) nearest_m = std::min(nearest_m, (p_W - result.trajectory.end_W()).norm());
  EXPECT_LT(nearest_m, 1e-6) << "ends at one of its points";
  EXPECT_GT(result.trajectory.end_W().x(), 6.0);
}

TEST(Smoother, BrakesWithinTheLimit) {
  Smoother sut;
  core::CounterRng rng(4);
  for (int n = 0; n < 500; ++n) {
    TrajectoryPoint start;
    start.v_W = Vector3(rng.uniform(-6, 6), rng.uniform(-6, 6), rng.uniform(-1, 1));
    start.a_W = Vector3(rng.uniform(-2, 2), rng.uniform(-2, 2), 0);
    start.j_W = Vector3(rng.uniform(-20, 20), rng.uniform(-20, 20), 0);
    Trajectory t;
    ASSERT_EQ(sut.brake(start, {}, {6.0, 4.0}, t), Status::kOk);
    const double v = start.v_W.norm();
    // 4 m/s2 all the time, and half of the two ramps before it does what it can.
    EXPECT_LT(t.duration_s(), (v + 0.5) / 4.0 + 0.6);
    EXPECT_LT((t.end_W() - start.p_W).norm(), v * v / 8.0 + 0.4 * v + 0.5);
    EXPECT_LT(t.at_s(t.duration_s() * (1.0 - 1e-12)).v_W.norm(), 1e-6);
    for (double s = 0.0; s < t.duration_s(); s += 0.01) {
      ASSERT_LE(t.at_s(s).v_W.norm(), v + 0.6);
      ASSERT_LE(t.at_s(s).a_W.norm(), 4.0 + 1e-9);
      ASSERT_LE(t.at_s(s).j_W.norm(), 20.0 + 1e-9);
    }
  }
  Trajectory t;
  EXPECT_EQ(sut.brake({}, {}, {6.0, 4.0}, t), Status::kOk);
  EXPECT_EQ(t.segment_count, 0U) << "standing: hold";
  TrajectoryPoint bad;
  bad.v_W.x() = std::nan("");
  EXPECT_EQ(sut.brake(bad, {}, {6.0, 4.0}, t), Status::kInvalidArgument);
}

TEST(Smoother, StopsSlowMotionAsSoonAsTheJerkAllows) {
  Smoother sut;
  const MotionLimits limits{.speed_mps = 4.0, .acceleration_mps2 = 10.0, .jerk_mps3 = 8.0};
  TrajectoryPoint start;
  start.v_W.x() = 0.6;
  start.a_W.x() = 1.0;
  Trajectory t;
  ASSERT_EQ(sut.brake(start, {}, limits, t), Status::kOk);
  // Until nothing speeds it up a/j = 0.125 s, then from v + a^2/2j = 0.6625 m/s to rest in 2 sqrt(0.6625 / 8) s.
  EXPECT_NEAR(t.duration_s(), 0.125 + 0.5755, 1e-4);
}

// A stop of which nothing is known to be free is replaced by each decision.
TEST(Smoother, StopsThoughEachDecisionStopsAnew) {
  Smoother sut;
  const MotionLimits limits{.speed_mps = 4.0, .acceleration_mps2 = 10.0, .jerk_mps3 = 8.0};
  core::CounterRng rng(5);
  for (int n = 0; n < 200; ++n) {
    TrajectoryPoint at;
    at.v_W = Vector3(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-1, 1));
    at.a_W = Vector3(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-2, 2));
    Trajectory t;
    ASSERT_EQ(sut.brake(at, {}, limits, t), Status::kOk);
    const double once_s = t.duration_s(), once_m = (t.end_W() - at.p_W).norm();
    double anew_s = 0.0;
    for (; at.v_W.norm() > 0.05 && anew_s < 10.0; anew_s += 0.2) {
      at = t.at_s(0.2);
      ASSERT_EQ(sut.brake(at, {}, limits, t), Status::kOk);
    }
    EXPECT_LT(anew_s, 1.1 * once_s + 0.2);
    EXPECT_LT(at.p_W.norm(), 1.1 * once_m + 0.05);
  }
}

TEST(Smoother, SmoothDoesNotAllocate) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  const std::vector<Vector3> path{Vector3::Zero(), Vector3(6, 2, 0), Vector3(12, -1, 0)};
  const SmoothRequest r = request_of(path);
  const test::NoAllocScope scope;
  (void)sut.smooth(r, view, unlimited, result);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::stages
