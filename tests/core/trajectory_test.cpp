#include "core/trajectory.hpp"

#include <gtest/gtest.h>

#include <array>
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
  const MonotonicTime start{Nanos{7}};
  Trajectory sut = Trajectory::hold(Vector3(1, 2, 3), start);
  EXPECT_EQ(sut.start_time, start);
  EXPECT_EQ(sut.end_W(), Vector3(1, 2, 3));
  sut.segment[0].coefficient[0] = Vector3(4, 5, 6);  // not flown
  EXPECT_EQ(sut.end_W(), Vector3(1, 2, 3));
  EXPECT_EQ(sut.at_s(100.0).p_W, Vector3(1, 2, 3));
  EXPECT_EQ(sut.duration_s(), 0.0);
}

/// The k-th derivative of a segment at this instant, term by term.
Vector3 derivative_W(const PolynomialSegment& segment, double at_s, int k) {
  Vector3 sum = Vector3::Zero();
  for (int n = k; n < static_cast<int>(PolynomialSegment::kCoefficients); ++n) {
    double factor = std::pow(at_s, n - k);
    for (int i = 0; i < k; ++i) factor *= n - i;
    sum += factor * segment.coefficient[static_cast<std::size_t>(n)];
  }
  return sum;
}

void expect_of(const TrajectoryPoint& point, const PolynomialSegment& segment, double at_s) {
  EXPECT_LT((point.p_W - derivative_W(segment, at_s, 0)).norm(), 1e-9) << at_s;
  EXPECT_LT((point.v_W - derivative_W(segment, at_s, 1)).norm(), 1e-9) << at_s;
  EXPECT_LT((point.a_W - derivative_W(segment, at_s, 2)).norm(), 1e-9) << at_s;
  EXPECT_LT((point.j_W - derivative_W(segment, at_s, 3)).norm(), 1e-9) << at_s;
}

void expect_rest_at(const TrajectoryPoint& point, const Vector3& p_W) {
  EXPECT_LT((point.p_W - p_W).norm(), 1e-9);
  EXPECT_EQ(point.v_W.norm() + point.a_W.norm() + point.j_W.norm(), 0.0);
}

// Segments that do not fit together, so that each instant says which one it is of.
TEST(Trajectory, IsItsSegmentsOneAfterTheOtherEachToItsEnd) {
  Trajectory sut;
  sut.segment_count = 3;
  constexpr std::array<double, 3> kDuration_s{0.5, 0.25, 0.75};
  for (std::size_t i = 0; i < 3; ++i) {
    sut.segment[i].duration_s = kDuration_s[i];
    for (std::size_t k = 0; k < PolynomialSegment::kCoefficients; ++k)
      sut.segment[i].coefficient[k] = Vector3(1.0 + static_cast<double>(i), static_cast<double>(k) - 4.5,
                                              10.0 * static_cast<double>(i) + 0.5);
  }
  sut.segment[3] = sut.segment[0];  // not flown
  EXPECT_EQ(sut.duration_s(), 1.5);
  double begins_s = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (const double share : {0.1, 0.5, 0.9, 1.0}) {
      if (i == 2 && share == 1.0) continue;  // at rest
      const double local_s = share * kDuration_s[i];
      expect_of(sut.at_s(begins_s + local_s), sut.segment[i], local_s);
    }
    begins_s += kDuration_s[i];
  }
  expect_of(sut.at_s(0.0), sut.segment[0], 0.0);
  for (const double before_s : {-1.0, -1e-9, std::numeric_limits<double>::quiet_NaN()})
    expect_rest_at(sut.at_s(before_s), sut.segment[0].coefficient[0]);
  const Vector3 end_W = derivative_W(sut.segment[2], 0.75, 0);
  for (const double after_s : {1.5, 1.6, 1e9}) expect_rest_at(sut.at_s(after_s), end_W);
  EXPECT_LT((sut.end_W() - end_W).norm(), 1e-9);

  sut.segment_count = 1;
  expect_of(sut.at_s(0.0), sut.segment[0], 0.0);
  sut.segment_count = 2;
  sut.segment[0].duration_s = 0.0;
  expect_of(sut.at_s(0.0), sut.segment[0], 0.0);
}

TEST(Trajectory, CoefficientsStartAsZero) {
  const Trajectory sut;
  for (const PolynomialSegment& s : sut.segment) {
    for (const Vector3& c : s.coefficient) ASSERT_EQ(c.norm(), 0.0);
  }
}

}  // namespace
}  // namespace roborun
