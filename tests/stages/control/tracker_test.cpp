#include "stages/control/tracker.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

double total(const firmware_if::MotorCommand& c) {
  return std::accumulate(c.thrust_ratio.begin(), c.thrust_ratio.end(), 0.0);
}

TEST(Tracker, HoldsItsWeightAtRest) {
  const Tracker::Config config;
  Tracker tracker(config);
  firmware_if::MotorCommand command;
  ASSERT_EQ(tracker.step({}, command), Status::kOk);
  EXPECT_NEAR(total(command) * config.vehicle.max_thrust_N, config.vehicle.mass_kg * 9.81, 1e-9);
}

TEST(Tracker, LeansTowardsAReferenceAhead) {
  Tracker tracker({});
  Tracker::Input in;
  in.reference.p_W = Vector3(2.0, 0.0, 0.0);
  firmware_if::MotorCommand command;
  ASSERT_EQ(tracker.step(in, command), Status::kOk);
  const auto& r = command.thrust_ratio;
  EXPECT_GT(r[2] + r[3], r[0] + r[1]) << "rear motors push the nose down";
}

TEST(Tracker, TheIntegralStopsAtItsLimitAndForgets) {
  Tracker::Config config;
  Tracker tracker(config);
  Tracker::Input in;
  in.reference.v_W = Vector3(0.0, 0.0, -1.0);  // never reached: the state stays
  firmware_if::MotorCommand command;
  for (int i = 0; i < 40000; ++i) ASSERT_EQ(tracker.step(in, command), Status::kOk);
  const double wound_up = total(command);
  in.reference.v_W.setZero();
  ASSERT_EQ(tracker.step(in, command), Status::kOk);
  const double lost_mps2 = 9.81 - total(command) * config.vehicle.max_thrust_N / config.vehicle.mass_kg;
  EXPECT_NEAR(lost_mps2, config.integral_limit_mps2, 0.01);
  EXPECT_LT(wound_up, total(command));
  tracker.reset();
  ASSERT_EQ(tracker.step(in, command), Status::kOk);
  EXPECT_NEAR(total(command) * config.vehicle.max_thrust_N, config.vehicle.mass_kg * 9.81, 1e-9);
}

TEST(Tracker, KeepsTheTiltLimit) {
  Tracker::Config config;
  Tracker tracker(config);
  Tracker::Input in;
  in.reference.p_W = Vector3(100.0, 100.0, 0.0);
  in.reference.a_W = Vector3(50.0, 0.0, 0.0);
  firmware_if::MotorCommand command;
  ASSERT_EQ(tracker.step(in, command), Status::kOk);
  EXPECT_EQ(tracker.counters().tilt_limited, 1U);
}

TEST(Tracker, RefusesWhatIsNotFiniteAndLeavesTheCommandBefore) {
  Tracker tracker({});
  firmware_if::MotorCommand command;
  command.thrust_ratio = {0.1, 0.2, 0.3, 0.4};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int field = 0; field < 6; ++field) {
    Tracker::Input in;
    if (field == 0) in.state.p_WB.x() = nan;
    if (field == 1) in.state.v_WB.y() = nan;
    if (field == 2) in.state.q_WB.coeffs()[1] = nan;
    if (field == 3) in.state.w_WB_B.z() = nan;
    if (field == 4) in.reference.j_W.x() = nan;
    if (field == 5) in.yaw_rad = std::numeric_limits<double>::infinity();
    EXPECT_EQ(tracker.step(in, command), Status::kInvalidArgument) << field;
    EXPECT_EQ(command.thrust_ratio[3], 0.4);
  }
  EXPECT_EQ(tracker.counters().refused, 6U);
}

TEST(Tracker, AllocatesNothing) {
  Tracker tracker({});
  firmware_if::MotorCommand command;
  const test::NoAllocScope scope;
  for (int i = 0; i < 100; ++i) (void)tracker.step({}, command);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::stages
