#include "platform/live/port_aircraft.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/executive/frame_table.hpp"
#include "firmware_if/dronecan/transfer.hpp"
#include "platform/live/plant_ports.hpp"
#include "platform/sitl/aircraft/simulated_actuators.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::live {
namespace {

/// What writes the ports of a vehicle with one camera, one frame after the other; no world.
class Feeder {
 public:
  explicit Feeder(const std::string& name, const SensorRig& rig)
      : ports_(name), pictures_(rig, {}, ports_), navigation_(rig, ports_, {47.0, 8.0, 400.0}) {
    EXPECT_EQ(bus_.speak(ports_.bus_in(), {}), "");
    frame_.width = rig.cameras[0].width;
    frame_.height = rig.cameras[0].height;
    frame_.tan_half_width = static_cast<float>(rig.cameras[0].tan_half_width);
    frame_.tan_half_height = static_cast<float>(rig.cameras[0].tan_half_height);
    frame_.range_m = static_cast<float>(rig.cameras[0].range_m);
    depth_m_.assign(std::size_t{frame_.width} * frame_.height, 3.0F);
    mount_ = camera_mount(rig.cameras[0].mount);
  }
  /// One minor frame.
  void step() {
    now += core::kMinorFrame;
    ++count_;
    far_side_.advance(now, charge_ratio, vehicle_);
    firmware_if::CanFrame heard;
    while (far_side_.bus().receive(heard) == Status::kOk) {
      if (has_bus) (void)bus_.send({&heard, 1});
    }
    firmware_if::ImuSample imu;
    imu.stamp = now;
    imu.sequence = count_;
    if (has_imu) navigation_.write(imu, Nanos{0});
    firmware_if::GnssFix fix;
    fix.stamp = now;
    fix.p_WB_m = {1.0, 2.0, 0.5};
    fix.sigma_horizontal_m = fix.sigma_vertical_m = fix.sigma_speed_mps = fix.sigma_heading_rad = 0.1;
    navigation_.write(fix, Nanos{0});
    firmware_if::BarometerSample pressure;
    pressure.stamp = now;
    navigation_.write(pressure, Nanos{0});
    navigation_.write_lines(now, lines, 0, Nanos{0});
    frame_.stamp = now;
    frame_.sequence = count_;
    frame_.depth_m = depth_m_;
    if (count_ % 20 == 0) pictures_.write(0, frame_, mount_, Nanos{0});
  }
  MonotonicTime now{Nanos{1'000'000'000}};
  std::uint32_t lines{ROBORUN_PORT_KILL_CLOSED | ROBORUN_PORT_OPERATOR};
  double charge_ratio{0.9};
  bool has_imu{true}, has_bus{true};
  firmware_if::DepthFrame frame_;
  firmware_if::CameraMount mount_;

 private:
  sensor_port::VehiclePorts ports_;
  PicturePorts pictures_;
  NavigationPorts navigation_;
  sensor_port::PortCan bus_;
  sitl::SimulatedActuators far_side_{1, {}};
  sitl::Vehicle vehicle_{{}, {}, Vector3::Zero(), 1};
  std::vector<float> depth_m_;
  std::uint32_t count_{0};
};

SensorRig one_camera() {
  SensorRig rig;
  (void)rig.cameras.push_back(CameraSpec{});
  return rig;
}

class PortAircraftTest : public ::testing::Test {
 protected:
  /// Looks at what is there, while it is written for a second.
  void look() {
    for (int i = 0; i < 400; ++i) {
      feeder.step();
      needs = sut.look(feeder.now);
    }
  }
  [[nodiscard]] std::string lacks(const std::string& device) const {
    const auto need =
        std::find_if(needs.begin(), needs.end(), [&](const Need& n) { return n.device == device; });
    return need == needs.end() ? "not in the list" : need->lacks;
  }
  [[nodiscard]] bool is_ready() const {
    return std::all_of(needs.begin(), needs.end(), [](const Need& n) { return n.lacks.empty(); });
  }
  std::string name = test::scratch("aircraft");
  SensorRig rig = one_camera();
  Feeder feeder{name, rig};
  PortAircraft sut{name, rig, core::kMinorFrame, Nanos{0}, std::nullopt, false};
  std::vector<Need> needs;
};

TEST_F(PortAircraftTest, IsReadyOnceEverythingIsHeard) {
  look();
  EXPECT_TRUE(is_ready()) << lacks("camera 1") << lacks("bus") << lacks("ESCs") << lacks("battery");
  EXPECT_EQ(needs.size(), 10U);
  EXPECT_FALSE(sut.health(feeder.now).killed);
  EXPECT_NEAR(sut.health(feeder.now).battery_ratio, 0.9, 0.011);
}

TEST_F(PortAircraftTest, HasEachImageForBothOfItsReaders) {
  look();
  ASSERT_EQ(sut.watched().size(), 1U);
  EXPECT_EQ(sut.watched()[0]->mount().p_BC_m, feeder.mount_.p_BC_m) << "known before the flight";
  for (int i = 0; i < 20; ++i) feeder.step();
  firmware_if::DepthFrame decision, watch;
  ASSERT_EQ(sut.cameras()[0]->read(decision), Status::kOk);
  ASSERT_EQ(sut.watched()[0]->read(watch), Status::kOk);
  EXPECT_EQ(watch.stamp, decision.stamp);
  EXPECT_EQ(watch.sequence, decision.sequence);
  EXPECT_NE(watch.depth_m.data(), decision.depth_m.data()) << "each in its own memory";
  EXPECT_EQ(sut.watched()[0]->read(watch), Status::kNotReady);
  for (int i = 0; i < 20; ++i) feeder.step();
  EXPECT_EQ(sut.watched()[0]->read(watch), Status::kOk);
  EXPECT_GT(watch.sequence, decision.sequence) << "one does not wait for the other";
  EXPECT_EQ(sut.cameras()[0]->read(decision), Status::kOk);
}

TEST_F(PortAircraftTest, SaysWhichPortIsNotThere) {
  std::remove((name + "-gnss").c_str());
  look();
  EXPECT_EQ(lacks("gnss"), name + "-gnss: No such file or directory: start what writes it");
  EXPECT_EQ(lacks("imu"), "");
}

TEST_F(PortAircraftTest, SaysWhichSensorIsSilent) {
  feeder.has_imu = false;
  look();
  EXPECT_EQ(lacks("imu"), name + "-imu: nothing is written to it: start what writes it");
  feeder.has_imu = true;
  look();
  EXPECT_TRUE(is_ready());
  feeder.has_imu = false;
  look();
  EXPECT_EQ(lacks("imu"), name + "-imu: its newest sample is 1.0 s old: is what writes it alive?");
}

TEST_F(PortAircraftTest, ACameraMustBeTheOneOfTheVehicleFile) {
  feeder.frame_.tan_half_width = 0.5F;
  look();
  EXPECT_NE(lacks("camera 1").find("the vehicle file says 1.00 x 1.00"), std::string::npos)
      << lacks("camera 1");
  feeder.frame_.tan_half_width = 1.0F;
  feeder.frame_.range_m = 5.0F;
  look();
  EXPECT_NE(lacks("camera 1").find("sees 5.0 m far"), std::string::npos);
  feeder.frame_.range_m = 25.0F;
  look();
  EXPECT_EQ(lacks("camera 1"), "");
}

TEST_F(PortAircraftTest, ACameraThatSitsElsewhereIsNotReady) {
  feeder.mount_.p_BC_m[0] += 0.2;
  look();
  EXPECT_NE(lacks("camera 1").find("sits 0.20 m from where the vehicle file says"), std::string::npos);
}

TEST_F(PortAircraftTest, APressedSwitchAndALostOperatorAreSaid) {
  feeder.lines = ROBORUN_PORT_KILL_CLOSED;
  look();
  EXPECT_EQ(lacks("operator"), "is not heard: switch the transmitter on");
  EXPECT_EQ(lacks("kill switch"), "");
  feeder.lines = ROBORUN_PORT_KILL_OPEN | ROBORUN_PORT_OPERATOR;
  look();
  EXPECT_NE(lacks("kill switch"), "");
}

TEST_F(PortAircraftTest, ASilentBusAndAnEmptyBatteryAreSaid) {
  feeder.charge_ratio = 0.1;
  look();
  EXPECT_EQ(lacks("battery"), "10 % left: must be 30 % at least");
  feeder.has_bus = false;
  look();
  EXPECT_NE(lacks("bus").find("its newest sample is"), std::string::npos);
}

}  // namespace
}  // namespace roborun::live
