#include "stages/control/estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/executive/frame_table.hpp"
#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "core/random/counter_rng.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

using test::kNan;

/// A body on a horizontal circle, always level, with exact sensors plus the noise that is asked for.
class Circle {
 public:
  static constexpr double kRadius_m = 10.0;
  static constexpr double kRate_radps = 0.4;
  Vector3 gyro_bias_B = Vector3::Zero();
  Vector3 accel_bias_B = Vector3::Zero();
  double noise_m{0.0};

  static Vector3 p_W(double t) {
    return {kRadius_m * core::sin(kRate_radps * t), kRadius_m * (1.0 - core::cos(kRate_radps * t)), 5.0};
  }
  static Vector3 v_W(double t) {
    return kRadius_m * kRate_radps * Vector3(core::cos(kRate_radps * t), core::sin(kRate_radps * t), 0.0);
  }
  firmware_if::ImuSample imu(MonotonicTime stamp) {
    firmware_if::ImuSample s;
    s.stamp = stamp;
    // The nose follows the circle: the centripetal force is to the left, whatever the time.
    const Vector3 w = Vector3(0.0, 0.0, kRate_radps) + gyro_bias_B;
    const Vector3 f = Vector3(0.0, kRadius_m * kRate_radps * kRate_radps, 9.81) + accel_bias_B;
    for (int i = 0; i < 3; ++i) {
      s.angular_rate_B_radps[static_cast<std::size_t>(i)] = w[i];
      s.specific_force_B_mps2[static_cast<std::size_t>(i)] = f[i];
    }
    return s;
  }
  firmware_if::GnssFix gnss(MonotonicTime stamp) {
    const double t = seconds(stamp.time_since_epoch());
    firmware_if::GnssFix fix;
    fix.stamp = stamp;
    const Vector3 p = p_W(t);
    const Vector3 v = v_W(t);
    for (int i = 0; i < 3; ++i) {
      fix.p_WB_m[static_cast<std::size_t>(i)] = p[i] + noise_m * rng_.normal();
      fix.v_WB_mps[static_cast<std::size_t>(i)] = v[i];
    }
    fix.heading_rad = core::wrap_angle(kRate_radps * t);
    fix.sigma_horizontal_m = 0.02;
    fix.sigma_vertical_m = 0.03;
    fix.sigma_speed_mps = 0.05;
    fix.sigma_heading_rad = 0.01;
    return fix;
  }

 private:
  core::CounterRng rng_{3};
};

constexpr MonotonicTime at(double t_s) {
  return MonotonicTime{} + Nanos{static_cast<std::int64_t>(t_s * 1e9)};
}

/// Runs from begin_s to end_s with fixes every 100 ms that arrive late_frames minor frames after their
/// instant.
void run(Estimator& estimator, Circle& circle, double begin_s, double end_s, int late_frames = 0) {
  const auto first = static_cast<int>(begin_s * 400.0);
  const auto last = static_cast<int>(end_s * 400.0);
  for (int k = first + 1; k <= last; ++k) {
    ASSERT_EQ(estimator.predict(circle.imu(MonotonicTime{} + k * core::kMinorFrame)), Status::kOk);
    if ((k - late_frames) % 40 == 0 && k > late_frames)
      (void)estimator.update(circle.gnss(MonotonicTime{} + (k - late_frames) * core::kMinorFrame));
  }
}

TEST(Estimator, FollowsACircleWithBiasedSensorsAndLateFixes) {
  Estimator estimator({});
  Circle circle;
  circle.gyro_bias_B = Vector3(0.003, -0.002, 0.004);
  circle.accel_bias_B = Vector3(0.04, -0.03, 0.05);
  circle.noise_m = 0.015;
  run(estimator, circle, 0.0, 60.0, 40);  // 100 ms late
  EstimatedState s;
  ASSERT_EQ(estimator.state(s), Status::kOk);
  EXPECT_LT((s.p_WB - Circle::p_W(60.0)).norm(), 0.08);
  EXPECT_LT((s.v_WB - Circle::v_W(60.0)).norm(), 0.10);
  const Matrix3 R_WB = s.q_WB.toRotationMatrix();
  EXPECT_LT(std::fabs(core::wrap_angle(core::atan2(R_WB(1, 0), R_WB(0, 0)) - 0.4 * 60.0)), 0.02);
  EXPECT_GT(R_WB(2, 2), 0.9998) << "level within 1.1 degrees";
  EXPECT_LT(s.position_sigma_m, 0.1);
}

