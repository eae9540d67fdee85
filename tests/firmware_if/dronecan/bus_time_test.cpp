#include "firmware_if/dronecan/bus_time.hpp"

#include <gtest/gtest.h>

namespace roborun::firmware_if::dronecan {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

/// A master whose clock shows `ahead` more than ours, and that says so every half second.
struct Master {
  std::uint8_t node{};
  Nanos ahead{};
  std::uint8_t transfer_id{0};
  std::uint64_t told_usec{0};

  void tell(BusTime& sut, MonotonicTime now) {
    sut.take({.source_node_id = node, .transfer_id = transfer_id}, {told_usec}, now);
    transfer_id = static_cast<std::uint8_t>((transfer_id + 1) % 32);
    told_usec = usec(now);
  }
  [[nodiscard]] std::uint64_t usec(MonotonicTime now) const {
    return static_cast<std::uint64_t>((now + ahead).time_since_epoch() / microseconds{1});
  }
};

constexpr MonotonicTime kNow{Nanos{10'000'000'000}};

TEST(BusTime, IsKnownFromTheSecondMessageOn) {
  BusTime sut;
  Master master{5, milliseconds{123'456}};
  EXPECT_FALSE(sut.local(1000, kNow).has_value());
  master.tell(sut, kNow);
  EXPECT_FALSE(sut.local(master.usec(kNow), kNow).has_value());
  master.tell(sut, kNow + milliseconds{500});
  const MonotonicTime then = kNow + milliseconds{300};
  EXPECT_EQ(sut.local(master.usec(then), kNow + milliseconds{500}), then);
  EXPECT_FALSE(sut.local(0, kNow + milliseconds{500}).has_value()) << "0 is unknown";
}

TEST(BusTime, IsNotKnownAfterTwoSecondsOfSilence) {
  BusTime sut;
  Master master{5, Nanos{0}};
  master.tell(sut, kNow);
  master.tell(sut, kNow + milliseconds{500});
  EXPECT_TRUE(sut.local(1000, kNow + milliseconds{2700}).has_value());
  EXPECT_FALSE(sut.local(1000, kNow + milliseconds{2701}).has_value());
}

/// A message that was lost, or a master that starts again: the time in it is not that of the message before.
TEST(BusTime, BelievesOnlyMessagesThatFollowEachOther) {
  BusTime sut;
  Master master{5, Nanos{0}};
  master.tell(sut, kNow);
  ++master.transfer_id;  // one is lost
  master.tell(sut, kNow + milliseconds{500});
  EXPECT_FALSE(sut.local(1000, kNow + milliseconds{500}).has_value());
  master.tell(sut, kNow + milliseconds{1000});
  EXPECT_TRUE(sut.local(1000, kNow + milliseconds{1000}).has_value());
  BusTime late;
  Master slow{5, Nanos{0}};
  slow.tell(late, kNow);
  slow.tell(late, kNow + milliseconds{1101});
  EXPECT_FALSE(late.local(1000, kNow + milliseconds{1101}).has_value());
}

TEST(BusTime, FollowsTheLeastNodeIdAndAnotherOneWhenItIsSilent) {
  BusTime sut;
  Master low{5, milliseconds{100}}, high{9, milliseconds{900}};
  for (int i = 0; i < 4; ++i) {
    low.tell(sut, kNow + milliseconds{500 * i});
    high.tell(sut, kNow + milliseconds{500 * i + 10});
  }
  MonotonicTime now = kNow + milliseconds{1510};
  EXPECT_EQ(sut.local(low.usec(now), now), now);
  for (int i = 4; i < 12; ++i) high.tell(sut, kNow + milliseconds{500 * i});
  now = kNow + milliseconds{5500};
  EXPECT_EQ(sut.local(high.usec(now), now), now);
  low.tell(sut, now);
  EXPECT_FALSE(sut.local(high.usec(now), now).has_value()) << "the lower one is back, and not known yet";
}

TEST(BusTime, TakesNoTimeThatDoesNotFit) {
  BusTime sut;
  sut.take({.source_node_id = 5, .transfer_id = 0}, {0}, kNow);
  sut.take({.source_node_id = 5, .transfer_id = 1}, {(std::uint64_t{1} << 56U) - 1},
           kNow + milliseconds{500});
  EXPECT_FALSE(sut.local(1000, kNow + milliseconds{500}).has_value());
  sut.take({.source_node_id = 5, .transfer_id = 2}, {std::uint64_t{1} << 52U}, kNow + milliseconds{1000});
  EXPECT_TRUE(sut.local(1000, kNow + milliseconds{1000}).has_value());
  EXPECT_FALSE(sut.local((std::uint64_t{1} << 56U) - 1, kNow + milliseconds{1000}).has_value());
}

}  // namespace
}  // namespace roborun::firmware_if::dronecan
