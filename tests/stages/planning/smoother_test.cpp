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

/// Fourth derivative of a segment at t.
Vector3 snap(const PolynomialSegment& s, double t) {
  Vector3 sum = Vector3::Zero();
  double power = 1.0;
  for (std::size_t k = 4; k < 10; ++k, power *= t) {
    sum += static_cast<double>(k * (k - 1) * (k - 2) * (k - 3)) * power * s.coefficient[k];
  }
  return sum;
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
    EXPECT_LT((end.j_W - begin.j_W).norm(), 1e-4);
    EXPECT_LT((snap(t.segment[k], t.segment[k].duration_s) - snap(t.segment[k + 1], 0.0)).norm(),
              1e-3 * (1.0 + snap(t.segment[k + 1], 0.0).norm()));
  }
}

TEST(Smoother, IsContinuousUpToSnapWithinTheLimitsAndEndsAtRest) {
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
      ASSERT_LE(p.v_W.norm(), 6.0 * 1.10) << "sampled finer than the smoother samples";
      ASSERT_LE(p.a_W.norm(), 4.0 * 1.20);
    }
    EXPECT_GT(t.brake_begin_s, 0.0);
    EXPECT_LT(t.brake_begin_s, t.duration_s());
  }
  EXPECT_GT(flown, 160) << "the rest starts too fast for its first corner";
}

TEST(Smoother, FliesFastAndBrakesLate) {
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request_of({Vector3::Zero(), Vector3(40, 0, 0)}), view, unlimited, result),
            Status::kOk);
  // Trapezoid at 0.6 * 4 = 2.4 m/s2: up and down 7.5 m each in 2.5 s, 25 m at 6 m/s in 4.17 s: 9.17 s.
  EXPECT_NEAR(result.trajectory.duration_s(), 9.17, 0.3 * 9.17);
  EXPECT_GT(result.trajectory.at_s(result.trajectory.duration_s() * 0.5).v_W.norm(), 5.0);
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

TEST(Smoother, StopsAtEachCornerWhereNoCurveFits) {
  // A slot that leaves two centimetres around the box of the vehicle: any curve would touch.
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
  bool stops = false;
  for (double t = 0.0; t < result.trajectory.duration_s(); t += 0.01) {
    const TrajectoryPoint p = result.trajectory.at_s(t);
    EXPECT_LE(p.v_W.norm(), request.limits.speed_mps * 1.001);
    EXPECT_LE(p.a_W.norm(), request.limits.acceleration_mps2 * 1.001);
    stops = stops || ((p.p_W - corner).norm() < 0.05 && p.v_W.norm() < 0.1);
  }
  EXPECT_TRUE(stops);
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

TEST(Smoother, HasLessSnapThanItsNeighbours) {
  // Optimality: moving the free derivatives of an inner knot must not lower the integral of squared snap.
  // Three segments, the middle knots perturbed by adding to segment 1 a polynomial that changes velocity at
  // one joint only.
  Smoother sut;
  const test::BoxView view = open_view();
  core::UnlimitedBudget unlimited;
  SmoothResult result;
  ASSERT_EQ(sut.smooth(request_of({Vector3::Zero(), Vector3(6, 2, 0), Vector3(12, -1, 0)}), view, unlimited,
                       result),
            Status::kOk);
  const Trajectory& t = result.trajectory;
  ASSERT_GE(t.segment_count, 3U);
  const auto cost = [](const PolynomialSegment& s) {
    double sum = 0.0;
    constexpr int kSteps = 2000;
    for (int i = 0; i < kSteps; ++i)
      sum += snap(s, s.duration_s * (i + 0.5) / kSteps).squaredNorm() * s.duration_s / kSteps;
    return sum;
  };
  // h(t) with h = h' = ... = 0 at both ends but h'' = 1 at the joint, the mirror image on the other side.
  const auto bump = [](PolynomialSegment s, bool at_end, double size) {
    const double T = s.duration_s;
    // tau^2 (1 - tau)^5 (1 + 5 tau + 15 tau^2): second derivative 2 at tau = 0, third and fourth zero.
    const std::array<double, 10> c{0, 0, 1, 0, 0, -35, 105, -126, 70, -15};
    for (std::size_t k = 0; k < 10; ++k) {
      if (!at_end) {
        s.coefficient[k] += Vector3(size * c[k] / std::pow(T, static_cast<double>(k)), 0, 0);
        continue;
      }
      // Mirrored: c(1 - tau), expanded.
      for (std::size_t m = 0; m <= k; ++m) {
        double binomial = 1.0;
        for (std::size_t i = 0; i < m; ++i)
          binomial = binomial * static_cast<double>(k - i) / static_cast<double>(i + 1);
        s.coefficient[m] += Vector3(
            size * c[k] * binomial * (m % 2 == 0 ? 1.0 : -1.0) / std::pow(T, static_cast<double>(m)), 0, 0);
      }
    }
    return s;
  };
  const double before = cost(t.segment[0]) + cost(t.segment[1]);
  // Second derivatives at the joint must agree: 2 size / T^2 on both sides.
  const double ratio = (t.segment[1].duration_s * t.segment[1].duration_s) /
                       (t.segment[0].duration_s * t.segment[0].duration_s);
  for (const double size : {0.02, -0.02, 0.1, -0.1}) {
    const double after = cost(bump(t.segment[0], true, size)) + cost(bump(t.segment[1], false, size * ratio));
    EXPECT_GT(after, before * (1.0 - 1e-9)) << size;
  }
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

TEST(MinimumSnap, RefusesWhatHasNoSolution) {
  const MinimumSnap sut;
  Trajectory t;
  const std::vector<Vector3> knots{Vector3::Zero(), Vector3(3, 1, 0), Vector3(6, 0, 0)};
  EXPECT_TRUE(sut.solve(knots, std::vector<double>{0.0, 1.0, 1.0}, {}, t));
  EXPECT_FALSE(sut.solve(knots, std::vector<double>{0.0, 1.0}, {}, t)) << "sizes differ";
  EXPECT_FALSE(sut.solve(knots, std::vector<double>{0.0, 1.0, 0.0}, {}, t)) << "no time";
  EXPECT_FALSE(sut.solve(knots, std::vector<double>{0.0, std::nan(""), 1.0}, {}, t));
  EXPECT_FALSE(sut.solve(std::vector<Vector3>{Vector3::Zero()}, std::vector<double>{0.0}, {}, t));
  TrajectoryPoint start;
  start.a_W.x() = std::nan("");
  EXPECT_FALSE(sut.solve(knots, std::vector<double>{0.0, 1.0, 1.0}, start, t));
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
