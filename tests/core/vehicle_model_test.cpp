#include "core/vehicle_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace roborun {
namespace {

TEST(VehicleModel, TheDefaultIsWithinAllBoundsAndCanFly) {
  EXPECT_EQ(out_of_bounds(VehicleModel{}), nullptr);
  EXPECT_EQ(cannot_fly(VehicleModel{}, 25.0), nullptr);
}

TEST(VehicleModel, NamesEveryNumberThatIsNanNegativeOrAbsurd) {
  for (const VehicleKey& key : kVehicleKeys) {
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), -1.0, 1e12}) {
      VehicleModel v;
      v.*key.value = bad;
      EXPECT_EQ(out_of_bounds(v), &key) << key.key << " = " << bad;
    }
  }
}

TEST(VehicleModel, TheFastestLevelFlightIsWhereDragTakesWhatTheTiltGives) {
  const VehicleModel v;
  const double level_mps = level_speed_mps(v);
  // 0.2 m/s2 of the 80 % that trajectories get: 0.25 m/s2 of the whole.
  EXPECT_NEAR(drag_mps2(v, level_mps) + 0.25, tilt_acceleration_mps2(v), 1e-9);
  VehicleModel faster = v;
  faster.speed_mps = level_mps * 1.001;
  EXPECT_NE(cannot_fly(faster, 500.0), nullptr);
  faster.speed_mps = level_mps * 0.999;
  EXPECT_EQ(cannot_fly(faster, 500.0), nullptr);
  VehicleModel linear = v;
  linear.drag_quadratic_Ns2pm2 = 0.0;
  EXPECT_NEAR(drag_mps2(linear, level_speed_mps(linear)) + 0.25, tilt_acceleration_mps2(linear), 1e-9);
  linear.drag_linear_Nspm = 0.0;
  EXPECT_TRUE(std::isinf(level_speed_mps(linear)));
  linear.tilt_rad = 0.02;  // 0.196 m/s2
  EXPECT_EQ(level_speed_mps(linear), 0.0);
}

TEST(VehicleModel, RefusesWhatCannotHoverTiltFlyFastOrStop) {
  VehicleModel heavy;
  heavy.mass_kg = 9.0;  // thrust-to-weight 1.11
  ASSERT_NE(cannot_fly(heavy, 25.0), nullptr);
  EXPECT_NE(std::string(cannot_fly(heavy, 25.0)).find("hover"), std::string::npos);
  VehicleModel upright;
  upright.tilt_rad = 0.3;  // 3 m/s2 sideways, 4 wanted
  EXPECT_NE(cannot_fly(upright, 25.0), nullptr);
  VehicleModel leaning;
  leaning.tilt_rad = 1.1;  // holds its height with a thrust-to-weight of 2.2
  leaning.max_thrust_N = 0.25 * 2.0 * leaning.mass_kg * 9.81;
  ASSERT_NE(cannot_fly(leaning, 25.0), nullptr);
  EXPECT_NE(std::string(cannot_fly(leaning, 25.0)).find("limits.tilt_rad: must have thrust"),
            std::string::npos);
  VehicleModel draggy;
  draggy.speed_mps = 30.0;
  draggy.drag_quadratic_Ns2pm2 = 0.5;
  EXPECT_NE(cannot_fly(draggy, 25.0), nullptr);
  EXPECT_NE(cannot_fly(VehicleModel{}, 1.0), nullptr) << "sees less than its stop and its radius";
}

/// The distance of a stop with constant jerk, constant deceleration, and constant jerk, summed up in small steps.
double stop_by_steps_m(double v, double a, double j) {
  const double ramp_s = std::min(a / j, std::sqrt(v / j));
  const double hold_s = v / (j * ramp_s) - ramp_s;
  const double T = 2.0 * ramp_s + hold_s;
  double sum_m = 0.0, speed_mps = v;
  constexpr int kSteps = 20000;
  const double step_s = T / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double middle_s = (i + 0.5) * step_s;
    const double braking_mps2 = j * std::min({middle_s, ramp_s, T - middle_s});
    sum_m += (speed_mps - 0.5 * braking_mps2 * step_s) * step_s;
    speed_mps -= braking_mps2 * step_s;
  }
  EXPECT_NEAR(speed_mps, 0.0, 1e-3 * v);
  return sum_m;
}