TEST(Estimator, IsNotReadyBeforeTheFirstFix) {
  Estimator estimator({});
  Circle circle;
  EstimatedState s;
  EXPECT_EQ(estimator.state(s), Status::kNotReady);
  EXPECT_EQ(estimator.update(circle.gnss(at(0.1))), Status::kNotReady) << "no IMU sample yet";
}

TEST(Estimator, GatesAFixThatJumps) {
  Estimator estimator({});
  Circle circle;
  run(estimator, circle, 0.0, 9.95);
  firmware_if::GnssFix jumped = circle.gnss(at(9.94));
  jumped.p_WB_m[0] += 50.0;
  const auto before = estimator.counters().refused_gate;
  (void)estimator.update(jumped);
  EXPECT_GT(estimator.counters().refused_gate, before);
  EstimatedState s;
  ASSERT_EQ(estimator.state(s), Status::kOk);
  EXPECT_LT((s.p_WB - Circle::p_W(9.95)).norm(), 0.2);
}

TEST(Estimator, RefusesWhatIsNotFiniteOrNotNewerAndCountsIt) {
  Estimator estimator({});
  Circle circle;
  run(estimator, circle, 0.0, 2.0);
  auto imu = circle.imu(at(2.1));
  imu.angular_rate_B_radps[1] = kNan;
  EXPECT_EQ(estimator.predict(imu), Status::kInvalidArgument);
  EXPECT_EQ(estimator.predict(circle.imu(at(1.0))), Status::kStale);
  auto fix = circle.gnss(at(1.95));
  fix.p_WB_m[2] = kNan;
  EXPECT_EQ(estimator.update(fix), Status::kInvalidArgument);
  EXPECT_NE(estimator.update(circle.gnss(at(0.1))), Status::kOk)
      << "older than the ring, or than the last fix";
  firmware_if::BarometerSample pressure;
  pressure.stamp = at(1.99);
  pressure.altitude_m = kNan;
  EXPECT_EQ(estimator.update(pressure), Status::kInvalidArgument);
  EXPECT_EQ(estimator.counters().refused_not_finite, 3U);
  EXPECT_GE(estimator.counters().refused_stamp, 2U);
  EstimatedState s;
  ASSERT_EQ(estimator.state(s), Status::kOk);
  EXPECT_LT((s.p_WB - Circle::p_W(2.0)).norm(), 0.2);
}

TEST(Estimator, BeginsAnewFromTheNextFixWhereItsStateOverflows) {
  Estimator estimator({});
  Circle circle;
  run(estimator, circle, 0.0, 2.0);
  EstimatedState s;
  ASSERT_EQ(estimator.state(s), Status::kOk);
  for (int i = 1; i <= 40 && estimator.counters().resets == 0; ++i) {
    auto imu = circle.imu(at(2.0 + 0.0025 * i));
    imu.specific_force_B_mps2 = {1e308, 1e308, 1e308};  // finite, each of them
    (void)estimator.predict(imu);
  }
  EXPECT_EQ(estimator.counters().resets, 1U);
  EXPECT_EQ(estimator.state(s), Status::kNotReady) << "nothing that is not finite is handed out";
  run(estimator, circle, 2.2, 8.0);
  ASSERT_EQ(estimator.state(s), Status::kOk);
  EXPECT_LT((s.p_WB - Circle::p_W(8.0)).norm(), 0.5);
  EXPECT_EQ(estimator.counters().resets, 1U);
}

TEST(Estimator, SaysWhenTheImuIsLost) {
  Estimator estimator({});
  Circle circle;
  run(estimator, circle, 0.0, 1.0);
  EXPECT_FALSE(estimator.imu_lost(at(1.02)));
  EXPECT_TRUE(estimator.imu_lost(at(1.03)));
}

TEST(Estimator, KnowsWhereItWas) {
  Estimator estimator({});
  Circle circle;
  run(estimator, circle, 0.0, 20.0);
  Pose X_WB{};
  ASSERT_EQ(estimator.past().pose_at(at(19.8), X_WB), Status::kOk);
  EXPECT_LT((X_WB.p_RT - Circle::p_W(19.8)).norm(), 0.1);
  EXPECT_EQ(estimator.past().pose_at(at(19.0), X_WB), Status::kStale);
  EXPECT_EQ(estimator.past().pose_at(at(21.0), X_WB), Status::kStale);
}

