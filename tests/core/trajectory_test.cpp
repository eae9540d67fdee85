#include "core/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace roborun {
namespace {

/// x(t) = t + t^2 + ... + t^9 on 1.5 s, then a second segment that stays.
Trajectory sample_trajectory() {
  Trajectory t;
  t.start_time = MonotonicTime{Nanos{5'000'000'000}};
  t.segment_count = 1;
  t.segment[0].duration_s = 1.5;
  for (std::size_t k = 0; k < PolynomialSegment::kCoefficients; ++k) {
    t.segment[0].coefficient[k] = Vector3(1.0, -0.5, 0.1 * static_cast<double>(k));
  }
  return t;
}

TEST(Trajectory, DerivativesMatchFiniteDifferences) {
  const Trajectory sut = sample_trajectory();
  constexpr double h = 1e-5;
  for (double t = 0.1; t < 1.4; t += 0.1) {
    const TrajectoryPoint p = sut.at_s(t);
    const TrajectoryPoint a = sut.at_s(t - h);
    const TrajectoryPoint b = sut.at_s(t + h);
    EXPECT_LT(((b.p_W - a.p_W) / (2 * h) - p.v_W).norm(), 1e-5 * (1.0 + p.v_W.norm()));
    EXPECT_LT(((b.v_W - a.v_W) / (2 * h) - p.a_W).norm(), 1e-5 * (1.0 + p.a_W.norm()));
    EXPECT_LT(((b.a_W - a.a_W) / (2 * h) - p.j_W).norm(), 1e-5 * (1.0 + p.j_W.norm()));
  }
}

TEST(Trajectory, StandsStillBeforeItsStartAndAfterItsEnd) {
  const Trajectory sut = sample_trajectory();
  for (const double t : {-1.0, 1.5, 2.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    const TrajectoryPoint p = sut.at_s(t);
    EXPECT_EQ(p.v_W.norm(), 0.0) << t;
    EXPECT_EQ(p.a_W.norm(), 0.0) << t;
    EXPECT_TRUE(is_finite(p.p_W)) << t;
  }
  EXPECT_EQ(sut.at_s(2.0).p_W, sut.end_W());
  EXPECT_EQ(sut.at(MonotonicTime{Nanos{5'500'000'000}}).p_W, sut.at_s(0.5).p_W);
}

TEST(Trajectory, HoldsAPointForEver) {
  const Trajectory sut = Trajectory::hold(Vector3(1, 2, 3), MonotonicTime{});
  EXPECT_EQ(sut.at_s(100.0).p_W, Vector3(1, 2, 3));
  EXPECT_EQ(sut.duration_s(), 0.0);
}

TEST(Trajectory, CoefficientsStartAsZero) {
  const Trajectory sut;
  for (const PolynomialSegment& s : sut.segment) {
    for (const Vector3& c : s.coefficient) ASSERT_EQ(c.norm(), 0.0);
  }
}

}  // namespace
}  // namespace roborun
