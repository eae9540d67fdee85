#include "platform/can/command_meter.hpp"

#include <gtest/gtest.h>

#include "core/executive/frame_table.hpp"
#include "firmware_if/dronecan/transfer.hpp"
#include "platform/sitl/bus/fake_can.hpp"

namespace roborun::sitl {
namespace {

namespace dc = firmware_if::dronecan;

class CommandMeterTest : public ::testing::Test {
 protected:
  template <typename T>
  void say(const T& message, MonotonicTime now) {
    std::array<std::uint8_t, dc::kMaxPayload_bytes<T>> payload{};
    std::array<firmware_if::CanFrame, 8> frames;
    auto size = dc::encode(message, payload);
    auto count = dc::split(
        {.data_type_id = dc::kType<T>.id, .source_node_id = 10, .priority = 4, .transfer_id = id},
        dc::kType<T>.signature, std::span<const std::uint8_t>(payload).first(size.value()), now, frames);
    ASSERT_EQ(node.send(std::span<const firmware_if::CanFrame>(frames).first(count.value())), Status::kOk);
  }
  void command(MonotonicTime now) {
    dc::EscRawCommand raw;
    for (int i = 0; i < 4; ++i) (void)raw.cmd.push_back(100);
    say(raw, now);
    id = static_cast<std::uint8_t>((id + 1) % 32);
  }
  void listen(MonotonicTime until) {
    bus.advance(until);
    firmware_if::CanFrame frame;
    while (esc.receive(frame) == Status::kOk) {
    }
  }
  FakeCan bus{1'000'000, 1};
  can::CommandMeter sut{core::kMinorFrame};
  can::MeteredBus node{bus.port(0), sut};
  can::MeteredBus esc{bus.port(1), sut};
  std::uint8_t id{0};
};

TEST_F(CommandMeterTest, PairsWhatWasSentWithWhatWasHeard) {
  MonotonicTime now{};
  for (int i = 0; i < 1000; ++i, now += core::kMinorFrame) {
    command(now);
    say(dc::NodeStatus{}, now);
    listen(now + core::kMinorFrame);
  }
  EXPECT_EQ(sut.sent(), 1000U) << "and no NodeStatus";
  EXPECT_EQ(sut.heard(), 1000U);
  EXPECT_EQ(sut.lost(), 0U);
  EXPECT_EQ(sut.late(), 0U);
  // 7 bytes of throttles and the tail byte: 131 bits at 1 Mbit/s.
  EXPECT_EQ(sut.age().min(), Nanos{131'000});
  EXPECT_EQ(sut.age().max(), Nanos{131'000});
  EXPECT_EQ(sut.gap().count(), 999U);
  EXPECT_EQ(sut.gap().max(), core::kMinorFrame);
}

TEST_F(CommandMeterTest, CountsWhatTheBusLostAndTheGapItLeft) {
  MonotonicTime now{};
  for (int i = 0; i < 1000; ++i, now += core::kMinorFrame) {
    bus.set_faults({.loss_ratio = i % 10 < 2 ? 1.0 : 0.0});
    command(now);
    listen(now + core::kMinorFrame);
  }
  EXPECT_EQ(sut.sent(), 1000U);
  EXPECT_EQ(sut.heard(), 800U);
  EXPECT_EQ(sut.lost(), 200U);
  EXPECT_EQ(sut.gap().max(), 3 * core::kMinorFrame);
}

TEST_F(CommandMeterTest, CallsLateWhatAnotherOneHasOvertaken) {
  command({});
  bus.advance(MonotonicTime{core::kMinorFrame});
  command(MonotonicTime{core::kMinorFrame} - Nanos{2 * core::kMinorFrame});  // made long before it was sent
  listen(MonotonicTime{2 * core::kMinorFrame});
  EXPECT_EQ(sut.heard(), 2U);
  EXPECT_EQ(sut.late(), 1U);
}

TEST_F(CommandMeterTest, CountsARepetitionOnce) {
  bus.set_faults({.duplicate_ratio = 1.0});
  command({});
  listen(MonotonicTime{core::kMinorFrame});
  EXPECT_EQ(esc.counters().received, 2U);
  EXPECT_EQ(sut.heard(), 1U);
}

TEST_F(CommandMeterTest, CountsAsLostWhatADeadBusSwallowed) {
  bus.set_faults({.loss_ratio = 1.0});
  MonotonicTime now{};
  for (int i = 0; i < 100; ++i, now += core::kMinorFrame) {
    command(now);
    listen(now + core::kMinorFrame);
  }
  EXPECT_EQ(sut.heard(), 0U);
  EXPECT_EQ(sut.lost(), 68U) << "32 may still come";
}

}  // namespace
}  // namespace roborun::sitl