TEST(StoppingModel, DerivedFromTheLimitsIsNeverShorterThanTheStopItStandsFor) {
  for (const double a : {1.0, 4.0, 10.0, 20.0}) {
    for (const double j : {4.0, 20.0, 100.0}) {
      VehicleModel v;
      v.measured_stopping.reset();
      v.acceleration_mps2 = a;
      v.jerk_mps3 = j;
      const StoppingModel sut = stopping_model(v);
      EXPECT_EQ(sut.validate(), Status::kOk);
      const auto [flown_mps2, flown_mps3] = followed_limits(v);
      EXPECT_LE(flown_mps2, a);
      EXPECT_LE(flown_mps3, j);
      for (double speed = 0.1; speed <= 20.0; speed += 0.1)
        EXPECT_GE(sut.distance_m(speed), stop_by_steps_m(speed, flown_mps2, flown_mps3))
            << a << " " << j << " " << speed;
      // And no more than a tenth longer where acceleration alone decides, lag and tracking error aside.
      const double fast = 40.0 * flown_mps2 * flown_mps2 / flown_mps3;
      const double own = fast * v.motor_lag_s + v.tracking_error_m;
      EXPECT_LE(sut.distance_m(fast) - own, 1.1 * stop_by_steps_m(fast, flown_mps2, flown_mps3));
    }
  }
}

TEST(FollowedLimits, DragTakesFromSpeedingUpAndLeavesTheBrakes) {
  VehicleModel fast;
  fast.speed_mps = 12.0;
  VehicleModel slow = fast;
  slow.speed_mps = 6.0;
  // Tilted as far as four fifths of its tilt, it turns at the top speed as hard as it brakes.
  const double tilt_mps2 = tilt_acceleration_mps2(fast), drag = drag_mps2(fast, fast.speed_mps);
  const double turn_mps2 = followed_limits(fast).acceleration_mps2;
  EXPECT_LE(turn_mps2 * turn_mps2 + drag * drag, tilt_mps2 * tilt_mps2);
  EXPECT_DOUBLE_EQ(turn_mps2, followed_limits(slow).acceleration_mps2);
  for (double speed = 1.0; speed < 12.0; speed += 1.0) {
    EXPECT_LE(speeding_up_mps2(fast, speed) + drag_mps2(fast, speed), tilt_mps2) << speed;
    EXPECT_LE(speeding_up_mps2(fast, speed + 1.0), speeding_up_mps2(fast, speed)) << speed;
    EXPECT_EQ(speeding_up_mps2(fast, speed), speeding_up_mps2(slow, speed)) << speed;
  }
  EXPECT_LT(speeding_up_mps2(fast, 12.0), turn_mps2);
}

TEST(FollowedLimits, JerkIsWhatTheMotorsFollow) {
  VehicleModel v;
  v.jerk_mps3 = 30.0;
  for (const double lag_s : {0.01, 0.025, 0.04, 0.1}) {
    v.motor_lag_s = lag_s;
    EXPECT_DOUBLE_EQ(followed_limits(v).jerk_mps3, std::min(30.0, 0.6 / lag_s)) << lag_s;
  }
}

TEST(StoppingModel, DerivedAndMeasuredAgreeForTheVehicleThatWasMeasured) {
  VehicleModel derived;
  derived.measured_stopping.reset();
  for (const double speed : {2.0, 4.0, 6.0}) {
    const double measured_m = stopping_model(VehicleModel{}).distance_m(speed);
    EXPECT_NEAR(stopping_model(derived).distance_m(speed) / measured_m, 1.0, 0.35) << speed;
  }
}

}  // namespace
}  // namespace roborun
