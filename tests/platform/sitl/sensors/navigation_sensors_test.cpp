#include "platform/sitl/sensors/navigation_sensors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/executive/frame_table.hpp"
#include "platform/sitl/sensors/delay_line.hpp"

namespace roborun::sitl {
namespace {

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
    sensors.sample(MonotonicTime{} + k * core::kMinorFrame, at_rest);
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
    const MonotonicTime now = MonotonicTime{} + k * core::kMinorFrame;
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
    sensors.sample(MonotonicTime{} + k * core::kMinorFrame, up);
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

WorldDescription field() {
  WorldDescription d;
  d.bounds_W = {{-100.0, -100.0, 0.5}, {100.0, 100.0, 60.0}};
  d.start_W = {0.0, 0.0, 5.0};
  d.goal_W = {5.0, 0.0, 5.0};
  return d;
}
World street(double half_width_m) {
  WorldDescription d = field();
  d.boxes = {{{-90.0, half_width_m, 0.0}, {90.0, half_width_m + 5.0, 20.0}},
             {{-90.0, -half_width_m - 5.0, 0.0}, {90.0, -half_width_m, 20.0}}};
  return World(d);
}

NavigationSensorsConfig products() {
  NavigationSensorsConfig c;
  c.imu = ImuModel::kMems;
  c.gnss = GnssModel::kM9n;
  c.gnss_rate_Hz = 1.0;
  return c;
}

/// Fixes of a receiver that stands still, one a second; lost ones are NaN.
std::vector<firmware_if::GnssFix> fixes(std::uint64_t seed, int count, const World* world,
                                        const VehicleState& at) {
  NavigationSensors sensors(products(), seed);
  sensors.stand_in(world);
  std::vector<firmware_if::GnssFix> result(static_cast<std::size_t>(count));
  for (firmware_if::GnssFix& fix : result) fix.p_WB_m.fill(std::nan(""));
  firmware_if::GnssFix fix;
  for (int k = 0; k <= count; ++k) {
    sensors.sample(MonotonicTime{} + k * Nanos{1'000'000'000}, at);
    while (sensors.read(fix) == Status::kOk) result[fix.sequence - 1] = fix;
  }
  return result;
}

TEST(ProductGnss, IsOffByMetresThatLastForMinutes) {
  constexpr int kSeeds = 250;
  std::vector<double> off_m;
  double squares = 0.0, after_60 = 0.0, n_60 = 0.0, after_1100 = 0.0, n_1100 = 0.0, up = 0.0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const auto all = fixes(seed, 1102, nullptr, {});
    const auto& p = all[0].p_WB_m;
    if (std::isnan(p[0])) continue;
    off_m.push_back(std::hypot(p[0], p[1]));
    up += p[2] * p[2];
    for (std::size_t i = 0; i < 2; ++i) {
      squares += p[i] * p[i];
      if (!std::isnan(all[60].p_WB_m[i])) after_60 += p[i] * all[60].p_WB_m[i], n_60 += 1.0;
      if (!std::isnan(all[1100].p_WB_m[i])) after_1100 += p[i] * all[1100].p_WB_m[i], n_1100 += 1.0;
    }
  }
  std::sort(off_m.begin(), off_m.end());
  EXPECT_NEAR(off_m[off_m.size() / 2], 1.5, 0.2) << "the data sheet's CEP";
  const double variance = squares / static_cast<double>(2 * off_m.size());
  // Drift, multipath and noise: 1.21 + 0.25 + 0.04.
  EXPECT_NEAR(std::sqrt(variance), 1.23, 0.1);
  EXPECT_NEAR(std::sqrt(up / static_cast<double>(off_m.size())), 2.0 * 1.23, 0.3);
  EXPECT_NEAR(after_60 / n_60 / variance, 1.21 * std::exp(-60.0 / 1100.0) / 1.5, 0.08)
      << "the drift is still there";
  EXPECT_NEAR(after_1100 / n_1100 / variance, 1.21 * std::exp(-1.0) / 1.5, 0.15)
      << "a third of it after its time constant";
}

TEST(ProductGnss, IsWorseBetweenWallsAndGoneWhereThereIsNoSky) {
  const World open(field()), wide = street(8.0), narrow = street(2.0);
  VehicleState at{};
  at.p_WB = {0.0, 0.0, 2.0};
  EXPECT_EQ(sky_ratio(open, at.p_WB), 1.0);
  const double sky = sky_ratio(wide, at.p_WB);
  EXPECT_GT(sky, 0.2);
  EXPECT_LT(sky, 0.7);
  EXPECT_LT(sky_ratio(narrow, at.p_WB), sky);
  const auto sigma_m = [&](const World& world) {
    Sum sum;
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
      const auto all = fixes(seed, 200, &world, at);
      for (std::size_t i = 60; i < 200; i += 20)
        if (!std::isnan(all[i].p_WB_m[0])) sum.add(all[i].p_WB_m[0]);
    }
    return sum.result().sigma;
  };
  const double shaded_m = 0.5 + 8.0 * (1.0 - sky);
  EXPECT_NEAR(sigma_m(wide), std::sqrt(1.21 + shaded_m * shaded_m), 0.8);
  EXPECT_LT(sigma_m(open), 1.6);
  const auto in_street = fixes(1, 30, &wide, at);
  EXPECT_GT(in_street[5].sigma_horizontal_m, 2.0) << "it says that it is worse";
  WorldDescription roofed = field();
  roofed.boxes = {{{-50.0, -50.0, 6.0}, {50.0, 50.0, 7.0}}};
  const World hall(roofed);
  for (const firmware_if::GnssFix& fix : fixes(1, 30, &hall, at)) EXPECT_TRUE(std::isnan(fix.p_WB_m[0]));
}

TEST(ProductGnss, TheCompassIsDisturbedByItsVehicleAndByPlaces) {
  double squares = 0.0;
  int count = 0;
  const auto error_deg = [](std::uint64_t seed, const VehicleState& at) {
    // Long enough to have come to the place.
    const double heading_rad =
        core::atan2(at.q_WB.toRotationMatrix()(1, 0), at.q_WB.toRotationMatrix()(0, 0));
    double sum_deg = 0.0, n = 0.0;
    for (const auto& fix : fixes(seed, 30, nullptr, at)) {
      if (fix.sequence < 10) continue;
      sum_deg += core::wrap_angle(fix.heading_rad - heading_rad) / core::kDegree;
      n += 1.0;
    }
    return sum_deg / n;
  };
  double by_throttle = 0.0, by_place = 0.0, by_heading = 0.0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    VehicleState at{};
    at.thrust_ratio.fill(0.5);
    const double here_deg = error_deg(seed, at);
    squares += here_deg * here_deg;
    ++count;
    VehicleState idle = at, elsewhere = at, turned = at;
    idle.thrust_ratio.fill(0.0);
    elsewhere.p_WB = {30.0, 20.0, 0.0};
    turned.q_WB = Quaternion(Eigen::AngleAxisd(2.0, Vector3::UnitZ()));
    by_throttle += std::pow(error_deg(seed, idle) - here_deg, 2);
    by_place += std::pow(error_deg(seed, elsewhere) - here_deg, 2);
    by_heading += std::pow(error_deg(seed, turned) - here_deg, 2);
  }
  // 2, 2 and 2 over sqrt(2), half of 3, and 3 degrees.
  EXPECT_NEAR(std::sqrt(squares / count), std::sqrt(4.0 + 2.0 + 2.0 + 2.25 + 9.0), 0.6);
  EXPECT_NEAR(std::sqrt(by_throttle / count), 1.5, 0.25);
  EXPECT_NEAR(std::sqrt(by_place / count), 3.0 * std::sqrt(2.0), 0.6);
  EXPECT_GT(std::sqrt(by_heading / count), 1.5);
}

/// Means and sigmas of a second of IMU samples at 400 Hz from `from_s` on, after the time before it.
struct Second {
  Sum gyro_z, force_x;
  double tone{}, other{};  ///< Share of force_x at 106 and at 61 Hz.
};
Second second_of(std::uint64_t seed, const VehicleState& state, int from_s) {
  NavigationSensors sensors(products(), seed);
  firmware_if::ImuSample sample;
  Second result;
  std::array<double, 4> wave{};
  for (int k = 0; k < 400 * (from_s + 1); ++k) {
    sensors.sample(MonotonicTime{} + k * core::kMinorFrame, state);
    while (sensors.read(sample) == Status::kOk) {
      if (k < 400 * from_s) continue;
      result.gyro_z.add(sample.angular_rate_B_radps[2]);
      result.force_x.add(sample.specific_force_B_mps2[0]);
      const double t = 2.0 * core::kPi * k / 400.0, x = sample.specific_force_B_mps2[0];
      wave[0] += x * std::sin(106.07 * t);
      wave[1] += x * std::cos(106.07 * t);
      wave[2] += x * std::sin(61.0 * t);
      wave[3] += x * std::cos(61.0 * t);
    }
  }
  result.tone = std::hypot(wave[0], wave[1]) / 200.0;
  result.other = std::hypot(wave[2], wave[3]) / 200.0;
  return result;
}

TEST(ProductImu, ShakesWithItsRotors) {
  VehicleState hovering{}, off{};
  hovering.thrust_ratio.fill(0.5);
  double variance = 0.0, tone = 0.0, other = 0.0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Second s = second_of(seed, hovering, 0);
    variance += s.force_x.result().sigma * s.force_x.result().sigma / 60.0;
    tone += s.tone / 60.0;
    other += s.other / 60.0;
  }
  // Four rotors of 0.75 m/s2 in any direction: a third of the power on this axis; but they turn at the same rate.
  EXPECT_NEAR(std::sqrt(variance), std::sqrt(4.0 * 0.75 * 0.75 / 2.0 / 3.0), 0.12);
  EXPECT_GT(tone, 5.0 * other) << "150 Hz at full thrust is 106 Hz at half of it";
  EXPECT_NEAR(second_of(1, off, 0).force_x.result().sigma, ImuErrors{}.accel_noise_mps2, 0.002)
      << "not with motors off";
}

