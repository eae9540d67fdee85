#include "firmware_if/transmit_gate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/firmware_if/recording_bus.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if {
namespace {

using dronecan::EscRawCommand;
using dronecan::TransferKind;
using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr MonotonicTime at(Nanos t) { return MonotonicTime{t}; }

EscRawCommand throttles(std::initializer_list<std::int16_t> values) {
  EscRawCommand command;
  for (const std::int16_t v : values) EXPECT_TRUE(command.cmd.push_back(v));
  return command;
}

/// A wire of the kill switch.
class Wire final : public GpioInput {
 public:
  explicit Wire(bool active) : level(active) {}
  [[nodiscard]] Result<bool> active() noexcept override { return level; }
  [[nodiscard]] Status next_edge(GpioEdge&) noexcept override { return Status::kNotReady; }
  bool level;
};

/// A switch that stands on "run".
struct Switch {
  Wire open{false}, closed{true};
  KillSwitch sut{open, closed};

  /// Two samples of each position: killed, if it was pressed.
  void turn(bool pressed) {
    open.level = pressed;
    closed.level = !pressed;
    (void)sut.sample();
    (void)sut.sample();
  }
};

struct Rig {
  test::RecordingBus bus;
  TransmitGate sut{{}, bus};
  MonotonicTime now{milliseconds{1000}};

  Rig() { sut.set_node_id(10); }
  /// Sends one command after another 2.5 ms and returns what left.
  EscRawCommand command(std::initializer_list<std::int16_t> values, bool beat = true) {
    now += microseconds{2500};
    if (beat) sut.beat(now);
    EXPECT_EQ(sut.send(throttles(values), now), Status::kOk);
    EscRawCommand out;
    const CanFrame& frame = bus.sent.back();
    EXPECT_EQ(dronecan::decode(frame.bytes().first(frame.size - 1U), out), Status::kOk);
    return out;
  }
};

// Every (kind, type id, priority, has a destination), with and without a node id: exactly the list passes.
TEST(TransmitGate, PassesExactlyItsListOfAll65536TypeIds) {
  std::uint64_t tried = 0;
  std::set<std::tuple<bool, TransferKind, std::uint16_t, std::uint8_t, bool>> passed;
  for (const bool with_id : {false, true}) {
    test::RecordingBus bus;
    TransmitGate sut({}, bus);
    sut.set_node_id(with_id ? 10 : 0);
    MonotonicTime now{};
    for (const TransferKind kind :
         {TransferKind::kMessage, TransferKind::kRequest, TransferKind::kResponse}) {
      for (unsigned type = 0; type <= 0xffff; ++type) {
        for (std::uint8_t priority = 0; priority < 32; ++priority) {
          for (const bool destination : {false, true}) {
            now += std::chrono::seconds{1};  // no rate limit is in the way
            bus.sent.clear();
            // A payload of the right form for what is listed: seven bytes are four throttles or a NodeStatus.
            std::array<std::uint8_t, 7> bytes{};
            bytes[1] = 1;  // a hardpoint that holds
            std::size_t size = 7;
            if (type == 1070) size = 3;
            if (type == 1100) size = 1;
            const dronecan::TransferHeader header{kind,     static_cast<std::uint16_t>(type),
                                                  0,        static_cast<std::uint8_t>(destination ? 42 : 0),
                                                  priority, 0};
            const Status status = sut.send(header, std::span<const std::uint8_t>(bytes).first(size), now);
            ++tried;
            if (status == Status::kOk) {
              ASSERT_EQ(bus.sent.size(), 1U);
              passed.insert({with_id, kind, static_cast<std::uint16_t>(type), priority, destination});
            } else {
              ASSERT_TRUE(bus.sent.empty());
            }
          }
        }
      }
    }
  }
  EXPECT_EQ(tried, 2U * 3U * 65536U * 32U * 2U);
  const std::set<std::tuple<bool, TransferKind, std::uint16_t, std::uint8_t, bool>> wanted{
      {true, TransferKind::kMessage, 1030, 4, false},  {true, TransferKind::kMessage, 1100, 16, false},
      {true, TransferKind::kMessage, 1070, 16, false}, {true, TransferKind::kMessage, 1081, 24, false},
      {true, TransferKind::kMessage, 341, 24, false},  {true, TransferKind::kResponse, 1, 24, true},
      {false, TransferKind::kMessage, 1, 30, false}};
  EXPECT_EQ(passed, wanted);
}

TEST(TransmitGate, SendsZerosUnlessArmedAliveAndNotKilled) {
  Rig rig;
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 0);  // disarmed
  ASSERT_EQ(rig.sut.arm_unproven(), Status::kOk);
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 100);
  rig.now += milliseconds{6};  // with the 2.5 ms of the call: 8.5 ms since the last beat
  EXPECT_EQ(rig.command({100, 100, 100, 100}, false).cmd.items[0], 0);
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 100);
  rig.sut.kill();
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 0);
  EXPECT_EQ(rig.sut.arm_unproven(), Status::kInvalidArgument);
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 0);
  Switch kill_switch;
  kill_switch.turn(false);
  EXPECT_EQ(rig.sut.reset_kill(kill_switch.sut), Status::kOk);
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 0);  // a released switch does not re-arm
  ASSERT_EQ(rig.sut.arm_unproven(), Status::kOk);
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 100);
  rig.sut.disarm();
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 0);
  EXPECT_EQ(rig.sut.counters().zeroed, 6U * 4U);
}

