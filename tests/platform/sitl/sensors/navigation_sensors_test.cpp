#include "platform/sitl/sensors/navigation_sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "platform/sitl/sensors/delay_line.hpp"

namespace roborun::sitl {
namespace {

constexpr Nanos kFrame{2'500'000};

struct Statistics {
  int count{};
  double mean{};
  double sigma{};
};

class Sum {
 public:
  void add(double x) {
    ++count_;
    sum_ += x;
    squares_ += x * x;
  }
  [[nodiscard]] Statistics result() const {
    const double mean = sum_ / count_;
    return {count_, mean, std::sqrt(std::max(squares_ / count_ - mean * mean, 0.0))};
  }

 private:
  int count_{0};
  double sum_{0.0};
  double squares_{0.0};
};

TEST(NavigationSensors, AtRestTheImuReadsGravityPlusBiasAndNoise) {
  const NavigationSensorsConfig config;
  NavigationSensors sensors(config, 3);
  const VehicleState at_rest{};
  Sum gyro;
  Sum force;
  firmware_if::ImuSample sample;
  for (int k = 0; k < 8000; ++k) {
    sensors.sample(MonotonicTime{} + k * kFrame, at_rest);
    while (sensors.read(sample) == Status::kOk) {
      gyro.add(sample.angular_rate_B_radps[0]);
      force.add(sample.specific_force_B_mps2[2]);
    }
  }
  EXPECT_GE(gyro.result().count, 7990) << "one a minor frame";
  EXPECT_NEAR(gyro.result().sigma, config.gyro_noise_radps, 0.1 * config.gyro_noise_radps);
  EXPECT_LT(std::fabs(gyro.result().mean), 5.0 * config.gyro_bias_radps);
  EXPECT_NE(gyro.result().mean, 0.0);
  EXPECT_NEAR(force.result().mean, 9.81, 5.0 * config.accel_bias_mps2);
  EXPECT_NEAR(force.result().sigma, config.accel_noise_mps2, 0.1 * config.accel_noise_mps2);
}

TEST(NavigationSensors, AFixArrivesLateAndSomeNever) {
  NavigationSensorsConfig config;
  config.gnss_dropout_ratio = 0.1;
  NavigationSensors sensors(config, 3);
  VehicleState moving{};
  firmware_if::GnssFix fix;
  Sum east;
  for (int k = 0; k < 40 * 1000; ++k) {
    const MonotonicTime now = MonotonicTime{} + k * kFrame;
    moving.p_WB.x() = 100.0;
    sensors.sample(now, moving);
    while (sensors.read(fix) == Status::kOk) {
      EXPECT_GE(now - fix.stamp, Nanos{100'000'000});
      EXPECT_LE(now - fix.stamp, Nanos{103'000'000});
      east.add(fix.p_WB_m[0]);
    }
  }
  EXPECT_NEAR(east.result().count / 1000.0, 0.9, 0.03);
  EXPECT_NEAR(east.result().mean, 100.0, 0.1);
  EXPECT_GT(east.result().sigma, 0.8 * config.gnss_horizontal_m);
}

TEST(NavigationSensors, TheBarometerDriftsAroundTheTruth) {
  const NavigationSensorsConfig config;
  NavigationSensors sensors(config, 5);
  VehicleState up{};
  up.p_WB.z() = 7.0;
  firmware_if::BarometerSample sample;
  Sum height;
  for (int k = 0; k < 400 * 100; ++k) {
    sensors.sample(MonotonicTime{} + k * kFrame, up);
    while (sensors.read(sample) == Status::kOk) height.add(sample.altitude_m);
  }
  EXPECT_NEAR(height.result().count, 5000, 20) << "50 Hz";
  EXPECT_NEAR(height.result().mean, 7.0, 1.0);
  EXPECT_GT(height.result().sigma, 0.9 * config.barometer_noise_m);
}

TEST(NavigationSensors, SameSeedSameSamples) {
  NavigationSensors a({}, 8);
  NavigationSensors b({}, 8);
  NavigationSensors other({}, 9);
  firmware_if::ImuSample x;
  firmware_if::ImuSample y;
  firmware_if::ImuSample z;
  for (auto* s : {&a, &b, &other}) s->sample(MonotonicTime{}, {});
  ASSERT_EQ(a.read(x), Status::kOk);
  ASSERT_EQ(b.read(y), Status::kOk);
  ASSERT_EQ(other.read(z), Status::kOk);
  EXPECT_EQ(x.specific_force_B_mps2, y.specific_force_B_mps2);
  EXPECT_NE(x.specific_force_B_mps2, z.specific_force_B_mps2);
}

TEST(DelayLine, KeepsTheOrderAndLosesTheOldestWhenFull) {
  DelayLine<int, 4> line;
  for (int i = 0; i < 6; ++i) line.push(i, MonotonicTime{} + i * kFrame);
  int item = -1;
  EXPECT_EQ(line.pop(item, MonotonicTime{} + kFrame), Status::kNotReady);
  for (int i = 2; i < 6; ++i) {
    ASSERT_EQ(line.pop(item, MonotonicTime{} + 10 * kFrame), Status::kOk);
    EXPECT_EQ(item, i);
  }
  EXPECT_EQ(line.pop(item, MonotonicTime{} + 10 * kFrame), Status::kNotReady);
}

}  // namespace
}  // namespace roborun::sitl
