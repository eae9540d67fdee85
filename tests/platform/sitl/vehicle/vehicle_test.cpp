#include "platform/sitl/vehicle/vehicle.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "core/executive/frame_table.hpp"
#include "core/geometry/math.hpp"

namespace roborun::sitl {
namespace {

firmware_if::MotorCommand all(double ratio) { return {{ratio, ratio, ratio, ratio}}; }

double hover_ratio(const VehicleModel& c) { return c.mass_kg * core::kGravity_mps2 / (4.0 * c.max_thrust_N); }

WindConfig calm() { return {Vector3::Zero(), 0.0, 3.0}; }

TEST(Vehicle, HoveringCosts480To550Watts) {
  const VehicleModel config;
  Vehicle vehicle(config, calm(), Vector3(0.0, 0.0, 10.0), 1);
  ASSERT_EQ(vehicle.command(all(hover_ratio(config))), Status::kOk);
  for (int k = 0; k < 400; ++k) vehicle.step(core::kMinorFrame);
  EXPECT_GE(vehicle.state().power_W, 480.0);
  EXPECT_LE(vehicle.state().power_W, 550.0);
}

TEST(Vehicle, AMotorReaches63PercentAfterItsLag) {
  const VehicleModel config;
  Vehicle vehicle(config, calm(), Vector3(0.0, 0.0, 10.0), 1);
  (void)vehicle.command(all(1.0));
  for (int k = 0; k < 16; ++k) vehicle.step(core::kMinorFrame);  // 40 ms
  EXPECT_NEAR(vehicle.state().thrust_ratio[0], 0.632, 0.005);
}

TEST(Vehicle, DragGivesFreeFallAnEnd) {
  const VehicleModel config;
  Vehicle vehicle(config, calm(), Vector3(0.0, 0.0, 5000.0), 1);
  for (int k = 0; k < 400 * 40; ++k) vehicle.step(core::kMinorFrame);
  // m g = linear v + quadratic v^2
  const double a = config.drag_quadratic_Ns2pm2;
  const double b = config.drag_linear_Nspm;
  const double c = config.mass_kg * core::kGravity_mps2;
  const double wanted = (-b + std::sqrt(b * b + 4.0 * a * c)) / (2.0 * a);
  EXPECT_NEAR(-vehicle.state().v_WB.z(), wanted, 0.1);
}

TEST(Vehicle, TheWindCarriesItAway) {
  const VehicleModel config;
  Vehicle vehicle(config, {Vector3(3.0, 0.0, 0.0), 0.0, 3.0}, Vector3(0.0, 0.0, 50.0), 1);
  (void)vehicle.command(all(hover_ratio(config)));
  for (int k = 0; k < 400 * 60; ++k) vehicle.step(core::kMinorFrame);
  EXPECT_NEAR(vehicle.state().v_WB.x(), 3.0, 0.3) << "until there is no air speed left";
}

TEST(Vehicle, StandsOnTheGroundUntilItsThrustExceedsItsWeight) {
  const VehicleModel config;
  Vehicle vehicle(config, {}, Vector3::Zero(), 1);
  (void)vehicle.command(all(0.9 * hover_ratio(config)));
  for (int k = 0; k < 400; ++k) vehicle.step(core::kMinorFrame);
  EXPECT_EQ(vehicle.state().p_WB, Vector3::Zero());
  EXPECT_TRUE(vehicle.state().on_ground);
  (void)vehicle.command(all(1.2 * hover_ratio(config)));
  for (int k = 0; k < 400; ++k) vehicle.step(core::kMinorFrame);
  EXPECT_GT(vehicle.state().p_WB.z(), 0.3);
}

TEST(Vehicle, AnEmptyBatteryGivesNoThrust) {
  VehicleModel config;
  config.battery_J = 1000.0;
  Vehicle vehicle(config, calm(), Vector3(0.0, 0.0, 100.0), 1);
  (void)vehicle.command(all(hover_ratio(config)));
  for (int k = 0; k < 400 * 4; ++k) vehicle.step(core::kMinorFrame);
  EXPECT_EQ(vehicle.state().battery_ratio, 0.0);
  EXPECT_LT(vehicle.state().thrust_ratio[0], 0.01);
  EXPECT_LT(vehicle.state().v_WB.z(), -5.0);
}

TEST(Vehicle, RefusesACommandOutOfRangeAndKeepsTheOneBefore) {
  const VehicleModel config;
  Vehicle vehicle(config, calm(), Vector3(0.0, 0.0, 10.0), 1);
  ASSERT_EQ(vehicle.command(all(0.4)), Status::kOk);
  for (const double bad : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(vehicle.command(all(bad)), Status::kInvalidArgument);
  for (int k = 0; k < 400; ++k) vehicle.step(core::kMinorFrame);
  EXPECT_NEAR(vehicle.state().thrust_ratio[2], 0.4, 1e-6);
}

TEST(Vehicle, SameSeedSameBits) {
  const auto end = [](std::uint64_t seed) {
    Vehicle vehicle({}, {}, Vector3(0.0, 0.0, 10.0), seed);
    (void)vehicle.command({{0.45, 0.46, 0.45, 0.44}});
    for (int k = 0; k < 200; ++k) vehicle.step(core::kMinorFrame);
    return vehicle.state().p_WB;
  };
  EXPECT_EQ(end(1), end(1));
  EXPECT_NE(end(1), end(2)) << "gusts";
}

}  // namespace
}  // namespace roborun::sitl