TEST(TransmitGate, ArmsOnlyWithAProvenSwitchOnRun) {
  Rig rig;
  Switch kill_switch;
  EXPECT_EQ(rig.sut.arm(kill_switch.sut), Status::kNotReady) << "never sampled";
  kill_switch.turn(false);
  EXPECT_EQ(rig.sut.arm(kill_switch.sut), Status::kNotReady) << "never pressed: a wire may be stuck";
  kill_switch.turn(true);
  ASSERT_TRUE(kill_switch.sut.proven());
  EXPECT_EQ(rig.sut.arm(kill_switch.sut), Status::kNotReady) << "still pressed";
  kill_switch.turn(false);
  ASSERT_TRUE(kill_switch.sut.released());
  EXPECT_EQ(rig.sut.arm(kill_switch.sut), Status::kInvalidArgument) << "killed, and not reset";
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 0);
  ASSERT_EQ(kill_switch.sut.reset(), Status::kOk);
  EXPECT_EQ(rig.sut.arm(kill_switch.sut), Status::kOk);
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 100);
}

TEST(TransmitGate, ForgetsAKillOnlyWithAReleasedSwitch) {
  Rig rig;
  Switch kill_switch;
  kill_switch.turn(true);
  rig.sut.kill();
  EXPECT_EQ(rig.sut.reset_kill(kill_switch.sut), Status::kNotReady) << "pressed";
  kill_switch.turn(false);
  EXPECT_EQ(rig.sut.reset_kill(kill_switch.sut), Status::kNotReady) << "the switch itself is not reset";
  EXPECT_EQ(rig.sut.arm_unproven(), Status::kInvalidArgument);
  ASSERT_EQ(kill_switch.sut.reset(), Status::kOk);
  ASSERT_EQ(rig.sut.reset_kill(kill_switch.sut), Status::kOk);
  EXPECT_EQ(rig.command({100, 100, 100, 100}).cmd.items[0], 0) << "disarmed until armed again";
  EXPECT_EQ(rig.sut.arm(kill_switch.sut), Status::kOk);
  const Switch never_read;
  EXPECT_EQ(rig.sut.reset_kill(never_read.sut), Status::kNotReady);
}

TEST(TransmitGate, IsNotLiveBeforeItsFirstBeat) {
  Rig rig;
  ASSERT_EQ(rig.sut.arm_unproven(), Status::kOk);
  EXPECT_FALSE(rig.sut.live(MonotonicTime{}));
  rig.sut.beat(MonotonicTime{});
  EXPECT_TRUE(rig.sut.live(MonotonicTime{}));
}

