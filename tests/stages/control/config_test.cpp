#include <gtest/gtest.h>

#include "stages/control/estimator.hpp"
#include "stages/control/tracker.hpp"
#include "tests/support/config_death.hpp"

namespace roborun::stages {
namespace {

TEST(TrackerConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = Tracker::Config;
  test::expect_only_valid_configs<Config>({}, [](const Config& config) { const Tracker sut(config); },
                                          {{"mass", [](Config& c) { c.vehicle.mass_kg = 0.0; }},
                                           {"inertia", [](Config& c) { c.vehicle.inertia_y_kgm2 = 0.0; }},
                                           {"arm", [](Config& c) { c.vehicle.arm_m = -0.3; }},
                                           {"thrust", [](Config& c) { c.vehicle.max_thrust_N = 0.0; }},
                                           {"yaw torque", [](Config& c) { c.vehicle.yaw_torque_m = 0.0; }},
                                           {"position gain", [](Config& c) { c.position_gain_Hz = 10.1; }},
                                           {"velocity gain", [](Config& c) { c.velocity_gain_Hz = 0.0; }},
                                           {"integral", [](Config& c) { c.velocity_integral_Hz2 = -0.1; }},
                                           {"integral limit", [](Config& c) { c.integral_limit_mps2 = 0.0; }},
                                           {"attitude gain", [](Config& c) { c.attitude_gain_Hz = 51.0; }},
                                           {"rate gain", [](Config& c) { c.rate_gain_Hz = 0.0; }},
                                           {"tilt", [](Config& c) { c.vehicle.tilt_rad = 1.3; }},
                                           {"correction", [](Config& c) { c.correction_limit_mps = 0.0; }},
                                           {"period", [](Config& c) { c.period_s = 0.0; }}});
}

TEST(EstimatorConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = Estimator::Config;
  test::expect_only_valid_configs<Config>(
      {}, [](const Config& config) { const Estimator sut(config); },
      {{"gyro noise", [](Config& c) { c.gyro_noise_radps = 0.0; }},
       {"accelerometer noise", [](Config& c) { c.accel_noise_mps2 = 11.0; }},
       {"gyro walk", [](Config& c) { c.gyro_bias_walk_radps = 0.0; }},
       {"accelerometer walk", [](Config& c) { c.accel_bias_walk_mps2 = 2.0; }},
       {"barometer", [](Config& c) { c.barometer_sigma_m = 0.0; }},
       {"gate", [](Config& c) { c.gate_sigma = 2.9; }},
       {"IMU", [](Config& c) { c.imu_lost_after = Nanos{0}; }},
       {"oldest fix", [](Config& c) { c.oldest_fix = Nanos{0}; }}});
}

}  // namespace
}  // namespace roborun::stages
