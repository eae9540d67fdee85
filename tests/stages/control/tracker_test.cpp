#include "stages/control/tracker.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

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

TEST(Tracker, LeansAgainstTheDragOfItsReference) {
  Tracker::Input in;
  in.state.v_WB = in.reference.v_W = Vector3(6.0, 0.0, 0.0);
  firmware_if::MotorCommand command;
  const auto& r = command.thrust_ratio;
  Tracker sut({});
  ASSERT_EQ(sut.step(in, command), Status::kOk);
  EXPECT_GT(r[2] + r[3], r[0] + r[1]);
  Tracker::Config config;
  config.vehicle.drag_linear_Nspm = config.vehicle.drag_quadratic_Ns2pm2 = 0.0;
  Tracker without(config);
  ASSERT_EQ(without.step(in, command), Status::kOk);
  EXPECT_NEAR(r[2] + r[3], r[0] + r[1], 1e-9) << "nothing to correct";
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

/// What turns the vehicle about its z axis: front left and rear right one way, the others the other way.
double yaw_torque_Nm(const VehicleModel& vehicle, const firmware_if::MotorCommand& c) {
  const auto& r = c.thrust_ratio;
  return vehicle.yaw_torque_m * vehicle.max_thrust_N * (r[0] - r[1] - r[2] + r[3]);
}

// Level, the error is a turn about z alone, of which the controller takes the sine. Attitude about z is wanted less than tilt: 0.4.
TEST(Tracker, TurnsToTheYawThatIsWantedTheShorterWayRound) {
  const Tracker::Config config;
  const VehicleModel& vehicle = config.vehicle;
  for (const auto& [is_rad, wanted_rad] :
       {std::pair{0.0, 0.03}, {0.0, -0.03}, {1.0, 1.04}, {3.13, -3.13}, {-2.0, -2.02}}) {
    Tracker tracker(config);
    Tracker::Input in;
    in.state.q_WB = Quaternion(Eigen::AngleAxisd(is_rad, Vector3::UnitZ()));
    in.yaw_rad = wanted_rad;
    firmware_if::MotorCommand command;
    ASSERT_EQ(tracker.step(in, command), Status::kOk);
    const double rate_radps = 0.4 * config.attitude_gain_Hz * std::sin(wanted_rad - is_rad);
    const double torque_Nm = config.rate_gain_Hz * vehicle.inertia_z_kgm2 * rate_radps;
    EXPECT_NEAR(yaw_torque_Nm(vehicle, command), torque_Nm, 1e-9) << is_rad << " to " << wanted_rad;
    EXPECT_NEAR(total(command) * vehicle.max_thrust_N, vehicle.mass_kg * 9.81, 1e-9);
  }
}

TEST(Tracker, BrakesATurn) {
  const Tracker::Config config;
  Tracker tracker(config);
  Tracker::Input in;
  in.state.w_WB_B.z() = 0.1;
  firmware_if::MotorCommand command;
  ASSERT_EQ(tracker.step(in, command), Status::kOk);
  EXPECT_NEAR(yaw_torque_Nm(config.vehicle, command),
              -0.1 * config.rate_gain_Hz * config.vehicle.inertia_z_kgm2, 1e-9);
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