TEST(TransmitGate, RefusesABeatFromTheFuture) {
  Rig rig;
  ASSERT_EQ(rig.sut.arm_unproven(), Status::kOk);
  rig.sut.beat(rig.now + milliseconds{100});
  EXPECT_FALSE(rig.sut.live(rig.now));
  EXPECT_TRUE(rig.sut.live(rig.now + milliseconds{100}));
  EXPECT_TRUE(rig.sut.live(rig.now + microseconds{107'500}));
  EXPECT_FALSE(rig.sut.live(rig.now + microseconds{107'501}));
}

TEST(TransmitGate, ClampsToForwardAndLimitsTheRiseOnly) {
  Rig rig;
  ASSERT_EQ(rig.sut.arm_unproven(), Status::kOk);
  (void)rig.command({0, 0, 0, 0});
  // 2.5 ms of 8191 * 40 per second: 819.
  EscRawCommand out = rig.command({8191, 500, -500, 819});
  EXPECT_EQ(out.cmd.items[0], 819);
  EXPECT_EQ(out.cmd.items[1], 500);
  EXPECT_EQ(out.cmd.items[2], 0);
  EXPECT_EQ(out.cmd.items[3], 819);
  EXPECT_EQ(rig.sut.counters().limited, 2U);
  for (int i = 0; i < 20; ++i) out = rig.command({8191, 8191, 8191, 8191});
  EXPECT_EQ(out.cmd.items[0], 8191);
  out = rig.command({0, 1, 8000, 8191});
  EXPECT_EQ(out.cmd.items[0], 0);
  EXPECT_EQ(out.cmd.items[1], 1);
  EXPECT_EQ(out.cmd.items[2], 8000);
  rig.now += milliseconds{500};  // a pause earns no more than 10 ms of rise
  out = rig.command({8191, 0, 0, 0});
  EXPECT_EQ(out.cmd.items[0], 3276);
}

TEST(TransmitGate, RisesFromZeroWithItsFirstCommand) {
  Rig rig;
  ASSERT_EQ(rig.sut.arm_unproven(), Status::kOk);
  EXPECT_EQ(rig.command({100, 0, 0, 0}).cmd.items[0], 0) << "no time has passed since a command before";
  EXPECT_EQ(rig.command({100, 0, 0, 0}).cmd.items[0], 100);
}

TEST(TransmitGate, RisesAsFastAsItsConfigSays) {
  test::RecordingBus bus;
  TransmitGate sut({.rise_per_s = 1'000'000}, bus);
  sut.set_node_id(10);
  ASSERT_EQ(sut.arm_unproven(), Status::kOk);
  EscRawCommand out;
  for (const int ms : {0, 2}) {
    sut.beat(at(milliseconds{ms}));
    ASSERT_EQ(sut.send(throttles({8191, 8191, 8191, 8191}), at(milliseconds{ms})), Status::kOk);
  }
  const CanFrame& frame = bus.sent.back();
  ASSERT_EQ(dronecan::decode(frame.bytes().first(frame.size - 1U), out), Status::kOk);
  EXPECT_EQ(out.cmd.items[0], 2000);
}

TEST(TransmitGate, WhatTheBusDidNotTakeIsNoThrottleToRiseFrom) {
  Rig rig;
  ASSERT_EQ(rig.sut.arm_unproven(), Status::kOk);
  (void)rig.command({0, 0, 0, 0});
  rig.bus.answer = Status::kNotReady;
  rig.now += microseconds{2500};
  rig.sut.beat(rig.now);
  EXPECT_EQ(rig.sut.send(throttles({8191, 8191, 8191, 8191}), rig.now), Status::kNotReady);
  rig.bus.answer = Status::kOk;
  EXPECT_EQ(rig.command({8191, 8191, 8191, 8191}).cmd.items[0], 819);
}

TEST(TransmitGate, CountsThrottlesThatItTookAway) {
  Rig rig;
  (void)rig.command({0, 5, 0, -7});  // disarmed
  EXPECT_EQ(rig.sut.counters().zeroed, 2U);
  EXPECT_EQ(rig.sut.counters().limited, 0U);
}

TEST(TransmitGate, RefusesAnyOtherNumberOfThrottles) {
  Rig rig;
  for (std::size_t n = 0; n <= 20; ++n) {
    EscRawCommand command;
    for (std::size_t i = 0; i < n; ++i) ASSERT_TRUE(command.cmd.push_back(1));
    rig.now += milliseconds{10};
    EXPECT_EQ(rig.sut.send(command, rig.now), n == 4 ? Status::kOk : Status::kInvalidArgument) << n;
  }
  EXPECT_EQ(rig.bus.sent.size(), 1U);
  EXPECT_EQ(rig.sut.counters().sent, 1U);
  EXPECT_EQ(rig.sut.counters().refused, 20U);
}

TEST(TransmitGate, RefusesAMessageThatIsNotOnItsList) {
  Rig rig;
  EXPECT_EQ(rig.sut.send(dronecan::RawImu{}, rig.now), Status::kInvalidArgument);
  EXPECT_TRUE(rig.bus.sent.empty());
}

TEST(TransmitGate, RefusesMoreBytesThanItsTypeHas) {
  Rig rig;
  const std::array<std::uint8_t, 8> bytes{};
  EXPECT_EQ(
      rig.sut.send({.kind = TransferKind::kMessage, .data_type_id = 341, .priority = 24}, bytes, rig.now),
      Status::kInvalidArgument);
  EXPECT_EQ(
      rig.sut.send({.kind = TransferKind::kMessage, .data_type_id = 1030, .priority = 4}, bytes, rig.now),
      Status::kInvalidArgument)
      << "four throttles and half of one";
}

TEST(TransmitGate, AsksForANodeIdWithoutOneInOneFrame) {
  Rig rig;
  rig.sut.set_node_id(0);
  EXPECT_EQ(rig.sut.send(dronecan::Allocation{}, rig.now), Status::kOk) << "of its own priority";
  const std::array<std::uint8_t, 8> two_frames{};
  rig.now += std::chrono::seconds{1};
  EXPECT_EQ(
      rig.sut.send({.kind = TransferKind::kMessage, .data_type_id = 1, .priority = 30}, two_frames, rig.now),
      Status::kInvalidArgument);
  EXPECT_EQ(rig.bus.sent.size(), 1U);
}

TEST(TransmitGate, AnswersWithTheTransferIdOfTheQuestion) {
  Rig rig;
  const std::array<std::uint8_t, 7> bytes{};
  EXPECT_EQ(rig.sut.send({.kind = TransferKind::kResponse,
                          .data_type_id = 1,
                          .destination_node_id = 42,
                          .priority = 24,
                          .transfer_id = 7},
                         bytes, rig.now),
            Status::kOk);
  EXPECT_EQ(rig.bus.sent.back().data[7] & 0x1fU, 7U);
}

TEST(TransmitGate, KeepsTheRateAndCountsTransferIds) {
  Rig rig;
  unsigned sent = 0;
  for (int us = 0; us < 100'000; us += 500) {
    const Status status = rig.sut.send(throttles({0, 0, 0, 0}), at(microseconds{us}));
    if (status == Status::kOk) {
      EXPECT_EQ(rig.bus.sent.back().data[7] & 0x1fU, sent % 32);
      ++sent;
    } else {
      EXPECT_EQ(status, Status::kNotReady);
    }
  }
  EXPECT_EQ(sent, 50U);  // every 2 ms
  EXPECT_EQ(rig.sut.counters().too_soon, 150U);
}

TEST(TransmitGate, SpendsTheTransferIdWhenTheBusRefuses) {
  Rig rig;
  rig.bus.answer = Status::kNotReady;
  EXPECT_EQ(rig.sut.send(throttles({0, 0, 0, 0}), at(milliseconds{0})), Status::kNotReady);
  rig.bus.answer = Status::kOk;
  EXPECT_EQ(rig.sut.send(throttles({0, 0, 0, 0}), at(milliseconds{10})), Status::kOk);
  EXPECT_EQ(rig.bus.sent.back().data[7] & 0x1fU, 1U);
  EXPECT_EQ(rig.sut.counters().no_room, 1U);
  EXPECT_EQ(rig.sut.counters().sent, 1U);
}

TEST(TransmitGate, HoldsThePackageUntilReleaseIsAllowed) {
  Rig rig;
  const dronecan::HardpointCommand release{.hardpoint_id = 1, .command = 0};
  const dronecan::HardpointCommand hold{.hardpoint_id = 1, .command = 1};
  EXPECT_EQ(rig.sut.send(release, at(milliseconds{0})), Status::kInvalidArgument);
  EXPECT_EQ(rig.sut.send(hold, at(milliseconds{100})), Status::kOk);
  rig.sut.allow_release(true);
  EXPECT_EQ(rig.sut.send(release, at(milliseconds{200})), Status::kOk);
  EXPECT_EQ(rig.bus.sent.size(), 2U);
  const std::array<std::uint8_t, 1> cut{};
  EXPECT_EQ(rig.sut.send({.kind = TransferKind::kMessage, .data_type_id = 1070, .priority = 16}, cut,
                         at(milliseconds{300})),
            Status::kInvalidArgument);
  rig.sut.kill();
  EXPECT_EQ(rig.sut.send(release, at(milliseconds{400})), Status::kInvalidArgument) << "never once killed";
  EXPECT_EQ(rig.sut.send(hold, at(milliseconds{500})), Status::kOk);
}

TEST(TransmitGate, DoesNotAllocate) {
  Rig rig;
  rig.bus.sent.reserve(8);
  const EscRawCommand command = throttles({1, 2, 3, 4});
  const test::NoAllocScope scope;
  EXPECT_EQ(rig.sut.send(command, rig.now), Status::kOk);
  EXPECT_EQ(rig.sut.send(dronecan::NodeStatus{}, rig.now), Status::kOk);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::firmware_if
