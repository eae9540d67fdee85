#include "platform/sensor_port/port_navigation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "platform/sensor_port/port_bus.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::sensor_port {
namespace {

using test::kNan;
constexpr EarthPlace kZurich{47.3977, 8.5456, 488.0};
constexpr MonotonicTime kStart{Nanos{5'000'000'000}};

/// A device, and the process that writes its port. The clocks of both are those of the machine.
template <typename Device, typename Sample, std::uint32_t kKind>
struct Fed {
  explicit Fed(const char* name) : path(test::scratch(name)) {
    std::remove(path.c_str());
    EXPECT_EQ(writer.open(path, kKind, 0, 64), "");
  }
  void write(Sample sample, Nanos after = Nanos{1'000'000}) {
    at += after;
    sample.at.stamp_ns = at.time_since_epoch().count();
    ++sample.at.sequence;
    EXPECT_TRUE(writer.write(sample));
  }
  std::string path;
  PortWriter writer;
  MonotonicTime at{kStart};
  Device sut;
};

using FedGnss = Fed<PortGnss, roborun_port_gnss, ROBORUN_PORT_GNSS>;
using FedBarometer = Fed<PortBarometer, roborun_port_pressure, ROBORUN_PORT_PRESSURE>;
using FedLines = Fed<PortLines, roborun_port_lines, ROBORUN_PORT_LINES>;

roborun_port_gnss fix_at(const EarthPlace& place) {
  roborun_port_gnss g{};
  g.latitude_deg = place.latitude_deg;
  g.longitude_deg = place.longitude_deg;
  g.height_m = place.height_m;
  g.v_ENU_mps[1] = 2.0;
  g.heading_rad = 1.0;
  g.sigma_horizontal_m = g.sigma_vertical_m = g.sigma_speed_mps = g.sigma_heading_rad = 0.1F;
  return g;
}

TEST(LocalFrameTest, MetresAreThoseOfTheEllipsoid) {
  const LocalFrame frame(kZurich);
  // One second of latitude is 30.87 m at 47.4 degrees, and one of longitude 20.95 m (WGS 84).
  const auto north_m = frame.to_local_m({kZurich.latitude_deg + 1.0 / 3600.0, kZurich.longitude_deg, 488.0});
  EXPECT_NEAR(north_m[1], 30.886, 0.01);
  EXPECT_NEAR(north_m[0], 0.0, 1e-6);
  const auto east_m = frame.to_local_m({kZurich.latitude_deg, kZurich.longitude_deg + 1.0 / 3600.0, 488.0});
  EXPECT_NEAR(east_m[0], 20.97, 0.02);
  EXPECT_NEAR(frame.to_local_m({kZurich.latitude_deg, kZurich.longitude_deg, 500.0})[2], 12.0, 1e-6);
}

TEST(LocalFrameTest, ThereAndBackIsTheSamePlace) {
  for (const EarthPlace& origin : {kZurich, EarthPlace{-33.9, 151.2, 20.0}, EarthPlace{0.0, -179.9999, 0.0},
                                   EarthPlace{89.0, 10.0, 5.0}}) {
    const LocalFrame frame(origin);
    for (const auto& p_m :
         {std::array{0.0, 0.0, 0.0}, std::array{1200.0, -80.0, 10.0}, std::array{-14000.0, 14000.0, 300.0}}) {
      const auto back_m = frame.to_local_m(frame.to_earth(p_m));
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(back_m[i], p_m[i], 1e-3) << origin.latitude_deg;
    }
  }
}

TEST(PortGnssTest, TheWorldBeginsAtTheOriginOrAtTheFirstFix) {
  FedGnss fed("roborun-gnss");
  ASSERT_EQ(fed.sut.open(fed.path, {}), "");
  const EarthPlace there = LocalFrame(kZurich).to_earth({3.0, 4.0, 5.0});
  fed.write(fix_at(kZurich));
  fed.write(fix_at(there));
  firmware_if::GnssFix fix;
  ASSERT_EQ(fed.sut.read(fix), Status::kOk);
  EXPECT_NEAR(fix.p_WB_m[0], 0.0, 1e-6);
  ASSERT_EQ(fed.sut.read(fix), Status::kOk);
  EXPECT_NEAR(fix.p_WB_m[0], 3.0, 1e-3);
  EXPECT_NEAR(fix.p_WB_m[2], 5.0, 1e-3);
  EXPECT_DOUBLE_EQ(fix.v_WB_mps[1], 2.0);
  EXPECT_EQ(fed.sut.read(fix), Status::kNotReady);

  ASSERT_EQ(fed.sut.open(fed.path, {}, there), "");
  fed.write(fix_at(kZurich));
  const test::NoAllocScope no_alloc;
  ASSERT_EQ(fed.sut.read(fix), Status::kOk);
  EXPECT_EQ(no_alloc.count(), 0U);
  EXPECT_NEAR(fix.p_WB_m[1], -4.0, 1e-3);
}

TEST(PortGnssTest, RefusesWhatIsNoFix) {
  FedGnss fed("roborun-gnss");
  ASSERT_EQ(fed.sut.open(fed.path, {}), "");
  firmware_if::GnssFix fix;
  const auto refused = [&](const auto& bend) {
    roborun_port_gnss g = fix_at(kZurich);
    bend(g);
    fed.write(g);
    return fed.sut.read(fix) == Status::kNotReady;
  };
  EXPECT_TRUE(refused([](auto& g) { g.latitude_deg = kNan; }));
  EXPECT_TRUE(refused([](auto& g) { g.latitude_deg = 91.0; }));
  EXPECT_TRUE(refused([](auto& g) { g.height_m = 1e6; }));
  EXPECT_TRUE(refused([](auto& g) { g.v_ENU_mps[2] = kNan; }));
  EXPECT_TRUE(refused([](auto& g) { g.sigma_horizontal_m = -1.0F; }));
  EXPECT_TRUE(refused([](auto& g) { g.sigma_heading_rad = std::numeric_limits<float>::infinity(); }));
  EXPECT_EQ(fed.sut.refusals().values, 6U);
  // A receiver without a heading is one.
  EXPECT_FALSE(refused([](auto& g) { g.heading_rad = kNan; }));
}

TEST(PortBarometerTest, TheWeatherIsGoneWithTheFirstSample) {
  EXPECT_NEAR(pressure_altitude_m(101325.0), 0.0, 1e-9);
  EXPECT_NEAR(pressure_altitude_m(89874.6), 1000.0, 0.3);  // ISO 2533
  FedBarometer fed("roborun-pressure");
  ASSERT_EQ(fed.sut.open(fed.path, {}), "");
  fed.sut.stands_at(2.0);
  roborun_port_pressure p{};
  firmware_if::BarometerSample sample;
  for (const double height_m : {0.0, 10.0}) {
    p.pressure_Pa = pressure_at(700.0 + height_m);
    fed.write(p);
    ASSERT_EQ(fed.sut.read(sample), Status::kOk);
    EXPECT_NEAR(sample.altitude_m, 2.0 + height_m, 1e-6);
  }
  for (const double nothing_Pa : {kNan, 0.0, -5.0, 1e9}) {
    p.pressure_Pa = nothing_Pa;
    fed.write(p);
    EXPECT_EQ(fed.sut.read(sample), Status::kNotReady);
  }
  EXPECT_EQ(fed.sut.refusals().values, 4U);
}

TEST(PortDeviceTest, CountsSilences) {
  FedBarometer fed("roborun-pressure");
  ASSERT_EQ(fed.sut.open(fed.path, {}), "");
  fed.sut.set_patience(Nanos{100'000'000});
  roborun_port_pressure p{};
  p.pressure_Pa = 1e5;
  firmware_if::BarometerSample sample;
  EXPECT_EQ(fed.sut.silences(kStart), 0U);
  for (const Nanos after : {Nanos{1}, Nanos{90'000'000}, Nanos{110'000'000}, Nanos{1}}) {
    fed.write(p, after);
    ASSERT_EQ(fed.sut.read(sample), Status::kOk);
  }
  EXPECT_EQ(fed.sut.silences(fed.at), 1U);
  EXPECT_EQ(fed.sut.silences(fed.at + Nanos{200'000'000}), 2U);
}

TEST(PortDeviceTest, WhatNobodyAskedForIsNoSilence) {
  FedLines fed("roborun-lines");
  ASSERT_EQ(fed.sut.open(fed.path, {}), "");
  for (int i = 0; i < 10; ++i) fed.write({}, Nanos{100'000'000});
  fed.sut.update(fed.at);
  for (int i = 0; i < 10; ++i) fed.write({}, Nanos{100'000'000});
  fed.sut.update(fed.at);
  EXPECT_EQ(fed.sut.reader().counters().dropped, 18U);
  EXPECT_EQ(fed.sut.silences(fed.at), 0U);
}

TEST(PortLinesTest, ALineThatNobodyWritesIsGone) {
  FedLines fed("roborun-lines");
  ASSERT_EQ(fed.sut.open(fed.path, {}), "");
  fed.sut.update(fed.at);
  EXPECT_EQ(fed.sut.kill_closed().active().status(), Status::kIo);
  roborun_port_lines lines{};
  lines.wired = ROBORUN_PORT_KILL_OPEN | ROBORUN_PORT_KILL_CLOSED;
  lines.active = ROBORUN_PORT_KILL_CLOSED | ROBORUN_PORT_OPERATOR;
  fed.write(lines);
  fed.sut.update(fed.at);
  EXPECT_TRUE(fed.sut.kill_closed().active().value());
  EXPECT_FALSE(fed.sut.kill_open().active().value());
  EXPECT_FALSE(fed.sut.hears_operator());  // not wired
  fed.sut.update(fed.at + PortLines::kGoneAfter + Nanos{1});
  EXPECT_EQ(fed.sut.kill_open().active().status(), Status::kIo);
}

TEST(PortCanTest, RefusesWhatIsNoFrame) {
  const std::string path = test::scratch("roborun-can");
  PortWriter writer;
  ASSERT_EQ(writer.open(path, ROBORUN_PORT_CAN, 0, 8), "");
  PortCan sut;
  EXPECT_EQ(sut.state(), firmware_if::CanState::kDetached);
  ASSERT_EQ(sut.listen(path, {}), "");
  roborun_port_can sample{};
  sample.at.stamp_ns = 1;
  sample.size = 9;
  ASSERT_TRUE(writer.write(sample));
  sample.size = 8;
  sample.id = 1U << 29U;
  ASSERT_TRUE(writer.write(sample));
  firmware_if::CanFrame frame;
  EXPECT_EQ(sut.receive(frame), Status::kNotReady);
  EXPECT_EQ(sut.receive(frame), Status::kNotReady);
  EXPECT_EQ(sut.refusals().values, 2U);
  // Who reads too slowly is told what was lost.
  sample.id = 7;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(writer.write(sample));
  ASSERT_EQ(sut.receive(frame), Status::kOk);
  EXPECT_EQ(frame.id, 7U);
  EXPECT_EQ(sut.counters().lost_on_receive, 13U);
}

}  // namespace
}  // namespace roborun::sensor_port