// An autopilot's state, 12 ms old: it is carried on to the present, and asked for as of then.
TEST(Estimator, FollowsAnAutopilotsStateAndItsFrameGoesOnWhenTheAutopilotsJumps) {
  Estimator sut({});
  firmware_if::AutopilotState sample;
  EstimatedState state;
  double other_m = 0.0;
  bool flies = true;
  const auto tell = [&](double now_s) {
    sample.stamp = at(now_s - 0.012);
    sample.p_WB_m = {2.0 * (now_s - 0.012) + other_m, 1.0, 5.0};
    sample.v_WB_mps = {2.0, 0.0, 0.0};
    sample.w_WB_B_radps = {0.0, 0.0, 0.5};
    return sut.follow(sample, at(now_s), flies);
  };
  EXPECT_EQ(sut.state(state), Status::kNotReady);
  for (int i = 1; i <= 40; ++i) ASSERT_EQ(tell(1.0 + 0.0025 * i), Status::kOk);
  ASSERT_EQ(sut.state(state), Status::kOk);
  EXPECT_NEAR(state.p_WB.x(), 2.0 * 1.1, 1e-9);
  EXPECT_NEAR(core::yaw_of(state.q_WB), 0.012 * 0.5, 1e-4);
  EXPECT_LT(state.map_sigma_m, Estimator::kMapLost_m);
  Pose X_WB{};
  ASSERT_EQ(sut.past().pose_at(at(1.05), X_WB), Status::kOk);
  EXPECT_NEAR(X_WB.p_RT.x(), 2.0 * 1.05, 0.006);
  const std::uint32_t map_number = state.map_number;
  ++sample.frame_number;
  other_m = 7.0;
  ASSERT_EQ(tell(1.12), Status::kOk);
  ASSERT_EQ(sut.state(state), Status::kOk);
  EXPECT_NEAR(state.p_WB.x(), 2.0 * 1.12, 1e-9) << "ours goes on";
  EXPECT_NEAR(state.shift_W.x(), 7.0, 1e-9);
  EXPECT_EQ(state.map_number, map_number) << "and the map with it";
  ASSERT_EQ(tell(1.14), Status::kOk);
  ASSERT_EQ(sut.state(state), Status::kOk);
  EXPECT_NEAR(state.p_WB.x(), 2.0 * 1.14, 1e-9);
  // Turned by 0.1 rad.
  ++sample.frame_number;
  sample.q_WB = {std::cos(0.05), 0.0, 0.0, std::sin(0.05)};
  ASSERT_EQ(tell(1.16), Status::kOk);
  ASSERT_EQ(sut.state(state), Status::kOk);
  EXPECT_EQ(state.map_number, map_number + 1);
  // Too long ago.
  ++sample.frame_number;
  ASSERT_EQ(tell(1.46), Status::kOk);
  ASSERT_EQ(sut.state(state), Status::kOk);
  EXPECT_EQ(state.map_number, map_number + 2);
  // On the ground ours jumps with it.
  ++sample.frame_number;
  flies = false;
  ASSERT_EQ(tell(1.48), Status::kOk);
  ASSERT_EQ(sut.state(state), Status::kOk);
  EXPECT_NEAR(state.p_WB.x(), 7.0 + 2.0 * 1.48, 1e-9);
  EXPECT_EQ(state.shift_W, Vector3::Zero());
  EXPECT_EQ(sut.follow(sample, at(1.48), true), Status::kStale) << "the time does not rise";
  EXPECT_EQ(sut.follow(sample, at(1.78), true), Status::kStale) << "too old";
  sample.p_WB_m[0] = std::numeric_limits<double>::quiet_NaN();
  sample.stamp = at(1.49);
  EXPECT_EQ(sut.follow(sample, at(1.5), true), Status::kInvalidArgument);
  ASSERT_EQ(sut.state(state), Status::kOk);
  EXPECT_EQ(state.stamp, at(1.48));
}

/// A vehicle that stands at (1, 2, 5) in the autopilot's frame.
firmware_if::AutopilotState standing(double stamp_s, double yaw_rad = 0.0) {
  firmware_if::AutopilotState sample;
  sample.stamp = at(stamp_s);
  sample.p_WB_m = {1.0, 2.0, 5.0};
  sample.q_WB = {core::cos(0.5 * yaw_rad), 0.0, 0.0, core::sin(0.5 * yaw_rad)};
  return sample;
}

