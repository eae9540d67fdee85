#include "core/vehicle_model.hpp"

#include <gtest/gtest.h>

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

/// The distance of v (1 - S(t/T)) with the shortest T that both limits allow, summed up in small steps.
double stop_by_steps_m(double v, double a, double j) {
  const double T = std::max(35.0 / 16.0 * v / a, std::sqrt(7.5132 * v / j));
  double sum_m = 0.0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const double x = (i + 0.5) / kSteps;
    const double s = x * x * x * x * (35.0 - 84.0 * x + 70.0 * x * x - 20.0 * x * x * x);
    sum_m += v * (1.0 - s) * T / kSteps;
  }
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
      for (double speed = 0.1; speed <= 20.0; speed += 0.1)
        EXPECT_GE(sut.distance_m(speed), stop_by_steps_m(speed, a, j)) << a << " " << j << " " << speed;
      // And no more than a tenth longer where acceleration alone decides, lag and tracking error aside.
      const double fast = 40.0 * a * a / j;
      const double own = fast * v.motor_lag_s + v.tracking_error_m;
      EXPECT_LE(sut.distance_m(fast) - own, 1.1 * stop_by_steps_m(fast, a, j));
    }
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
