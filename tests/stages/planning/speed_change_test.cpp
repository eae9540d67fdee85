#include "stages/planning/speed_change.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random/counter_rng.hpp"

namespace roborun::stages {
namespace {

constexpr ChangeLimits kLimits{4.0, 20.0};

TEST(SpeedChange, TakesTheLeastTimeAtBothLimits) {
  // From 1 to 5 m/s: 4 / 4 + 4 / 20 = 1.2 s at 3 m/s on the average. From 1 to 1.2 m/s: 2 sqrt(0.2 / 20) = 0.2 s.
  EXPECT_NEAR(change_s(4.0, kLimits), 1.2, 1e-12);
  EXPECT_NEAR(change_m(1.0, 5.0, kLimits), 3.6, 1e-12);
  EXPECT_NEAR(change_s(0.2, kLimits), 0.2, 1e-12);
  EXPECT_NEAR(change_m(1.2, 1.0, kLimits), 0.22, 1e-12);
  EXPECT_EQ(change_s(0.0, kLimits), 0.0);
  // The two laws meet where the limit of acceleration is just reached, at 0.8 m/s.
  EXPECT_NEAR(change_s(0.8 - 1e-9, kLimits), change_s(0.8 + 1e-9, kLimits), 1e-8);
}

TEST(SpeedChange, EndsWithTheVelocityItIsAskedFor) {
  core::CounterRng rng(7);
  int accelerated = 0;
  for (int n = 0; n < 2000; ++n) {
    TrajectoryPoint from;
    from.v_W = Vector3(rng.uniform(-6, 6), rng.uniform(-6, 6), rng.uniform(-2, 2));
    if (n % 4 != 0)
      from.a_W = Vector3(rng.uniform(-2.3, 2.3), rng.uniform(-2.3, 2.3), rng.uniform(-2.3, 2.3));
    const Vector3 to_W(rng.uniform(-6, 6), rng.uniform(-6, 6), rng.uniform(-2, 2));
    const VelocityChange sut(from, n % 5 == 0 ? Vector3(from.v_W + 0.01 * to_W) : to_W, kLimits);
    const Vector3 wanted = n % 5 == 0 ? Vector3(from.v_W + 0.01 * to_W) : to_W;
    accelerated += from.a_W.norm() > 0.0 ? 1 : 0;
    TrajectoryPoint at = from;
    for (const VelocityChange::Piece& piece : sut.pieces()) {
      EXPECT_GE(piece.duration_s, 0.0);
      EXPECT_LE(piece.jerk_W.norm(), 20.0 * 1.001);
      at = after(at, piece);
      EXPECT_LE(at.a_W.norm(), 4.0 * 1.0001);
    }
    EXPECT_LT((at.v_W - wanted).norm(), 1e-9);
    EXPECT_LT(at.a_W.norm(), 1e-9);
    EXPECT_LT((at.p_W - sut.way_W()).norm(), 1e-9);
  }
  EXPECT_GT(accelerated, 1000);
}

TEST(SpeedChange, KeepsBrakingWhereItBrakes) {
  // 4 m/s2 against 3 m/s, to rest: 3 - 4^2 / (2 * 20) = 2.6 m/s at 4 m/s2 in 0.65 s, and 0.2 s back to none.
  TrajectoryPoint from;
  from.v_W = Vector3(3, 0, 0);
  from.a_W = Vector3(-4, 0, 0);
  const VelocityChange sut(from, Vector3::Zero(), kLimits);
  EXPECT_NEAR(sut.duration_s(), 0.85, 1e-6);
}

TEST(SpeedChange, ATurnIsSymmetrical) {
  TrajectoryPoint from;
  from.v_W = Vector3(5, 0, 0);
  const Vector3 to_W(0, 5, 0);
  const VelocityChange sut(from, to_W, kLimits);
  // Half of the time along each of both: the corner lies between.
  const double half_m = 0.5 * 5.0 * change_s(5.0 * std::sqrt(2.0), kLimits);
  EXPECT_LT((sut.way_W() - Vector3(half_m, half_m, 0)).norm(), 1e-9);
}

}  // namespace
}  // namespace roborun::stages