TEST(Estimator, KeepsTheMapWhereAFollowedFrameJumpsSoonAndHardlyTurned) {
  struct Case {
    double after_s, turned_rad;
    bool hold, keeps;
  };
  for (const Case& c :
       {Case{0.01, 0.034, true, true}, Case{0.01, -0.034, true, true}, Case{0.01, 0.036, true, false},
        Case{0.01, -0.036, true, false}, Case{0.2, 0.0, true, true}, Case{0.201, 0.0, true, false},
        Case{0.01, 0.0, false, false}}) {
    SCOPED_TRACE(c.after_s * 1000.0 + c.turned_rad);
    Estimator sut({});
    ASSERT_EQ(sut.follow(standing(1.0, 0.5), at(1.0), c.hold), Status::kOk);
    firmware_if::AutopilotState sample = standing(1.0 + c.after_s, 0.5 + c.turned_rad);
    sample.frame_number = 1;
    sample.p_WB_m[0] = 4.0;
    sample.w_WB_B_radps = {0.1, 0.2, 0.3};
    ASSERT_EQ(sut.follow(sample, sample.stamp, c.hold), Status::kOk);
    EstimatedState state;
    ASSERT_EQ(sut.state(state), Status::kOk);
    EXPECT_EQ(state.map_number, c.keeps ? 0U : 1U);
    EXPECT_NEAR(state.p_WB.x(), c.hold ? 1.0 : 4.0, 1e-9);
    EXPECT_EQ(state.w_WB_B, Vector3(0.1, 0.2, 0.3));
    sample.stamp += Nanos{10'000'000};
    ASSERT_EQ(sut.follow(sample, sample.stamp, c.hold), Status::kOk);
    EXPECT_EQ(sut.counters().jumps, 1U) << "the same frame jumps once";
  }
}

TEST(Estimator, FollowsNothingThatIsOldOrNoState) {
  Estimator sut({});
  ASSERT_EQ(sut.follow(standing(0.0), MonotonicTime{}, true), Status::kOk)
      << "a first one may be at any time";
  ASSERT_EQ(sut.follow(standing(0.1), at(0.3), true), Status::kOk) << "just young enough";
  EXPECT_EQ(sut.follow(standing(0.2), at(0.4) + Nanos{1}, true), Status::kStale);
  EXPECT_EQ(sut.counters().refused_stamp, 1U);
  const auto refuses = [&](const auto& spoil) {
    firmware_if::AutopilotState sample = standing(0.4);
    spoil(sample);
    EXPECT_EQ(sut.follow(sample, at(0.4), true), Status::kInvalidArgument);
  };
  refuses([](auto& s) { s.p_WB_m[2] = kNan; });
  refuses([](auto& s) { s.v_WB_mps[1] = kNan; });
  refuses([](auto& s) { s.w_WB_B_radps[0] = kNan; });
  refuses([](auto& s) { s.q_WB[3] = kNan; });
  refuses([](auto& s) { s.q_WB[0] = std::sqrt(1.021); });
  EXPECT_EQ(sut.counters().refused_not_finite, 5U);
  firmware_if::AutopilotState sample = standing(0.4);
  sample.q_WB[0] = std::sqrt(1.019);
  EXPECT_EQ(sut.follow(sample, at(0.4), true), Status::kOk);
}

TEST(Estimator, TheBarometerHoldsTheHeightWithoutGnss) {
  Estimator estimator({});
  Circle circle;
  circle.accel_bias_B = Vector3(0.0, 0.0, 0.03);
  run(estimator, circle, 0.0, 10.0);
  for (int k = 4001; k <= 4000 + 30 * 400; ++k) {
    ASSERT_EQ(estimator.predict(circle.imu(MonotonicTime{} + k * core::kMinorFrame)), Status::kOk);
    if (k % 8 != 0) continue;
    firmware_if::BarometerSample pressure;
    pressure.stamp = MonotonicTime{} + k * core::kMinorFrame;
    pressure.altitude_m = 5.0;
    (void)estimator.update(pressure);
  }
  EstimatedState s;
  ASSERT_EQ(estimator.state(s), Status::kOk);
  EXPECT_LT(std::fabs(s.p_WB.z() - 5.0), 0.3) << "30 s of GNSS outage";
}

TEST(Estimator, AllocatesNothing) {
  Estimator estimator({});
  Circle circle;
  run(estimator, circle, 0.0, 1.0);
  const test::NoAllocScope scope;
  for (int k = 401; k < 800; ++k) {
    (void)estimator.predict(circle.imu(MonotonicTime{} + k * core::kMinorFrame));
    if (k % 40 == 0) (void)estimator.update(circle.gnss(MonotonicTime{} + k * core::kMinorFrame));
  }
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::stages