TEST(ProductImu, HasAScaleAndABiasThatWanders) {
  Sum scale, walk;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    VehicleState turning{};
    turning.w_WB_B = {0.0, 0.0, 2.0};
    const double at_rest = second_of(seed, {}, 0).gyro_z.result().mean;
    scale.add((second_of(seed, turning, 0).gyro_z.result().mean - at_rest) / 2.0);
    walk.add(second_of(seed, {}, 25).gyro_z.result().mean - at_rest);
  }
  EXPECT_NEAR(scale.result().mean, 1.0, 0.0025);
  EXPECT_NEAR(scale.result().sigma, 0.005, 0.0012);
  EXPECT_NEAR(walk.result().sigma, 4e-5 * 5.0, 5e-5);
}

TEST(DelayLine, KeepsTheOrderAndLosesTheOldestWhenFull) {
  DelayLine<int, 4> line;
  for (int i = 0; i < 6; ++i) line.push(i, MonotonicTime{} + i * core::kMinorFrame);
  int item = -1;
  EXPECT_EQ(line.pop(item, MonotonicTime{} + core::kMinorFrame), Status::kNotReady);
  for (int i = 2; i < 6; ++i) {
    ASSERT_EQ(line.pop(item, MonotonicTime{} + 10 * core::kMinorFrame), Status::kOk);
    EXPECT_EQ(item, i);
  }
  EXPECT_EQ(line.pop(item, MonotonicTime{} + 10 * core::kMinorFrame), Status::kNotReady);
}

}  // namespace
}  // namespace roborun::sitl
