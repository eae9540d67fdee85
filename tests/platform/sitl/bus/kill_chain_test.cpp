/// From the kill switch to the motor: switch -> gate -> frames -> bus -> fake ESC.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "core/executive/frame_table.hpp"
#include "core/random/counter_rng.hpp"
#include "firmware_if/dronecan/node.hpp"
#include "firmware_if/kill_switch.hpp"
#include "platform/sitl/bus/fake_can.hpp"
#include "platform/sitl/bus/fake_esc.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::sitl {
namespace {

namespace dc = firmware_if::dronecan;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

struct Chain {
  FakeCan bus{1'000'000, 5};
  FakeCanPort& port = bus.port(0);
  firmware_if::TransmitGate gate{{}, port};
  std::array<dc::Reassembler::Session, 32> sessions{};
  dc::Node node{{}, gate, port, sessions};
  FakeEsc esc{{.node_id = 21, .index = 0}, bus.port(1)};
  FakeGpioInput open;
  FakeGpioInput closed;
  firmware_if::KillSwitch kill_switch{open, closed};
  std::array<double, 4> thrust{0.5, 0.5, 0.5, 0.5};
  MonotonicTime now{seconds{1}};
  double throttle{0.0};
  bool alive{true};

  Chain() { release(); }
  void press() { open.drive(true, now), closed.drive(false, now); }
  void release() { open.drive(false, now), closed.drive(true, now); }
  void frame() {
    if (alive) {
      if (kill_switch.sample()) gate.kill();
      gate.beat(now);
      (void)node.step(now, {.cycle_ok = true, .armed = true, .thrust_ratio = thrust});
    }
    now += core::kMinorFrame;
    bus.advance(now);
    throttle = esc.step(now);
  }
  void frames(int count) {
    for (int i = 0; i < count; ++i) frame();
  }
  /// Armed, and turning at half throttle.
  void take_off() {
    frames(20);
    ASSERT_EQ(gate.arm_unproven(), Status::kOk);
    frames(20);
    ASSERT_NEAR(throttle, 0.5, 0.001);
  }
};

// The switch is pressed at 1,000 random phases of the frame: the last frame with thrust on the bus is at most
// two frames later, and zeros are sent, not silence.
TEST(KillChain, StopsTheEscWithinTwoFramesInAThousandRandomPhases) {
  core::CounterRng rng(11);
  Nanos worst{0};
  for (int i = 0; i < 1000; ++i) {
    Chain chain;
    chain.take_off();
    chain.frames(static_cast<int>(rng.below(8)));
    // The edge comes somewhere between two samples: after this frame's, before the next one's.
    const Nanos phase{
        static_cast<std::int64_t>(rng.uniform() * static_cast<double>(core::kMinorFrame.count()))};
    const MonotonicTime edge = chain.now - core::kMinorFrame + phase;
    chain.press();
    chain.frames(10);
    ASSERT_EQ(chain.throttle, 0.0);
    const Nanos latency = chain.esc.last_thrust() - edge;
    worst = std::max(worst, latency);
    const std::uint64_t commands = chain.esc.commands();
    chain.release();
    chain.frames(10);
    ASSERT_EQ(chain.throttle, 0.0);  // latched
    ASSERT_EQ(chain.esc.commands(), commands + 10);
  }
  EXPECT_LE(worst, 2 * core::kMinorFrame);
  EXPECT_GT(worst, core::kMinorFrame);
  RecordProperty("worst_us", static_cast<int>(worst.count() / 1000));
}

TEST(KillChain, TreatsBrokenWiresAndLostLinesAsPressed) {
  for (int what = 0; what < 3; ++what) {
    Chain chain;
    chain.take_off();
    if (what == 0) chain.closed.drive(false, chain.now);
    if (what == 1) chain.open.drive(true, chain.now);
    if (what == 2) chain.open.remove();
    chain.frames(5);
    EXPECT_EQ(chain.throttle, 0.0) << what;
    EXPECT_GT(chain.kill_switch.counters().faults, 0U);
  }
}

TEST(KillChain, IgnoresAPulseShorterThanAFrameAndObeysOneOfTwo) {
  Chain chain;
  chain.take_off();
  chain.press();
  chain.frame();
  chain.release();
  chain.frames(10);
  EXPECT_NEAR(chain.throttle, 0.5, 0.001);
  EXPECT_EQ(chain.kill_switch.counters().glitches, 1U);
  chain.press();
  chain.frames(2);
  chain.release();
  chain.frames(2);
  EXPECT_EQ(chain.throttle, 0.0);
}

TEST(KillChain, NeedsResetAndArmingAfterAKill) {
  Chain chain;
  chain.take_off();
  chain.press();
  chain.frames(5);
  EXPECT_EQ(chain.kill_switch.reset(), Status::kNotReady);  // still pressed
  EXPECT_TRUE(chain.kill_switch.proven());
  chain.release();
  chain.frames(5);
  ASSERT_EQ(chain.kill_switch.reset(), Status::kOk);
  ASSERT_EQ(chain.gate.reset_kill(chain.kill_switch), Status::kOk);
  chain.frames(20);
  EXPECT_EQ(chain.throttle, 0.0);
  ASSERT_EQ(chain.gate.arm(chain.kill_switch), Status::kOk);
  chain.frames(20);
  EXPECT_NEAR(chain.throttle, 0.5, 0.001);
}

TEST(KillChain, IsNotProvenBeforeBothPositionsWereSeen) {
  Chain chain;
  chain.frames(5);
  EXPECT_FALSE(chain.kill_switch.proven());
}

TEST(KillChain, LetsTheEscStopByItselfWhenWeDie) {
  Chain chain;
  chain.take_off();
  chain.alive = false;
  chain.frames(79);  // 197.5 ms
  EXPECT_NEAR(chain.throttle, 0.5, 0.001);
  chain.frames(3);
  EXPECT_EQ(chain.throttle, 0.0);
}

TEST(KillChain, SendsNoOldThrottleAfterBusOff) {
  Chain chain;
  chain.take_off();
  chain.port.go_bus_off();
  chain.frames(4);
  chain.thrust.fill(0.25);
  chain.port.recover();
  const std::uint64_t before = chain.esc.commands();
  chain.frame();
  EXPECT_EQ(chain.esc.commands(), before + 1);
  EXPECT_NEAR(chain.throttle, 0.25, 0.001);
}

// A babbling node with the highest priority fills the bus: 7,600 frames/s for ten seconds. Our lane reads
// each of them, bounded a step; with the lowest priority it delays a command by one frame at most and loses
// none.
TEST(KillChain, ReadsEveryFrameOfAFullBus) {
  for (const bool wins : {true, false}) {
    Chain chain;
    FakeCanPort& babbler = chain.bus.port(2);
    chain.take_off();
    const std::uint64_t commands_before = chain.esc.commands();
    const std::uint64_t frames_before = chain.node.counters().frames;
    std::uint64_t offered = 0;
    for (int i = 0; i < 4000; ++i) {
      for (int k = 0; k < 19; ++k) {
        firmware_if::CanFrame f;
        f.id = wins ? 0x00003005U : 0x1f003005U;
        f.size = 8;
        f.data[7] = 0xc0;
        f.stamp = chain.now;
        offered += babbler.send(std::array{f}) == Status::kOk ? 1U : 0U;
      }
      chain.frame();
    }
    chain.frames(20);
    EXPECT_GT(offered, 70'000U);
    EXPECT_EQ(chain.port.counters().lost_on_receive, 0U);
    EXPECT_EQ(chain.node.counters().step_full, 0U);
    EXPECT_GE(chain.node.counters().frames - frames_before, offered - 200);
    if (!wins) {
      EXPECT_GE(chain.esc.commands() - commands_before, 4018U);
    }
  }
}

TEST(KillChain, DoesNotAllocate) {
  Chain chain;
  chain.take_off();
  const test::NoAllocScope scope;
  chain.frames(500);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::sitl
