#include "firmware_if/dronecan/node.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "tests/firmware_if/recording_bus.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if::dronecan {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::array<std::uint8_t, 16> kUniqueId{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};

/// Puts frames of a transfer into a bus as another node would.
template <typename T>
void say(test::RecordingBus& bus, const T& message, std::uint8_t source, std::uint8_t transfer_id,
         MonotonicTime now, std::uint8_t destination = 0) {
  std::array<std::uint8_t, kMaxPayload_bytes<T> + 1> payload{};
  auto size = encode(message, payload);
  std::array<CanFrame, 64> frames;
  auto count = split({kType<T>.kind, kType<T>.id, source, destination, 16, transfer_id}, kType<T>.signature,
                     std::span<const std::uint8_t>(payload).first(size.value()), now, frames);
  bus.incoming.insert(bus.incoming.end(), frames.begin(),
                      frames.begin() + static_cast<std::ptrdiff_t>(count.value()));
}

struct Rig {
  test::RecordingBus bus;
  TransmitGate gate{{}, bus};
  std::array<Reassembler::Session, 16> sessions{};
  Node sut;
  MonotonicTime now{seconds{100}};
  std::array<double, 4> thrust{0.1, 0.1, 0.1, 0.1};
  Node::Input in;

  explicit Rig(const Node::Config& config = {.unique_id = kUniqueId}) : sut(config, gate, bus, sessions) {
    in = {.cycle_ok = true, .armed = false, .thrust_ratio = thrust};
  }
  void run(Nanos duration, Nanos period = microseconds{2500}) {
    for (const MonotonicTime end = now + duration; now < end; now += period) {
      if (in.cycle_ok) gate.beat(now);
      EXPECT_EQ(sut.step(now, in), Status::kOk);
    }
  }
  /// What left, put together again.
  template <typename T>
  std::vector<T> sent() const {
    std::vector<Reassembler::Session> memory(32);
    Reassembler reassembler(kAllTypes, memory, 0);
    std::vector<T> out;
    Transfer transfer;
    for (const CanFrame& frame : bus.sent) {
      if (reassembler.receive(frame, transfer) == FrameVerdict::kDelivered &&
          transfer.header.kind == kType<T>.kind && transfer.header.data_type_id == kType<T>.id &&
          (transfer.header.source_node_id == 0) == std::is_same_v<T, Allocation>) {
        EXPECT_EQ(decode(transfer.payload, out.emplace_back()), Status::kOk);
      }
    }
    return out;
  }
};

TEST(Node, SendsNodeStatusOnceASecondFromTheCheckedCycleOnly) {
  Rig rig;
  rig.run(seconds{5});
  const auto statuses = rig.sent<NodeStatus>();
  ASSERT_EQ(statuses.size(), 5U);
  EXPECT_EQ(statuses.back().uptime_sec, 4U);
  rig.bus.sent.clear();
  rig.in.cycle_ok = false;
  rig.run(seconds{5});
  EXPECT_EQ(rig.sent<NodeStatus>().size(), 0U);
}

TEST(Node, CommandsAtAFixedRateAndWithZerosWhileDisarmed) {
  Rig rig;
  rig.run(seconds{1});
  auto commands = rig.sent<EscRawCommand>();
  ASSERT_EQ(commands.size(), 400U);
  for (const EscRawCommand& c : commands) {
    ASSERT_EQ(c.cmd.count, 4);
    for (const std::int16_t v : c.cmd.view()) EXPECT_EQ(v, 0);
  }
  rig.bus.sent.clear();
  ASSERT_EQ(rig.gate.arm_unproven(), Status::kOk);
  rig.in.armed = true;
  rig.run(milliseconds{100});
  commands = rig.sent<EscRawCommand>();
  ASSERT_EQ(commands.size(), 40U);
  EXPECT_EQ(commands.back().cmd.items[2], 819);
  rig.bus.sent.clear();
  rig.in.thrust_ratio = std::span<const double>(rig.thrust).first(3);  // not one an ESC: zeros
  rig.run(microseconds{2500});
  rig.in.thrust_ratio = rig.thrust;
  rig.thrust[0] = std::numeric_limits<double>::quiet_NaN();
  rig.thrust[1] = 2.0;
  rig.run(milliseconds{50});
  commands = rig.sent<EscRawCommand>();
  EXPECT_EQ(commands.front().cmd.items[2], 0);
  EXPECT_EQ(commands.back().cmd.items[0], 0);
  EXPECT_EQ(commands.back().cmd.items[1], 8191);
}

