#include "stages/control/mixer.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "core/random/counter_rng.hpp"

namespace roborun::stages {
namespace {

struct Wrench {
  double thrust_N{};
  Vector3 torque_B_Nm = Vector3::Zero();
};

/// The physics, written a second time: motors front left, front right, rear left, rear right; FLU axes.
Wrench wrench(const VehicleModel& a, const firmware_if::MotorCommand& command) {
  const double x[] = {a.arm_m, a.arm_m, -a.arm_m, -a.arm_m};
  const double y[] = {a.arm_m, -a.arm_m, a.arm_m, -a.arm_m};
  const double spin[] = {1, -1, -1, 1};
  Wrench w;
  for (std::size_t i = 0; i < 4; ++i) {
    const double f_N = command.thrust_ratio[i] * a.max_thrust_N;
    w.thrust_N += f_N;
    w.torque_B_Nm += Vector3(x[i], y[i], 0.0).cross(Vector3(0.0, 0.0, f_N));
    w.torque_B_Nm.z() += spin[i] * a.yaw_torque_m * f_N;
  }
  return w;
}

TEST(Mixer, GivesExactlyWhatFits) {
  const VehicleModel airframe;
  const Vector3 torque(0.8, -0.6, 0.1);
  const Wrench w = wrench(airframe, mix(airframe, 44.0, torque));
  EXPECT_NEAR(w.thrust_N, 44.0, 1e-9);
  EXPECT_NEAR((w.torque_B_Nm - torque).norm(), 0.0, 1e-9);
}

TEST(Mixer, GivesUpYawFirstThenThrustAndKeepsRollAndPitch) {
  const VehicleModel airframe;
  const Vector3 torque(6.0, 6.0, 2.0);
  const Wrench w = wrench(airframe, mix(airframe, 90.0, torque));
  EXPECT_NEAR(w.torque_B_Nm.x(), 6.0, 1e-9);
  EXPECT_NEAR(w.torque_B_Nm.y(), 6.0, 1e-9);
  EXPECT_LT(w.torque_B_Nm.z(), 2.0);
  EXPECT_GE(w.torque_B_Nm.z(), 0.0) << "less yaw, never the wrong way round";
  EXPECT_LT(w.thrust_N, 90.0);
}

// Yaw adds to two motors what it takes from the other two: at three quarters of the thrust (18.375 N each) a quarter of 24.5 N is left
// above, at one quarter as much below. So one pair ends at its limit, the other one as far from its middle: 2 x 2 x 6.125 N turn.
TEST(Mixer, GivesYawAllThatTheWorstMotorHasLeft) {
  const VehicleModel airframe;
  const double left_N = 0.25 * airframe.max_thrust_N;
  for (const double thrust : {0.25, 0.75}) {
    for (const double sign : {-1.0, 1.0}) {
      const Wrench w = wrench(
          airframe, mix(airframe, thrust * 4.0 * airframe.max_thrust_N, Vector3(0.0, 0.0, 100.0 * sign)));
      EXPECT_NEAR(w.torque_B_Nm.z(), sign * 4.0 * left_N * airframe.yaw_torque_m, 1e-9);
      EXPECT_NEAR(w.torque_B_Nm.head<2>().norm(), 0.0, 1e-9);
      EXPECT_NEAR(w.thrust_N, thrust * 4.0 * airframe.max_thrust_N, 1e-9);
    }
  }
}

TEST(Mixer, ScalesRollAndPitchTogetherWhenEvenTheyDoNotFit) {
  const VehicleModel airframe;
  const Wrench w = wrench(airframe, mix(airframe, 44.0, Vector3(30.0, 15.0, 0.0)));
  EXPECT_NEAR(w.torque_B_Nm.x() / w.torque_B_Nm.y(), 2.0, 1e-9) << "the direction stays";
}

TEST(Mixer, StaysWithinZeroAndOneForAnyInput) {
  const VehicleModel airframe;
  core::CounterRng rng(1);
  for (int i = 0; i < 20000; ++i) {
    const auto any = [&rng] { return 100.0 * rng.normal(); };
    const auto command = mix(airframe, any(), Vector3(any(), any(), any()));
    for (const double ratio : command.thrust_ratio) {
      ASSERT_GE(ratio, 0.0);
      ASSERT_LE(ratio, 1.0);
    }
  }
}

TEST(Mixer, AnswersWhatIsNotFiniteWithNoThrust) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf}) {
    for (const double ratio : mix({}, bad, Vector3::Zero()).thrust_ratio) EXPECT_EQ(ratio, 0.0);
    for (const double ratio : mix({}, 40.0, Vector3(0.0, bad, 0.0)).thrust_ratio) EXPECT_EQ(ratio, 0.0);
  }
}

}  // namespace
}  // namespace roborun::stages
