#include "platform/live/hook_and_light.hpp"

#include <gtest/gtest.h>

#include "core/executive/frame_table.hpp"
#include "platform/sitl/aircraft/simulated_actuators.hpp"
#include "platform/sitl/bus/fake_hardpoint.hpp"
#include "platform/sitl/bus/fake_light.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::live {
namespace {

class HookAndLightTest : public ::testing::Test {
 protected:
  HookAndLightTest() { run(0.3); }
  void run(double seconds) {
    firmware_if::MotorCommand command;
    command.thrust_ratio.fill(0.4);
    const MonotonicTime end = now + from_seconds(seconds);
    while (now < end) {
      now += core::kMinorFrame;
      far_side_.advance(now, 0.9, body_);
      if (has_hook) hook.step(now);
      light.step(now);
      if (flies) (void)motors.command(command);
      motors.step(now);
      sut.is_flown(flown);
      sut.step(now, height_m);
    }
  }
  [[nodiscard]] std::string lacks() const {
    std::vector<Need> needs;
    sut.look(now, needs);
    return needs.at(0).lacks;
  }

  MonotonicTime now{Nanos{1'000'000'000}};
  flight::Flown flown{.estimated = true, .height_m = 1.5, .speed_mps = 0.2};
  std::optional<double> height_m{1.5};
  bool flies{true}, has_hook{true};
  sitl::SimulatedActuators far_side_{1, {}};
  sitl::Vehicle body_{{}, {}, Vector3::Zero(), 1};
  sitl::FakeHardpoint hook{{.node_id = 34}, far_side_.spare_bus(1)};
  sitl::FakeLight light{35, 0, far_side_.spare_bus(2)};
  flight::ActuatorSide motors{core::kMinorFrame, far_side_.bus(), far_side_.kill_open(),
                              far_side_.kill_closed()};
  HookAndLight sut{motors, true};
};

TEST_F(HookAndLightTest, LetsGoWhereAParcelSurvivesItAndClosesAgain) {
  run(3.0);
  EXPECT_TRUE(hook.holds_package());
  EXPECT_GT(hook.commands(), 1U) << "says that it is to hold";
  sut.release();
  run(0.4);
  EXPECT_TRUE(hook.holds_package()) << "not yet steady for half a second";
  run(0.2);
  EXPECT_FALSE(hook.holds_package());
  EXPECT_EQ(sut.released(), 1U);
  height_m = 2.1;  // as a range finder's noise has it
  run(0.3);
  height_m = 1.9;
  run(0.6);
  run(0.5);
  EXPECT_FALSE(hook.open()) << "a second is enough to fall";
  EXPECT_EQ(sut.released(), 1U);
}

TEST_F(HookAndLightTest, KeepsThePackageWhereItWouldBreakOrNobodyKnows) {
  const auto keeps = [&](const char* why) {
    sut.release();
    run(10.5);
    EXPECT_TRUE(hook.holds_package()) << why;
    EXPECT_EQ(sut.released(), 0U) << why;
  };
  for (const double wrong_m : {2.1, test::kNan, test::kInfinity}) {
    height_m = wrong_m;
    keeps("height");
  }
  height_m = 1.5;
  flown.speed_mps = 0.6;
  keeps("speed");
  flown.speed_mps = 0.2;
  flown.estimated = false;
  keeps("no estimate");
  flown.estimated = true;
  run(3.0);
  EXPECT_TRUE(hook.holds_package()) << "what was asked for is over";
  motors.terminate();
  keeps("terminated");
}

TEST_F(HookAndLightTest, WithoutAMeasurementTheHeightOverTheTakeOffCounts) {
  height_m.reset();
  flown.height_m = 2.1;
  sut.release();
  run(2.0);
  EXPECT_TRUE(hook.holds_package());
  flown.height_m = 1.9;
  run(1.0);
  EXPECT_FALSE(hook.holds_package());
}

TEST_F(HookAndLightTest, TheVehicleIsNotReadyWithoutAPackageOnItsHook) {
  EXPECT_EQ(lacks(), "");
  has_hook = false;
  run(3.0);
  EXPECT_NE(lacks().find("no hardpoint.Status on the bus"), std::string::npos);
  has_hook = true;
  sut.release();
  run(1.0);
  EXPECT_EQ(lacks(), "says that it holds nothing: hang the package on it");
}

TEST_F(HookAndLightTest, TheLightIsGreenRedOrBlinksBlue) {
  EXPECT_EQ(light.colour().red, 31);
  flown.acts = true;
  bool red = false, blue = false;
  for (int i = 0; i < 20; ++i) {
    run(0.1);
    red = red || light.colour().red > 0;
    blue = blue || light.colour().blue > 0;
  }
  EXPECT_TRUE(red && blue);
  flies = false;
  motors.disarm();
  run(1.0);
  EXPECT_EQ(light.colour().green, 63);
}

TEST_F(HookAndLightTest, DoesNotAllocate) {
  sut.release();
  const test::NoAllocScope scope;
  run(2.0);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::live