TEST(Node, KeepsAnyRateFrom50To400HzAndDoesNotCatchUp) {
  for (const Nanos period : {milliseconds{20}, milliseconds{5}, milliseconds{3}}) {
    Rig rig({.unique_id = kUniqueId, .command_period = period});
    rig.run(seconds{3});
    const auto wanted = static_cast<double>(Nanos{seconds{3}} / period);
    EXPECT_NEAR(static_cast<double>(rig.sent<EscRawCommand>().size()), wanted, 1.0);
    rig.bus.sent.clear();
    rig.now += seconds{1};  // the lane stood still
    rig.run(period);
    EXPECT_LE(rig.sent<EscRawCommand>().size(), 2U);
  }
}

TEST(Node, SaysTwiceASecondWhetherItIsArmed) {
  Rig rig;
  rig.run(seconds{2});
  ASSERT_EQ(rig.sent<ArmingStatus>().size(), 4U);
  EXPECT_EQ(rig.sent<ArmingStatus>().back().status, 0);
  ASSERT_EQ(rig.gate.arm_unproven(), Status::kOk);
  rig.in.armed = true;
  rig.run(seconds{1});
  EXPECT_EQ(rig.sent<ArmingStatus>().back().status, 255);
}

TEST(Node, AnswersWhoItIs) {
  Rig rig;
  say(rig.bus, GetNodeInfoRequest{}, 55, 7, rig.now, 10);
  say(rig.bus, GetNodeInfoRequest{}, 55, 8, rig.now, 11);  // somebody else is asked
  rig.run(milliseconds{10});
  const auto answers = rig.sent<GetNodeInfoResponse>();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].hardware_version.unique_id, kUniqueId);
  const std::string_view name = "org.roborun";
  EXPECT_TRUE(std::ranges::equal(answers[0].name.view(), name));
  const auto response =
      std::ranges::find_if(rig.bus.sent, [](const CanFrame& f) { return (f.id & 0x80U) != 0; });
  ASSERT_NE(response, rig.bus.sent.end());
  EXPECT_EQ(response->data[7] & 0x1f, 7);
  EXPECT_EQ(from_can_id(response->id).destination_node_id, 55);
}

TEST(Node, HearsEscsBatteryAndHookAndKeepsTheNewest) {
  Rig rig;
  EscStatus esc;
  esc.esc_index = 3;
  esc.rpm = 1234;
  say(rig.bus, esc, 20, 0, rig.now);
  esc.rpm = 2345;
  say(rig.bus, esc, 20, 1, rig.now);
  say(rig.bus, BatteryInfo{.voltage = 44.5F}, 33, 0, rig.now);
  say(rig.bus, HardpointStatus{.hardpoint_id = 1}, 35, 0, rig.now);
  rig.run(milliseconds{10});
  const Inbox& inbox = rig.sut.inbox();
  EXPECT_EQ(inbox.esc[3].message.rpm, 2345);
  EXPECT_EQ(inbox.esc[3].count, 2U);
  EXPECT_EQ(inbox.esc[3].source_node_id, 20);
  EXPECT_EQ(inbox.battery.message.voltage, 44.5F);
  EXPECT_EQ(inbox.hardpoint.count, 1U);
  EXPECT_EQ(rig.sut.counters().transfers, 4U);
}

