#include "platform/live/bus_sensors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "platform/live/earth_field.hpp"
#include "tests/firmware_if/recording_bus.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::live {
namespace {

namespace dc = firmware_if::dronecan;
using std::chrono::milliseconds;

using test::kNanF;

/// The nodes of a bus: says what a test wants, at its time.
class Nodes {
 public:
  test::RecordingBus bus;
  MonotonicTime now{Nanos{5'000'000'000}};

  template <typename T>
  void say(const T& message, std::uint8_t node) {
    std::array<std::uint8_t, dc::kMaxPayload_bytes<T>> payload{};
    std::array<firmware_if::CanFrame, 64> frames;
    const auto size = dc::encode(message, payload);
    std::uint8_t& id = transfer_id_.at(node);
    const auto count = dc::split({.data_type_id = dc::kType<T>.id, .source_node_id = node, .transfer_id = id},
                                 dc::kType<T>.signature,
                                 std::span<const std::uint8_t>(payload).first(size.value()), now, frames);
    id = static_cast<std::uint8_t>((id + 1) % 32);
    for (std::size_t i = 0; i < count.value(); ++i) bus.incoming.push_back(frames.at(i));
  }

 private:
  std::array<std::uint8_t, 128> transfer_id_{};  // a node here says one type, or its types in turn
};

dc::RawImu level() {
  dc::RawImu m;
  m.accelerometer_latest = {0.0F, 0.0F, -9.81F};
  return m;
}
dc::GnssFix2 good_fix() {
  dc::GnssFix2 m;
  m.status = 3;
  m.latitude_deg_1e8 = 4'700'000'000;
  m.longitude_deg_1e8 = 800'000'000;
  m.height_ellipsoid_mm = 400'000;
  for (const float v : {0.01F, 0.04F, 0.09F, 0.0025F, 0.0025F, 0.01F}) (void)m.covariance.push_back(v);
  return m;
}

class BusSensorsTest : public ::testing::Test {
 protected:
  template <typename T>
  void hear(const T& message, std::uint8_t node = 30) {
    nodes.now += milliseconds{1};
    nodes.say(message, node);
    sut.hear(nodes.now);
  }
  [[nodiscard]] std::string lacks(const std::string& device) {
    std::vector<Need> needs;
    sut.look(nodes.now, needs);
    const auto need =
        std::find_if(needs.begin(), needs.end(), [&](const Need& n) { return n.device == device; });
    return need == needs.end() ? "not in the list" : need->lacks;
  }
  [[nodiscard]] PortUse use(const std::string& device) const {
    std::vector<PortUse> all;
    sut.use(nodes.now, all);
    return *std::find_if(all.begin(), all.end(), [&](const PortUse& u) { return u.device == device; });
  }
  /// The fix that comes out, if one does within 60 ms.
  [[nodiscard]] bool has_fix() {
    nodes.now += milliseconds{60};
    sut.hear(nodes.now);
    return sut.gnss().read(fix) == Status::kOk;
  }
  Nodes nodes;
  SensorRig rig{};
  BusSensors sut{nodes.bus, rig, std::nullopt};
  firmware_if::ImuSample imu;
  firmware_if::GnssFix fix;
  firmware_if::BarometerSample pressure;
};

TEST_F(BusSensorsTest, TakesTheMeansOverTheIntervalInForwardLeftUp) {
  dc::RawImu m = level();
  m.integration_interval = 0.0025F;
  m.rate_gyro_integral = {0.0025F, 0.005F, 0.0075F};
  m.accelerometer_integral = {0.0025F, 0.005F, -0.0245F};
  hear(m);
  ASSERT_EQ(sut.imu().read(imu), Status::kOk);
  EXPECT_NEAR(imu.angular_rate_B_radps[0], 1.0, 1e-6);
  EXPECT_NEAR(imu.angular_rate_B_radps[1], -2.0, 1e-6);
  EXPECT_NEAR(imu.angular_rate_B_radps[2], -3.0, 1e-6);
  EXPECT_NEAR(imu.specific_force_B_mps2[1], -2.0, 1e-6);
  EXPECT_NEAR(imu.specific_force_B_mps2[2], 9.8, 1e-5);
  EXPECT_EQ(imu.stamp, nodes.now);
  EXPECT_EQ(imu.sequence, 1U);
  EXPECT_EQ(sut.imu().read(imu), Status::kNotReady);
}

TEST_F(BusSensorsTest, TakesTheLatestValuesOfANodeThatDoesNotIntegrate) {
  for (const float interval_s : {0.0F, -1.0F, kNanF, 1e-6F, 0.5F}) {
    dc::RawImu m = level();
    m.integration_interval = interval_s;
    m.accelerometer_integral = {7.0F, 7.0F, 7.0F};
    hear(m);
    ASSERT_EQ(sut.imu().read(imu), Status::kOk) << interval_s;
    EXPECT_NEAR(imu.specific_force_B_mps2[2], 9.81, 0.004) << interval_s;
  }
  dc::RawImu m = level();
  m.integration_interval = 0.0025F;
  m.rate_gyro_integral = {kNanF, 0.0F, 0.0F};
  hear(m);
  ASSERT_EQ(sut.imu().read(imu), Status::kOk);
  EXPECT_NEAR(imu.specific_force_B_mps2[2], 9.81, 0.004);
}

TEST_F(BusSensorsTest, RefusesAnImuThatIsNotFinite) {
  dc::RawImu m = level();
  m.accelerometer_latest[1] = kNanF;
  hear(m);
  EXPECT_EQ(sut.imu().read(imu), Status::kNotReady);
  EXPECT_EQ(lacks("imu"), "node 30: what it says of RawIMU is not finite");
  EXPECT_EQ(use("imu").dropped, 1U);
}

TEST_F(BusSensorsTest, AFixIsEastNorthUpFromTheFirstOne) {
  hear(good_fix());
  ASSERT_TRUE(has_fix());
  EXPECT_NEAR(fix.p_WB_m[0], 0.0, 1e-6);
  EXPECT_TRUE(std::isnan(fix.heading_rad));
  EXPECT_NEAR(fix.sigma_horizontal_m, 0.2, 1e-3);
  EXPECT_NEAR(fix.sigma_vertical_m, 0.3, 1e-3);
  EXPECT_NEAR(fix.sigma_speed_mps, 0.1, 1e-3);
  dc::GnssFix2 m = good_fix();
  m.latitude_deg_1e8 += 1000;  // 1e-5 degrees: 1.11 m north
  m.height_ellipsoid_mm += 2500;
  m.ned_velocity = {1.0F, 2.0F, 3.0F};
  hear(m);
  const MonotonicTime came = nodes.now;
  ASSERT_TRUE(has_fix());
  EXPECT_NEAR(fix.p_WB_m[1], 1.112, 0.002);
  EXPECT_NEAR(fix.p_WB_m[2], 2.5, 1e-3);
  EXPECT_EQ(fix.v_WB_mps, (std::array{2.0, 1.0, -3.0}));
  EXPECT_EQ(fix.stamp, came - BusSensors::kFixAge) << "no master keeps the bus's time";
}

TEST_F(BusSensorsTest, ReadsEveryFormOfACovariance) {
  const auto with = [&](std::size_t count, const auto& value_at) {
    dc::GnssFix2 m = good_fix();
    m.covariance.count = 0;
    for (std::size_t i = 0; i < count; ++i) (void)m.covariance.push_back(value_at(i));
    hear(m);
  };
  with(1, [](std::size_t) { return 0.25F; });
  ASSERT_TRUE(has_fix());
  EXPECT_NEAR(fix.sigma_vertical_m, 0.5, 1e-3);
  const auto diagonal = [](std::size_t row) { return 0.01F * static_cast<float>((row + 1) * (row + 1)); };
  with(36, [&](std::size_t i) { return i % 7 == 0 ? diagonal(i / 7) : 0.0F; });
  ASSERT_TRUE(has_fix());
  EXPECT_NEAR(fix.sigma_horizontal_m, 0.2, 1e-3);
  EXPECT_NEAR(fix.sigma_speed_mps, 0.6, 1e-3);
  with(21, [&](std::size_t i) {
    std::size_t row = 0;
    while (i >= 6 - row) i -= 6 - row++;
    return i == 0 ? diagonal(row) : 0.0F;
  });
  ASSERT_TRUE(has_fix());
  EXPECT_NEAR(fix.sigma_vertical_m, 0.3, 1e-3);
  EXPECT_NEAR(fix.sigma_speed_mps, 0.6, 1e-3);
}

TEST_F(BusSensorsTest, RefusesWhatIsNoFix) {
  const auto refused = [&](const auto& spoil, const std::string& why) {
    dc::GnssFix2 m = good_fix();
    m.sats_used = 4;
    spoil(m);
    hear(m);
    EXPECT_EQ(lacks("gnss"), "node 30: what it says of Fix2 " + why + " (4 satellites)");
    EXPECT_FALSE(has_fix()) << why;
  };
  refused([](dc::GnssFix2& m) { m.status = 2; }, "is no 3D fix");
  refused([](dc::GnssFix2& m) { m.covariance.count = 0; }, "does not state its errors (covariance)");
  refused([](dc::GnssFix2& m) { m.covariance.count = 5; }, "does not state its errors (covariance)");
  refused([](dc::GnssFix2& m) { m.covariance.items[3] = 0.0F; }, "does not state its errors (covariance)");
  refused([](dc::GnssFix2& m) { m.covariance.items[0] = kNanF; }, "does not state its errors (covariance)");
  refused([](dc::GnssFix2& m) { m.latitude_deg_1e8 = 9'100'000'000; }, "is no place on the earth");
  refused([](dc::GnssFix2& m) { m.ned_velocity[2] = kNanF; }, "is not finite");
}

TEST_F(BusSensorsTest, AHeadingBelongsToTheFixBeforeIt) {
  hear(good_fix());
  EXPECT_EQ(sut.gnss().read(fix), Status::kNotReady) << "it waits for its heading";
  hear(dc::GnssHeading{true, true, 0.5F, 0.02F}, 31);
  ASSERT_EQ(sut.gnss().read(fix), Status::kOk);
  EXPECT_NEAR(fix.heading_rad, 0.5 * core::kPi - 0.5, 1e-3)
      << "clockwise from north, counter-clockwise from east";
  EXPECT_NEAR(fix.sigma_heading_rad, 0.02, 1e-4);
  hear(dc::GnssHeading{true, true, 0.9F, 0.02F}, 31);  // of no fix
  hear(good_fix());
  ASSERT_TRUE(has_fix());
  EXPECT_TRUE(std::isnan(fix.heading_rad));
  for (const dc::GnssHeading& bad :
       {dc::GnssHeading{false, true, 0.5F, 0.02F}, dc::GnssHeading{true, true, kNanF, 0.02F},
        dc::GnssHeading{true, true, 100.0F, 0.02F}}) {
    hear(good_fix());
    hear(bad, 31);
    ASSERT_TRUE(has_fix());
    EXPECT_TRUE(std::isnan(fix.heading_rad));
  }
  hear(good_fix());
  hear(dc::GnssHeading{true, false, -3.0F, 0.0F}, 31);
  ASSERT_EQ(sut.gnss().read(fix), Status::kOk);
  EXPECT_NEAR(fix.sigma_heading_rad, 0.05, 1e-6) << "no error stated";
  EXPECT_GE(fix.heading_rad, -core::kPi);
  EXPECT_LE(fix.heading_rad, core::kPi);
}

/// The earth's field where good_fix() is, on a vehicle that is level and looks so far to the left of east.
std::array<float, 3> field_frd(double heading_rad) {
  const Vector3 earth_W = earth_field_gauss(47.0, 8.0);
  const core::SinCos h = core::sin_cos(heading_rad);
  return {static_cast<float>(h.cos * earth_W.x() + h.sin * earth_W.y()),
          static_cast<float>(h.sin * earth_W.x() - h.cos * earth_W.y()), static_cast<float>(-earth_W.z())};
}

TEST_F(BusSensorsTest, AFixHasTheHeadingOfTheMagnetometerAtItsTime) {
  sut.set_up(Vector3::UnitZ());
  hear(good_fix(), 31);
  ASSERT_TRUE(has_fix());
  EXPECT_TRUE(std::isnan(fix.heading_rad)) << "where it is was not known before";
  for (int i = 0; i <= 20; ++i) {  // it turns, 0.05 rad in 10 ms; the fix is kFixAge old
    nodes.now += milliseconds{8};
    hear(dc::MagneticFieldStrength2{.sensor_id = 3, .magnetic_field_ga = field_frd(0.05 * i)}, 31);
    hear(dc::MagneticFieldStrength2{.sensor_id = 4, .magnetic_field_ga = field_frd(-1.0)}, 31);
  }
  hear(good_fix(), 31);
  ASSERT_TRUE(has_fix());
  EXPECT_NEAR(fix.heading_rad, 0.5, 0.03);
  EXPECT_NEAR(fix.sigma_heading_rad, 0.07, 1e-3);
  // Two antennas know better; where they fall silent the magnetometer is there again.
  hear(dc::GnssHeading{true, true, 0.0F, 0.02F}, 31);
  hear(good_fix(), 31);
  ASSERT_TRUE(has_fix());
  EXPECT_TRUE(std::isnan(fix.heading_rad));
  nodes.now += milliseconds{1000};
  hear(dc::MagneticFieldStrength{.magnetic_field_ga = field_frd(0.9)}, 31);
  nodes.now += milliseconds{100};
  hear(good_fix(), 31);
  ASSERT_TRUE(has_fix());
  EXPECT_NEAR(fix.heading_rad, 0.9, 1e-2);
  nodes.now += milliseconds{300};
  hear(good_fix(), 31);
  ASSERT_TRUE(has_fix());
  EXPECT_TRUE(std::isnan(fix.heading_rad)) << "nothing was measured near its time";
}

TEST_F(BusSensorsTest, AMagnetometerIsAskedForTheEarthsField) {
  EXPECT_NE(lacks("heading").find("MagneticFieldStrength (a magnetometer)"), std::string::npos);
  hear(dc::MagneticFieldStrength{.magnetic_field_ga = field_frd(0.5)}, 31);
  EXPECT_EQ(lacks("heading"), "its magnetometer waits for a fix, and for an IMU at rest");
  hear(good_fix(), 31);
  sut.set_up(Vector3::UnitZ());
  hear(dc::MagneticFieldStrength{.magnetic_field_ga = {0.6F, 0.0F, 0.6F}}, 31);
  EXPECT_EQ(
      lacks("heading"),
      "node 31: what it says of MagneticFieldStrength is not the earth's field here: calibrate it, and look "
      "for steel, magnets and cables near it");
  hear(dc::MagneticFieldStrength{.magnetic_field_ga = field_frd(0.5)}, 31);
  EXPECT_EQ(lacks("heading"), "");
  EXPECT_EQ(use("magnetometer").frames, 1U);
  EXPECT_EQ(use("magnetometer").dropped, 1U);
  nodes.now += milliseconds{700};
  EXPECT_NE(lacks("heading").find("its newest MagneticFieldStrength is 0.7 s old"), std::string::npos);
}

TEST_F(BusSensorsTest, ARangeFinderThatLooksDownSaysTheHeight) {
  const auto with = [&](std::uint8_t kind, float range_m, int pitch = -8) {
    dc::RangeMeasurement m;
    m.reading_type = kind;
    m.range = range_m;
    m.beam_orientation_in_body_frame = {{0, static_cast<std::int8_t>(pitch), 0}, true};
    hear(m, 40);
    return sut.height_m(nodes.now);
  };
  EXPECT_EQ(sut.height_m(nodes.now), std::nullopt) << "there is none";
  EXPECT_EQ(with(1, 2.0F, 0), std::nullopt) << "it looks ahead";
  EXPECT_EQ(lacks("range"), "not in the list") << "it need not have one";
  EXPECT_TRUE(std::isnan(*with(1, 2.0F))) << "how it leans is not known";
  sut.set_up(Vector3(0.0, 0.6, 0.8));
  EXPECT_TRUE(std::isnan(*with(1, 2.0F))) << "it looks to the side";
  sut.set_up(Vector3(std::sqrt(1.0 - 0.95 * 0.95), 0.0, 0.95));
  EXPECT_NEAR(*with(1, 2.0F), 1.9, 1e-3);
  EXPECT_NEAR(*with(0, 4.0F), 3.8, 1e-3);
  EXPECT_EQ(*with(2, 0.0F), 0.0);
  EXPECT_EQ(lacks("range"), "");
  EXPECT_EQ(*with(3, 0.0F), test::kInfinity);
  for (const auto& bad : {with(1, kNanF), with(1, -1.0F), with(4, 1.0F)}) EXPECT_TRUE(std::isnan(*bad));
  EXPECT_EQ(lacks("range"), "node 40: what it says of range_sensor.Measurement is of no known kind");
  EXPECT_TRUE(std::isfinite(*with(1, 5.0F)));
  EXPECT_EQ(lacks("range"), "node 40: measures 5.0 m on the ground: it must look down");
  EXPECT_TRUE(std::isnan(*sut.height_m(nodes.now + milliseconds{501})));
  EXPECT_NEAR(*with(1, 7.0F, 0), 4.75, 1e-3) << "one that looks ahead changes nothing";
}

TEST_F(BusSensorsTest, StampsAreTheMessagesOwnOnceTheBusHasATime) {
  const Nanos ahead{77'000'000'000};
  const auto usec = [&](MonotonicTime t) {
    return static_cast<std::uint64_t>((t + ahead).time_since_epoch() / std::chrono::microseconds{1});
  };
  hear(dc::GlobalTimeSync{0}, 3);
  const std::uint64_t first = usec(nodes.now);
  nodes.now += milliseconds{499};
  hear(dc::GlobalTimeSync{first}, 3);
  dc::GnssFix2 m = good_fix();
  nodes.now += milliseconds{200};
  const MonotonicTime measured = nodes.now - milliseconds{150};
  m.timestamp.usec = usec(measured);
  hear(m);
  ASSERT_TRUE(has_fix());
  EXPECT_EQ(fix.stamp, measured);
  // A stamp that cannot be: of the future, or long ago.
  for (const Nanos wrong : {Nanos{milliseconds{5}}, Nanos{-milliseconds{600}}}) {
    nodes.now += milliseconds{150};
    m.timestamp.usec = usec(nodes.now + milliseconds{1} + wrong);
    hear(m);
    const MonotonicTime came = nodes.now;
    ASSERT_TRUE(has_fix());
    EXPECT_EQ(fix.stamp, came - BusSensors::kFixAge);
  }
}

TEST_F(BusSensorsTest, AClockThatGoesBackCostsOneSample) {
  hear(level());
  nodes.now -= milliseconds{50};
  hear(level());
  hear(level());
  EXPECT_EQ(use("imu").frames, 2U);
  EXPECT_EQ(use("imu").dropped, 1U);
}

TEST_F(BusSensorsTest, PressureCountsFromTheFirstOne) {
  hear(dc::StaticPressure{101325.0F, 1.0F});
  ASSERT_EQ(sut.barometer().read(pressure), Status::kOk);
  EXPECT_EQ(pressure.altitude_m, 0.0);
  hear(dc::StaticPressure{101205.0F, 1.0F});
  ASSERT_EQ(sut.barometer().read(pressure), Status::kOk);
  EXPECT_NEAR(pressure.altitude_m, 10.0, 0.05);
  for (const float wrong : {0.0F, -1.0F, kNanF, 2e5F}) {
    hear(dc::StaticPressure{wrong, 1.0F});
    EXPECT_EQ(sut.barometer().read(pressure), Status::kNotReady) << wrong;
  }
}

TEST_F(BusSensorsTest, BelievesOneNodeInFlightAndAnotherOneOnTheGround) {
  hear(level(), 30);
  hear(level(), 40);
  EXPECT_EQ(use("imu").frames, 1U);
  for (int i = 0; i < 1000; ++i) hear(level(), 40);
  EXPECT_EQ(use("imu").frames, 1U) << "nobody looks: it flies";
  EXPECT_EQ(use("imu").stale, 1U);
  EXPECT_EQ(lacks("imu"), "node 30: its newest RawIMU is 1.0 s old: is it alive?");
  hear(level(), 40);
  EXPECT_EQ(use("imu").frames, 2U);
}

TEST_F(BusSensorsTest, SaysWhatIsMissingBeforeAFlight) {
  EXPECT_EQ(lacks("imu"), "no RawIMU on the bus: is its node powered, and told to send it?");
  EXPECT_NE(lacks("heading").find("two antennas"), std::string::npos);
  EXPECT_EQ(lacks("pressure"), "no StaticPressure on the bus: is its node powered, and told to send it?");
  const auto rest = [&](const dc::RawImu& m, int times, Nanos apart) {
    for (int i = 0; i < times; ++i) {
      nodes.now += apart - milliseconds{1};
      hear(m);
      (void)lacks("imu");
    }
  };
  rest(level(), 500, milliseconds{5});
  EXPECT_EQ(lacks("imu"), "");
  rest(level(), 120, milliseconds{20});
  EXPECT_EQ(lacks("imu"), "node 30: RawIMU comes 50 times a second: must be 100 at least");
  dc::RawImu upside_down = level();
  upside_down.accelerometer_latest[2] = 9.81F;
  rest(upside_down, 500, milliseconds{5});
  EXPECT_NE(lacks("imu").find("measures (0.0, 0.0, -9.8) m/s2 forward, left and up at rest"),
            std::string::npos)
      << lacks("imu");
}

TEST_F(BusSensorsTest, WhatOthersSayIsNothing) {
  hear(dc::EscStatus{});
  hear(dc::StaticTemperature{});
  EXPECT_EQ(use("imu").frames + use("gnss").frames + use("pressure").frames, 0U);
  EXPECT_EQ(use("imu").dropped + use("gnss").dropped + use("pressure").dropped, 0U);
}

TEST_F(BusSensorsTest, AVehicleWithoutAReceiverAsksForNone) {
  rig.gnss = GnssModel::kNone;
  BusSensors other(nodes.bus, rig, std::nullopt);
  std::vector<Need> needs;
  other.look(nodes.now, needs);
  EXPECT_EQ(needs.size(), 2U);
}

TEST_F(BusSensorsTest, DoesNotAllocate) {
  nodes.say(level(), 30);
  nodes.say(good_fix(), 31);
  nodes.say(dc::StaticPressure{101325.0F, 1.0F}, 32);
  const test::NoAllocScope scope;
  sut.hear(nodes.now);
  EXPECT_EQ(sut.imu().read(imu), Status::kOk);
  EXPECT_EQ(sut.barometer().read(pressure), Status::kOk);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::live
