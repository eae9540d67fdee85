#include "platform/sitl/bus/fake_can.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace roborun::sitl {
namespace {

using firmware_if::CanFrame;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

CanFrame frame(std::uint32_t id, std::uint8_t first, MonotonicTime stamp = {}) {
  CanFrame f;
  f.id = id;
  f.size = 8;
  f.data[0] = first;
  f.stamp = stamp;
  return f;
}

std::vector<CanFrame> drain(FakeCanPort& port) {
  std::vector<CanFrame> out;
  CanFrame f;
  while (port.receive(f) == Status::kOk) out.push_back(f);
  return out;
}

TEST(FakeCan, TakesTheTimeOfItsBits) {
  FakeCan bus(1'000'000, 1);
  FakeCanPort& a = bus.port(0);
  FakeCanPort& b = bus.port(1);
  for (std::uint8_t i = 0; i < 10; ++i) ASSERT_EQ(a.send(std::array{frame(100, i)}), Status::kOk);
  bus.advance(MonotonicTime{microseconds{130}});
  EXPECT_TRUE(drain(b).empty());
  bus.advance(MonotonicTime{microseconds{131 * 4}});  // 131 bits each
  const auto got = drain(b);
  ASSERT_EQ(got.size(), 4U);
  EXPECT_EQ(got[3].stamp, MonotonicTime{microseconds{524}});
  EXPECT_TRUE(drain(a).empty());
}

TEST(FakeCan, LetsTheLowestIdentifierWin) {
  FakeCan bus(1'000'000, 1);
  FakeCanPort& a = bus.port(0);
  FakeCanPort& b = bus.port(1);
  FakeCanPort& listener = bus.port(2);
  ASSERT_EQ(a.send(std::array{frame(300, 1), frame(300, 2)}), Status::kOk);
  ASSERT_EQ(b.send(std::array{frame(200, 3)}), Status::kOk);
  bus.advance(MonotonicTime{milliseconds{1}});
  const auto got = drain(listener);
  ASSERT_EQ(got.size(), 3U);
  EXPECT_EQ(got[0].data[0], 3);
  EXPECT_EQ(got[1].data[0], 1);
  EXPECT_EQ(got[2].data[0], 2);
}

TEST(FakeCan, TakesWholeTransfersOrNone) {
  FakeCan bus(1'000'000, 1);
  FakeCanPort& a = bus.port(0);
  (void)bus.port(1);
  const std::array<CanFrame, 50> transfer{};
  EXPECT_EQ(a.send(transfer), Status::kOk);
  EXPECT_EQ(a.send(transfer), Status::kOk);
  EXPECT_EQ(a.send(transfer), Status::kNotReady);
  EXPECT_EQ(a.counters().sent, 100U);
  EXPECT_EQ(a.counters().refused, 50U);
}

TEST(FakeCan, SendsNothingOldAfterBusOff) {
  FakeCan bus(1'000'000, 1);
  FakeCanPort& a = bus.port(0);
  FakeCanPort& b = bus.port(1);
  ASSERT_EQ(a.send(std::array{frame(1, 1)}), Status::kOk);
  a.go_bus_off();
  EXPECT_EQ(a.state(), firmware_if::CanState::kBusOff);
  EXPECT_EQ(a.send(std::array{frame(1, 2)}), Status::kNotReady);
  bus.advance(MonotonicTime{seconds{1}});
  a.recover();
  ASSERT_EQ(a.send(std::array{frame(1, 3, MonotonicTime{seconds{1}})}), Status::kOk);
  bus.advance(MonotonicTime{seconds{2}});
  const auto got = drain(b);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].data[0], 3);
  EXPECT_EQ(a.counters().flushed, 1U);
}

TEST(FakeCan, IsErrorPassiveWithNobodyToAcknowledge) {
  FakeCan bus(1'000'000, 1);
  FakeCanPort& a = bus.port(0);
  ASSERT_EQ(a.send(std::array{frame(1, 1)}), Status::kOk);
  bus.advance(MonotonicTime{milliseconds{1}});
  EXPECT_EQ(a.state(), firmware_if::CanState::kPassive);
  EXPECT_GT(a.counters().no_acknowledge, 0U);
  EXPECT_EQ(bus.frames(), 0U);
}

TEST(FakeCan, LosesDuplicatesSwapsAndDamagesAsOftenAsAsked) {
  constexpr int kFrames = 20'000;
  const auto run = [](const CanFaults& faults) {
    FakeCan bus(1'000'000, 3);
    bus.set_faults(faults);
    FakeCanPort& a = bus.port(0);
    FakeCanPort& b = bus.port(1);
    std::vector<CanFrame> got;
    for (int i = 0; i < kFrames; ++i) {
      const MonotonicTime now{microseconds{140} * i};
      CanFrame f = frame(1, 0, now);
      f.data[0] = static_cast<std::uint8_t>(i);
      f.data[1] = static_cast<std::uint8_t>(i >> 8);
      EXPECT_EQ(a.send(std::array{f}), Status::kOk);
      bus.advance(now + microseconds{140});
      for (const CanFrame& g : drain(b)) got.push_back(g);
    }
    return got;
  };
  EXPECT_EQ(run({}).size(), std::size_t{kFrames});
  EXPECT_NEAR(static_cast<double>(run({.loss_ratio = 0.1}).size()), 0.9 * kFrames, 200.0);
  EXPECT_NEAR(static_cast<double>(run({.duplicate_ratio = 0.1}).size()), 1.1 * kFrames, 200.0);
  int damaged = 0;
  for (const CanFrame& f : run({.corrupt_ratio = 0.1})) damaged += f.data[2] != 0 || f.data[3] != 0 ? 1 : 0;
  EXPECT_NEAR(damaged, 0.1 * kFrames * 2 / 8, 100.0);
  int swapped = 0;
  int last = -1;
  for (const CanFrame& f : run({.reorder_ratio = 0.1})) {
    const int number = f.data[0] + 256 * f.data[1];
    swapped += number < last ? 1 : 0;
    last = number;
  }
  EXPECT_GT(swapped, 1000);
}

}  // namespace
}  // namespace roborun::sitl