TEST(Node, CallsANodeOfflineAfterThreeSeconds) {
  Rig rig;
  say(rig.bus, NodeStatus{.health = 1}, 42, 0, rig.now);
  const MonotonicTime heard = rig.now;
  rig.run(seconds{3});
  EXPECT_TRUE(rig.sut.online(42, heard + seconds{3}));
  EXPECT_EQ(rig.sut.counters().went_offline, 0U);
  EXPECT_FALSE(rig.sut.online(42, heard + seconds{3} + Nanos{1}));
  rig.run(milliseconds{10});
  EXPECT_EQ(rig.sut.counters().went_offline, 1U);
  EXPECT_FALSE(rig.sut.online(41, rig.now));
  EXPECT_EQ(rig.sut.status_of(42).message.health, 1);
}

TEST(Node, CountsForeignCommandsAndForeignUseOfItsId) {
  Rig rig;
  EscRawCommand command;
  ASSERT_TRUE(command.cmd.push_back(8191));
  say(rig.bus, command, 66, 0, rig.now);
  say(rig.bus, NodeStatus{}, 10, 0, rig.now);
  rig.run(milliseconds{3});
  EXPECT_EQ(rig.sut.counters().foreign_command, 1U);
  EXPECT_EQ(rig.sut.counters().foreign_node_id, 1U);
  EXPECT_FALSE(rig.sut.online(10, rig.now));
}

TEST(Node, BoundsWhatAStepReads) {
  Rig rig({.unique_id = kUniqueId, .most_frames_a_step = 8});
  for (unsigned i = 0; i < 20; ++i) say(rig.bus, NodeStatus{}, static_cast<std::uint8_t>(20 + i), 0, rig.now);
  rig.run(microseconds{2500});
  EXPECT_EQ(rig.sut.counters().frames, 8U);
  EXPECT_EQ(rig.sut.counters().step_full, 1U);
  rig.run(microseconds{5000});
  EXPECT_EQ(rig.sut.counters().frames, 20U);
}

/// An allocator as the specification has it: answers with what it knows of a unique id, and with a node id
/// once it knows all of it.
TEST(Node, IsGivenAnIdInThreeStagesAndIsSilentBefore) {
  Rig rig({.node_id = 0, .unique_id = kUniqueId});
  std::vector<std::uint8_t> known;
  std::uint8_t transfer_id = 0;
  int requests = 0;
  for (int i = 0; i < 4000 && rig.sut.node_id() == 0; ++i) {
    rig.run(microseconds{2500});
    for (const Allocation& request : rig.sent<Allocation>()) {
      ++requests;
      if (request.first_part_of_unique_id) known.clear();
      known.insert(known.end(), request.unique_id.view().begin(), request.unique_id.view().end());
      Allocation answer;
      for (const std::uint8_t byte : known) ASSERT_TRUE(answer.unique_id.push_back(byte));
      if (known.size() == 16) answer.node_id = 99;
      say(rig.bus, answer, 127, transfer_id++, rig.now);
    }
    if (rig.sut.node_id() != 0) break;
    for (const CanFrame& frame : rig.bus.sent) EXPECT_EQ(from_can_id(frame.id).source_node_id, 0);
    rig.bus.sent.clear();
  }
  EXPECT_EQ(rig.sut.node_id(), 99);
  EXPECT_EQ(requests, 3);
  EXPECT_TRUE(std::ranges::equal(known, kUniqueId));
  rig.run(seconds{1});
  ASSERT_FALSE(rig.bus.sent.empty());
  for (const CanFrame& frame : rig.bus.sent) EXPECT_EQ(from_can_id(frame.id).source_node_id, 99);
}

TEST(Node, DoesNotTakeTheIdOfAnother) {
  Rig rig({.node_id = 0, .unique_id = kUniqueId});
  Allocation answer;
  for (std::uint8_t i = 0; i < 16; ++i)
    ASSERT_TRUE(answer.unique_id.push_back(static_cast<std::uint8_t>(i + (i == 15 ? 2 : 1))));
  answer.node_id = 77;
  say(rig.bus, answer, 127, 0, rig.now);
  rig.run(milliseconds{100});
  EXPECT_EQ(rig.sut.node_id(), 0);
}

