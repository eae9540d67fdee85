/// What the runtime and the simulated power module, hook and light make of each other, over the bus.
#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "core/executive/frame_table.hpp"
#include "firmware_if/dronecan/node.hpp"
#include "firmware_if/package_release.hpp"
#include "firmware_if/status_lights.hpp"
#include "platform/sitl/bus/fake_can.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"
#include "platform/sitl/bus/fake_hardpoint.hpp"
#include "platform/sitl/bus/fake_light.hpp"
#include "platform/sitl/bus/fake_power_module.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::sitl {
namespace {

namespace dc = firmware_if::dronecan;
using firmware_if::VehicleState;
using std::chrono::milliseconds;
using std::chrono::seconds;

struct Rig {
  FakeCan bus{1'000'000, 7};
  FakeCanPort& port = bus.port(0);
  firmware_if::TransmitGate gate{{}, port};
  std::array<dc::Reassembler::Session, 32> sessions{};
  dc::Node node{{}, gate, port, sessions};
  FakeGpioOutput line;
  firmware_if::PackageRelease release{{}, gate, &line};
  firmware_if::StatusLights lights{1, gate};
  FakePowerModule power_module{25, bus.port(1)};
  FakeHardpoint hook{{.node_id = 26}, bus.port(2)};
  FakeLight light{27, 1, bus.port(3)};
  FakeLight other_light{28, 2, bus.port(4)};
  MonotonicTime now{seconds{1}};
  double charge_ratio{1.0};
  VehicleState state{VehicleState::kSafe};
  firmware_if::PackageRelease::Input in{
      .wanted = true, .killed = false, .estimated = true, .height_m = 1.0, .speed_mps = 0.1};

  void run(Nanos duration) {
    for (const MonotonicTime end = now + duration; now < end;) {
      gate.beat(now);
      (void)node.step(now, {.cycle_ok = true});
      (void)release.step(now, in);
      lights.step(now, state);
      now += core::kMinorFrame;
      bus.advance(now);
      power_module.step(charge_ratio, now);
      hook.step(now);
      light.step(now);
      other_light.step(now);
    }
  }
  [[nodiscard]] const dc::HardpointStatus& hook_says() const { return node.inbox().hardpoint.message; }
};

TEST(FakePowerModule, SaysTheChargeTenTimesASecondInWholePercentRoundedDown) {
  Rig rig;
  for (const double charge_ratio : {1.0, 0.999, 0.25, 0.2499, 0.1, 0.0}) {
    rig.charge_ratio = charge_ratio;
    rig.run(milliseconds{200});
    EXPECT_EQ(rig.node.inbox().battery.message.state_of_charge_pct, static_cast<int>(100.0 * charge_ratio));
  }
  const std::uint64_t before = rig.node.inbox().battery.count;
  rig.run(seconds{10});
  EXPECT_NEAR(static_cast<double>(rig.node.inbox().battery.count - before), 100.0, 1.0);
  EXPECT_EQ(rig.node.inbox().battery.source_node_id, 25);
  EXPECT_TRUE(rig.node.online(25, rig.now));
}

TEST(FakePowerModule, SaysThatItDoesNotKnowAndFallsSilent) {
  Rig rig;
  for (const double nonsense : {std::numeric_limits<double>::quiet_NaN(), -0.1, 1.1, 1e300}) {
    rig.charge_ratio = nonsense;
    rig.run(milliseconds{200});
    EXPECT_GT(rig.node.inbox().battery.message.state_of_charge_pct, 100) << nonsense;
  }
  rig.power_module.set_silent(true);
  rig.run(milliseconds{10});
  const std::uint64_t before = rig.node.inbox().battery.count;
  rig.run(seconds{4});
  EXPECT_EQ(rig.node.inbox().battery.count, before);
  EXPECT_FALSE(rig.node.online(25, rig.now));
}

TEST(FakeHardpoint, HoldsUntilAllConditionsHaveHeldAndTellsThatThePackageIsGone) {
  Rig rig;
  rig.run(milliseconds{490});
  EXPECT_GE(rig.hook.commands(), 1U) << "it was told to hold";
  EXPECT_TRUE(rig.hook.holds_package());
  EXPECT_EQ(rig.hook_says().status, 1);
  EXPECT_EQ(rig.hook_says().payload_weight, 20.0F);
  rig.run(milliseconds{50});
  EXPECT_TRUE(rig.hook.open());
  EXPECT_FALSE(rig.hook.holds_package());
  EXPECT_EQ(rig.hook_says().status, 0) << "said at once";
  EXPECT_EQ(rig.hook_says().payload_weight, 0.0F);
  rig.in.wanted = false;
  rig.run(milliseconds{100});
  EXPECT_FALSE(rig.hook.open());
  EXPECT_FALSE(rig.hook.holds_package()) << "a closed hook brings nothing back";
  EXPECT_EQ(rig.hook_says().status, 1);
  EXPECT_TRUE(rig.node.online(26, rig.now));
}

TEST(FakeHardpoint, KeepsThePackageOfAnUnsafeOrKilledVehicleAndObeysItsOwnIdOnly) {
  for (int what = 0; what < 4; ++what) {
    Rig rig;
    if (what == 0) rig.in.height_m = 5.0;
    if (what == 1) rig.in.speed_mps = 2.0;
    if (what == 2) rig.in.killed = true;
    if (what == 3) rig.gate.kill();  // the second lock: the interlock knows nothing of it
    rig.run(seconds{3});
    EXPECT_GE(rig.hook.commands(), 1U);
    EXPECT_TRUE(rig.hook.holds_package()) << what;
    EXPECT_EQ(rig.hook_says().payload_weight, 20.0F);
  }
  Rig rig;
  FakeHardpoint other({.node_id = 29, .hardpoint_id = 2}, rig.bus.port(5));
  rig.run(seconds{1});
  other.step(rig.now);
  EXPECT_FALSE(rig.hook.holds_package());
  EXPECT_TRUE(other.holds_package());
  EXPECT_EQ(other.commands(), 0U);
}

TEST(FakeHardpoint, IsOpenedByALaterCommandWhereTheBusLosesTheFirstOnes) {
  Rig rig;
  rig.bus.set_faults({.loss_ratio = 1.0});
  rig.run(seconds{1});
  EXPECT_TRUE(rig.release.open());
  EXPECT_TRUE(rig.hook.holds_package());
  rig.bus.set_faults({});
  rig.run(milliseconds{1100});
  EXPECT_FALSE(rig.hook.holds_package());
}

TEST(FakeLight, ShowsWhatPeopleNearTheVehicleHaveToKnow) {
  Rig rig;
  EXPECT_EQ(rig.light.colour().green, 0) << "dark until it is told";
  rig.run(milliseconds{10});
  EXPECT_EQ(rig.light.colour().green, 63);
  rig.state = VehicleState::kArmed;
  rig.run(milliseconds{60});
  EXPECT_EQ(rig.light.colour().red, 31);
  EXPECT_EQ(rig.light.colour().green, 0);
  rig.state = VehicleState::kFailsafe;
  int red = 0;
  int blue = 0;
  for (int i = 0; i < 20; ++i) {
    rig.run(milliseconds{100});
    red += rig.light.colour().red != 0 ? 1 : 0;
    blue += rig.light.colour().blue != 0 ? 1 : 0;
  }
  EXPECT_GE(red, 8);
  EXPECT_GE(blue, 8);
  EXPECT_EQ(rig.other_light.colour().red, 0) << "was never meant";
}

TEST(FakeNodes, DoNotAllocate) {
  Rig rig;
  const test::NoAllocScope scope;
  rig.run(seconds{2});
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::sitl
