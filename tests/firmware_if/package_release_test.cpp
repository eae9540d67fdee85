#include "firmware_if/package_release.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "platform/sitl/bus/fake_gpio.hpp"
#include "tests/firmware_if/recording_bus.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct HookRig {
  test::RecordingBus bus;
  TransmitGate gate{{}, bus};
  sitl::FakeGpioOutput line;
  PackageRelease sut{{}, gate, &line};
  MonotonicTime now{seconds{10}};
  PackageRelease::Input in{.wanted = true, .estimated = true, .height_m = 1.0, .speed_mps = 0.1};

  HookRig() { gate.set_node_id(10); }
  void run(Nanos duration) {
    for (const MonotonicTime end = now + duration; now < end; now += milliseconds{10})
      EXPECT_EQ(sut.step(now, in), Status::kOk);
  }
  /// Of all HardpointCommands that left: 0 releases, 1 holds.
  std::vector<int> said() const {
    std::vector<int> out;
    for (const CanFrame& frame : bus.sent) {
      dronecan::HardpointCommand command;
      EXPECT_EQ(dronecan::decode(frame.bytes().first(frame.size - 1U), command), Status::kOk);
      EXPECT_EQ(command.hardpoint_id, 1);
      out.push_back(command.command);
    }
    return out;
  }
};

TEST(PackageRelease, HoldsAndSaysSoOnceASecond) {
  HookRig rig;
  rig.in.wanted = false;
  rig.run(seconds{5});
  EXPECT_EQ(rig.said(), std::vector<int>(5, 1));
  EXPECT_FALSE(rig.line.active());
}

TEST(PackageRelease, LetsGoWhereAllConditionsHaveHeldForHalfASecond) {
  HookRig rig;
  rig.run(milliseconds{500});
  EXPECT_FALSE(rig.sut.open());
  rig.run(milliseconds{10});
  EXPECT_TRUE(rig.sut.open());
  EXPECT_TRUE(rig.line.active());
  rig.in.wanted = false;
  rig.run(milliseconds{100});
  EXPECT_FALSE(rig.line.active());
  EXPECT_EQ(rig.said(), (std::vector{1, 0, 1}));
  EXPECT_EQ(rig.sut.counters().releases, 1U);
}

TEST(PackageRelease, KeepsThePackageWhereOneConditionFails) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<PackageRelease::Input> unsafe{
      {true, true, true, 1.0, 0.1},   {true, false, false, 1.0, 0.1}, {true, false, true, 2.01, 0.1},
      {true, false, true, 1.0, 0.51}, {true, false, true, kNan, 0.1}, {true, false, true, 1.0, kNan},
      {false, false, true, 1.0, 0.1}};
  for (const PackageRelease::Input& in : unsafe) {
    HookRig rig;
    rig.in = in;
    rig.run(seconds{3});
    EXPECT_EQ(rig.said(), std::vector<int>(3, 1));
    EXPECT_EQ(rig.sut.counters().unsafe, in.wanted ? 300U : 0U);
  }
}

TEST(PackageRelease, BeginsToCountAnewAfterAGap) {
  HookRig rig;
  for (int i = 0; i < 10; ++i) {
    rig.in.speed_mps = 0.1;
    rig.run(milliseconds{490});
    rig.in.speed_mps = 3.0;
    rig.run(milliseconds{10});
  }
  EXPECT_EQ(rig.sut.counters().releases, 0U);
}

TEST(PackageRelease, KeepsThePackageOfAKilledVehicle) {
  HookRig rig;
  rig.run(seconds{1});
  ASSERT_TRUE(rig.line.active());
  rig.in.killed = true;
  rig.run(seconds{1});
  EXPECT_FALSE(rig.sut.open());
  EXPECT_FALSE(rig.line.active());
  EXPECT_EQ(rig.said().back(), 1);
  // The gate does not rely on that.
  rig.gate.allow_release(true);
  rig.gate.kill();
  EXPECT_EQ(rig.gate.send(dronecan::HardpointCommand{.hardpoint_id = 1, .command = 0}, rig.now + seconds{1}),
            Status::kInvalidArgument);
}

TEST(PackageRelease, RepeatsWhatTheBusRefusedAndSaysThatTheLineIsGone) {
  HookRig rig;
  rig.bus.answer = Status::kNotReady;
  rig.run(seconds{1});
  EXPECT_GT(rig.sut.counters().refused, 0U);
  rig.bus.answer = Status::kOk;
  rig.run(milliseconds{100});
  EXPECT_EQ(rig.said(), std::vector{0});
  rig.line.remove();
  EXPECT_EQ(rig.sut.step(rig.now, rig.in), Status::kIo);
}

TEST(PackageRelease, TheLimitsThemselvesAreSafeAndADropIsCountedOnce) {
  HookRig rig;
  rig.in.height_m = 2.0;
  rig.in.speed_mps = 0.5;
  rig.run(seconds{3});
  EXPECT_TRUE(rig.sut.open());
  EXPECT_EQ(rig.sut.counters().releases, 1U);
  EXPECT_EQ(rig.sut.counters().unsafe, 0U);
}

TEST(PackageRelease, SpeaksAtOnceAfterTheStartAndAgainAfterExactlyASecond) {
  HookRig rig;
  rig.in.wanted = false;
  std::vector<std::size_t> said;
  for (const milliseconds at : {milliseconds{0}, milliseconds{999}, milliseconds{1000}}) {
    EXPECT_EQ(rig.sut.step(MonotonicTime{at}, rig.in), Status::kOk);
    said.push_back(rig.said().size());
  }
  EXPECT_EQ(said, (std::vector<std::size_t>{1, 1, 2}));
}

TEST(PackageRelease, NeedsNoLine) {
  HookRig rig;
  PackageRelease sut{{}, rig.gate, nullptr};
  EXPECT_EQ(sut.step(rig.now, rig.in), Status::kOk);
}

TEST(PackageRelease, DoesNotAllocate) {
  HookRig rig;
  rig.bus.sent.reserve(8);
  const test::NoAllocScope scope;
  EXPECT_EQ(rig.sut.step(rig.now, rig.in), Status::kOk);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::firmware_if
