#include "core/energy_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/geometry/math.hpp"
#include "core/random/counter_rng.hpp"

namespace roborun {
namespace {

constexpr double kStep_mps = 0.01;

/// By trying every speed.
double cheapest_of_all_mps(const VehicleModel& v) {
  double best_mps = 0.0, best_Jpm = 1e300;
  for (int i = 10; i <= 3000; ++i) {
    const double v_mps = kStep_mps * i, cost_Jpm = energy_per_metre(v, v_mps).total_Jpm();
    if (cost_Jpm >= best_Jpm) continue;
    best_Jpm = cost_Jpm;
    best_mps = v_mps;
  }
  return best_mps;
}

TEST(EnergyModel, TheCheapestSpeedIsTheLeastOfAllForVehiclesOfEveryKind) {
  core::CounterRng rng(7);
  int inside = 0;
  for (int i = 0; i < 100; ++i) {
    VehicleModel v;
    v.mass_kg = rng.uniform(0.2, 20.0);
    v.rotor_radius_m = rng.uniform(0.03, 0.4);
    v.efficiency_ratio = rng.uniform(0.3, 0.8);
    v.avionics_W = rng.uniform(0.0, 60.0);
    v.drag_linear_Nspm = rng.uniform(0.0, 1.0);
    v.drag_quadratic_Ns2pm2 = rng.uniform(0.001, 0.3);
    const double tried_mps = cheapest_of_all_mps(v);
    EXPECT_NEAR(cheapest_speed_mps(v), tried_mps, 1.5 * kStep_mps) << i;
    inside += tried_mps > 0.5 && tried_mps < 29.5 ? 1 : 0;
  }
  EXPECT_GE(inside, 50) << "minima at an end of the range test nothing";
}

TEST(EnergyModel, WithoutDragFasterIsAlwaysCheaper) {
  VehicleModel v;
  v.drag_linear_Nspm = v.drag_quadratic_Ns2pm2 = 0.0;
  EXPECT_NEAR(cheapest_speed_mps(v), 30.0, 0.01);
  EXPECT_NEAR(energy_per_metre(v, 10.0).total_Jpm(), 0.1 * hover_power_W(v), 1e-9);
}

TEST(EnergyModel, HoveringTakesWhatMomentumTheorySays) {
  VehicleModel v;
  // Four rotors of 0.19 m: T = 11.03 N each, v_i = sqrt(T / (2 rho A)) = 6.30 m/s, P = 4 T v_i / 0.54 + 15 W.
  EXPECT_NEAR(hover_power_W(v), 530.0, 1.0);
  EXPECT_EQ(rotor_power_W(v, 10.0, -3.0), rotor_power_W(v, 10.0, 0.0)) << "descent gives nothing back";
  EXPECT_GT(rotor_power_W(v, 10.0, 3.0), rotor_power_W(v, 10.0, 0.0));
}

TEST(EnergyModel, AMetreOfComputingCostsLessTheFasterItIsFlown) {
  VehicleModel v;
  EXPECT_DOUBLE_EQ(energy_per_metre(v, 5.0).computing_Jpm, 3.0);  // 15 W
  VehicleModel hungry = v;
  hungry.avionics_W = 500.0;
  EXPECT_GT(cheapest_speed_mps(hungry), cheapest_speed_mps(v) + 1.0) << "computing speaks for speed";
}

}  // namespace
}  // namespace roborun
