#include "platform/live/bus_aircraft.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "core/executive/frame_table.hpp"
#include "platform/live/plant_bus.hpp"
#include "platform/live/plant_ports.hpp"
#include "platform/sitl/aircraft/simulated_actuators.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::live {
namespace {

const sensor_port::EarthPlace kOrigin{47.0, 8.0, 400.0};

/// A vehicle without cameras on the ground: everything it has is on its bus, but its lines.
class Vehicle {
 public:
  Vehicle(const std::string& name, const SensorRig& rig)
      : ports_(name),
        navigation_(rig, ports_, kOrigin, true),
        nodes_(far_side_.spare_bus(), kOrigin, rig.gnss) {
    EXPECT_EQ(bus_.speak(ports_.bus_in(), {}), "");
  }
  /// One minor frame.
  void step() {
    now += core::kMinorFrame;
    far_side_.advance(now, 0.9, vehicle_);
    if (has_nodes) {
      nodes_.step(now, Nanos{0}, vehicle_);
      firmware_if::ImuSample imu;
      imu.stamp = now;
      imu.specific_force_B_mps2 = {0.0, 0.0, 9.81};
      nodes_.say(imu);
      if (++count_ % 40 == 0) {
        firmware_if::GnssFix fix;
        fix.stamp = now;
        fix.heading_rad = heading_rad;
        fix.sigma_horizontal_m = fix.sigma_vertical_m = fix.sigma_speed_mps = fix.sigma_heading_rad = 0.1;
        nodes_.say(fix);
      }
      if (count_ % 8 == 0) nodes_.say(firmware_if::BarometerSample{now, count_, 0.0});
    }
    firmware_if::CanFrame heard;
    while (far_side_.bus().receive(heard) == Status::kOk) (void)bus_.send({&heard, 1});
    navigation_.write_lines(now, lines, gone, Nanos{0});
  }
  MonotonicTime now{Nanos{1'000'000'000}};
  std::uint32_t lines{ROBORUN_PORT_KILL_CLOSED | ROBORUN_PORT_OPERATOR};
  std::uint32_t gone{0};
  double heading_rad{1.0};
  bool has_nodes{true};

 private:
  sensor_port::VehiclePorts ports_;
  NavigationPorts navigation_;
  sensor_port::PortCan bus_;
  sitl::SimulatedActuators far_side_{1, {}};
  SensorNodes nodes_;
  sitl::Vehicle vehicle_{{}, {}, Vector3::Zero(), 1};
  std::uint32_t count_{0};
};

class BusAircraftTest : public ::testing::Test {
 protected:
  void look(int frames) {
    for (int i = 0; i < frames; ++i) {
      vehicle.step();
      needs = sut.look(vehicle.now);
    }
  }
  /// Shows that the kill switch works.
  void prove() {
    vehicle.lines ^= ROBORUN_PORT_KILL_OPEN | ROBORUN_PORT_KILL_CLOSED;
    look(20);
    EXPECT_EQ(lacks("kill switch"), "is pressed: release it");
    vehicle.lines ^= ROBORUN_PORT_KILL_OPEN | ROBORUN_PORT_KILL_CLOSED;
    look(20);
  }
  [[nodiscard]] std::string lacks(const std::string& device) const {
    const auto need =
        std::find_if(needs.begin(), needs.end(), [&](const Need& n) { return n.device == device; });
    return need == needs.end() ? "not in the list" : need->lacks;
  }
  /// All that is missing.
  [[nodiscard]] std::string lacking() const {
    std::string all;
    for (const Need& need : needs)
      if (!need.lacks.empty()) all += (all.empty() ? "" : ", ") + need.device;
    return all;
  }
  /// Throttles are not zero on the bus.
  [[nodiscard]] bool turns() {
    firmware_if::MotorCommand command;
    command.thrust_ratio.fill(0.5);
    for (int i = 0; i < 50; ++i) {
      vehicle.step();
      sut.begin_frame(vehicle.now);
      (void)sut.motors().command(command);
      sut.end_frame(vehicle.now);
    }
    firmware_if::dronecan::Transfer transfer;
    firmware_if::CanFrame frame;
    bool turning = false;
    while (heard_.receive(frame) == Status::kOk) {
      namespace dc = firmware_if::dronecan;
      if (dc::from_can_id(frame.id).data_type_id != dc::kType<dc::EscRawCommand>.id) continue;
      dc::EscRawCommand raw;  // four throttles: one frame
      if (dc::decode(std::span(frame.data).first(frame.size - 1U), raw) == Status::kOk)
        turning = raw.cmd.items[0] > 0;
    }
    return turning;
  }
  static SensorRig no_cameras() { return {}; }

  std::string name = test::scratch("bus_aircraft");
  SensorRig rig = no_cameras();
  Vehicle vehicle{name, rig};
  BusAircraft sut{port_wire(sensor_port::VehiclePorts(name), Nanos{0}),
                  sensor_port::VehiclePorts(name),
                  rig,
                  core::kMinorFrame,
                  Nanos{0},
                  std::nullopt,
                  {},
                  false};
  std::vector<Need> needs;
  sensor_port::PortCan heard_;
};

TEST_F(BusAircraftTest, IsReadyOnceAllIsHeardProvenAndArmedInThisOrder) {
  look(900);
  EXPECT_EQ(lacking(), "kill switch, arming switch");
  EXPECT_EQ(lacks("kill switch"), "was not seen to work: press it, and release it");
  EXPECT_EQ(lacks("arming switch"), "stands on safe");
  prove();
  EXPECT_EQ(lacking(), "arming switch");
  EXPECT_EQ(lacks("arming switch"), "stands on safe: switch it on to fly");
  vehicle.lines |= ROBORUN_PORT_ARM;
  look(5);
  EXPECT_EQ(lacking(), "");
  ASSERT_EQ(heard_.listen(sensor_port::VehiclePorts(name).bus_out(), {}), "");
  EXPECT_TRUE(turns());
}

TEST_F(BusAircraftTest, AnArmingSwitchThatWasOnBeforeIsSwitchedOffFirst) {
  vehicle.lines |= ROBORUN_PORT_ARM;
  look(900);
  prove();
  EXPECT_EQ(lacking(), "arming switch");
  EXPECT_EQ(lacks("arming switch"), "was on before all else was ready: switch it off, and on again");
  vehicle.lines &= ~std::uint32_t{ROBORUN_PORT_ARM};
  look(5);
  vehicle.lines |= ROBORUN_PORT_ARM;
  look(5);
  EXPECT_EQ(lacking(), "");
}

/// One wire that never changes: the contact is stuck, and nothing turns.
TEST_F(BusAircraftTest, ASwitchWithAStuckWireIsNoProof) {
  look(900);
  for (const std::uint32_t stuck : {ROBORUN_PORT_KILL_OPEN, ROBORUN_PORT_KILL_CLOSED}) {
    vehicle.lines ^= stuck;
    look(20);
    EXPECT_EQ(lacks("kill switch"), "does not stand on run: release it, and look at both wires");
    vehicle.lines ^= stuck;
    look(20);
    EXPECT_EQ(lacks("kill switch"), "was not seen to work: press it, and release it");
  }
  ASSERT_EQ(heard_.listen(sensor_port::VehiclePorts(name).bus_out(), {}), "");
  EXPECT_FALSE(turns());
}

TEST_F(BusAircraftTest, APressedSwitchInFlightIsForGood) {
  look(900);
  prove();
  ASSERT_EQ(heard_.listen(sensor_port::VehiclePorts(name).bus_out(), {}), "");
  EXPECT_TRUE(turns());
  vehicle.lines ^= ROBORUN_PORT_KILL_OPEN | ROBORUN_PORT_KILL_CLOSED;
  EXPECT_FALSE(turns());
  vehicle.lines ^= ROBORUN_PORT_KILL_OPEN | ROBORUN_PORT_KILL_CLOSED;
  EXPECT_FALSE(turns());
  look(20);
  EXPECT_FALSE(turns()) << "no look forgets it";
  EXPECT_TRUE(sut.health(vehicle.now).killed);
}

TEST_F(BusAircraftTest, SaysWhichNodeIsMissing) {
  vehicle.has_nodes = false;
  look(900);
  EXPECT_EQ(lacking(), "imu, gnss, heading, pressure, kill switch, arming switch");
  vehicle.has_nodes = true;
  vehicle.heading_rad = std::numeric_limits<double>::quiet_NaN();
  look(900);
  EXPECT_EQ(lacking(), "heading, kill switch, arming switch");
  vehicle.heading_rad = 0.0;
  look(900);
  EXPECT_EQ(lacking(), "kill switch, arming switch");
  vehicle.has_nodes = false;
  look(400);
  EXPECT_EQ(lacks("imu"), "node 30: its newest RawIMU is 1.0 s old: is it alive?");
}

TEST_F(BusAircraftTest, SaysThatNobodyWritesItsLines) {
  std::remove((name + "-lines").c_str());
  look(900);
  EXPECT_EQ(lacks("lines"),
            name +
                "-lines: No such file or directory: start what writes it (operator's link and "
                "switches: nothing of roborun reads a receiver)");
  EXPECT_EQ(lacks("imu"), "");
}

TEST_F(BusAircraftTest, WithoutABusNothingElseIsAskedFor) {
  std::remove((name + "-bus-in").c_str());
  look(10);
  EXPECT_EQ(lacks("bus"), name + "-bus-in: No such file or directory: start what writes it");
  EXPECT_EQ(needs.size(), 2U);
  BusAircraft none(kernel_wire("nocan7", Nanos{0}), sensor_port::VehiclePorts(name), rig, core::kMinorFrame,
                   Nanos{0}, std::nullopt, {}, false);
  EXPECT_NE(none.look(vehicle.now).back().lacks.find("nocan7: "), std::string::npos);
}

TEST_F(BusAircraftTest, HandsOutWhatTheNodesMeasure) {
  look(100);
  vehicle.step();
  sut.begin_frame(vehicle.now);
  firmware_if::ImuSample imu;
  ASSERT_EQ(sut.imu().read(imu), Status::kOk);
  EXPECT_NEAR(imu.specific_force_B_mps2[2], 9.81, 1e-3);
  // What is measured in a minor frame is on the bus in the next one.
  EXPECT_GE(vehicle.now - imu.stamp, Nanos{0});
  EXPECT_LE(vehicle.now - imu.stamp, 2 * core::kMinorFrame);
  int fixes = 0;
  for (int i = 0; i < 400; ++i) {
    vehicle.step();
    sut.begin_frame(vehicle.now);
    while (sut.imu().read(imu) == Status::kOk) {
    }
    firmware_if::GnssFix fix;
    while (sut.gnss().read(fix) == Status::kOk) {
      ++fixes;
      EXPECT_NEAR(fix.heading_rad, 1.0, 2e-3);
    }
  }
  EXPECT_NEAR(fixes, 10, 1);
  const auto all = sut.use(vehicle.now);
  EXPECT_EQ(all.front().device, "imu");
  EXPECT_EQ(all.front().stale, 0U);
}

}  // namespace
}  // namespace roborun::live