TEST(Node, DoesNotAllocate) {
  Rig rig;
  rig.bus.sent.reserve(1000);
  say(rig.bus, GetNodeInfoRequest{}, 55, 7, rig.now, 10);
  say(rig.bus, BatteryInfo{}, 31, 0, rig.now);
  const test::NoAllocScope scope;
  (void)rig.sut.step(rig.now, rig.in);
  EXPECT_EQ(rig.sut.counters().transfers, 2U);
  EXPECT_EQ(scope.count(), 0U);
}

TEST(Node, RefusesAConfigThatCannotWork) {
  EXPECT_EQ(Node::Config{.unique_id = kUniqueId}.validate(), Status::kOk);
  EXPECT_EQ(Node::Config{.node_id = 0}.validate(), Status::kInvalidArgument);
  EXPECT_EQ(Node::Config{.node_id = 128}.validate(), Status::kInvalidArgument);
  EXPECT_EQ((Node::Config{.command_period = milliseconds{21}}.validate()), Status::kInvalidArgument);
  EXPECT_EQ((Node::Config{.command_period = milliseconds{2}}.validate()), Status::kInvalidArgument);
}

TEST(Node, CountsABusThatFailsAndGoesOn) {
  Rig rig;
  rig.bus.hears = Status::kIo;
  EXPECT_EQ(rig.sut.step(rig.now, rig.in), Status::kIo);
  EXPECT_EQ(rig.sut.counters().bus_errors, 1U);
  rig.bus.hears = Status::kOk;
  say(rig.bus, NodeStatus{}, 42, 0, rig.now);
  rig.run(milliseconds{3});
  EXPECT_TRUE(rig.sut.online(42, rig.now));
  EXPECT_EQ(rig.sut.counters().bus_errors, 1U);
}

/// A single frame has no CRC: what is too short for its type comes through to the decoder.
TEST(Node, CountsWhatCannotBeDecodedAndKeepsTheLast) {
  Rig rig;
  const auto stump = [&](std::uint16_t type, std::uint8_t source, std::uint8_t transfer_id) {
    CanFrame frame;
    frame.id = 0x10000000U | std::uint32_t{type} << 8U | source;
    frame.size = 2;
    frame.data[1] = static_cast<std::uint8_t>(0xc0U | transfer_id);
    frame.stamp = rig.now;
    rig.bus.incoming.push_back(frame);
  };
  say(rig.bus, HardpointStatus{.hardpoint_id = 1}, 35, 0, rig.now);
  stump(kType<HardpointStatus>.id, 35, 1);
  rig.run(milliseconds{3});
  EXPECT_EQ(rig.sut.counters().transfers, 2U);
  EXPECT_EQ(rig.sut.counters().not_decoded, 1U);
  EXPECT_EQ(rig.sut.inbox().hardpoint.count, 1U);
  EXPECT_EQ(rig.sut.inbox().hardpoint.message.hardpoint_id, 1);

  Rig without_id({.node_id = 0, .unique_id = kUniqueId});
  CanFrame empty;  // an answer of the allocator with nothing in it
  empty.id = 0x10000000U | std::uint32_t{kType<Allocation>.id} << 8U | 127U;
  empty.size = 1;
  empty.data[0] = 0xc0;
  empty.stamp = without_id.now;
  without_id.bus.incoming.push_back(empty);
  without_id.run(milliseconds{3});
  EXPECT_EQ(without_id.sut.counters().not_decoded, 1U);
  EXPECT_EQ(without_id.sut.node_id(), 0);
}

TEST(Node, TakesNoNoticeOfWhatIsForOthers) {
  Rig rig;
  say(rig.bus, ArmingStatus{}, 20, 0, rig.now);
  say(rig.bus, LightsCommand{}, 20, 0, rig.now);
  rig.run(milliseconds{3});
  EXPECT_EQ(rig.sut.counters().transfers, 0U);
  EXPECT_EQ(rig.sut.counters().not_decoded, 0U);
  EXPECT_EQ(rig.sut.counters().foreign_command, 0U);
}

}  // namespace
}  // namespace roborun::firmware_if::dronecan
