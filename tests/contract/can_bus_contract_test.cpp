/// The contract of firmware_if::CanBus on every implementation.
/// ROBORUN_TEST_CAN="vcan0,vcan0 can0,can1" adds pairs of kernel interfaces; without it only the simulated
/// bus runs.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "firmware_if/can.hpp"
#include "platform/can/socket_can.hpp"
#include "platform/sensor_port/port_bus.hpp"
#include "platform/sitl/bus/fake_can.hpp"
#include "tests/support/no_alloc_scope.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::firmware_if {
namespace {

/// Two controllers on one bus.
struct Pair {
  virtual ~Pair() = default;
  virtual CanBus& a() = 0;
  virtual CanBus& b() = 0;
  virtual void wait() = 0;  ///< Until what was sent has arrived.
};

class FakePair final : public Pair {
 public:
  CanBus& a() override { return bus_.port(0); }
  CanBus& b() override { return bus_.port(1); }
  void wait() override { bus_.advance(now_ += std::chrono::milliseconds{100}); }
  FakePair() { (void)bus_.port(0), (void)bus_.port(1); }

 private:
  sitl::FakeCan bus_{1'000'000, 1};
  MonotonicTime now_{};
};

class KernelPair final : public Pair {
 public:
  explicit KernelPair(const std::string& names) {
    const std::size_t comma = names.find(',');
    EXPECT_EQ(a_.open(names.substr(0, comma)), "");
    EXPECT_EQ(b_.open(names.substr(comma + 1)), "");
    // On one processor a socket may first read what the test before it sent.
    wait();
    CanFrame frame;
    while (a_.receive(frame) == Status::kOk) {
    }
    while (b_.receive(frame) == Status::kOk) {
    }
  }
  CanBus& a() override { return a_; }
  CanBus& b() override { return b_; }
  void wait() override { std::this_thread::sleep_for(std::chrono::milliseconds{100}); }

 private:
  can::SocketCan a_;
  can::SocketCan b_;
};

/// Two processes' ends of a pair of sensor ports.
class PortPair final : public Pair {
 public:
  PortPair() {
    const std::string there = test::scratch("roborun-there"), back = test::scratch("roborun-back");
    EXPECT_EQ(a_.speak(there, {}), "");
    EXPECT_EQ(b_.speak(back, {}), "");
    EXPECT_EQ(a_.listen(back, {}), "");
    EXPECT_EQ(b_.listen(there, {}), "");
  }
  CanBus& a() override { return a_; }
  CanBus& b() override { return b_; }
  void wait() override {}

 private:
  sensor_port::PortCan a_;
  sensor_port::PortCan b_;
};

std::vector<std::string> buses() {
  std::vector<std::string> out{"fake", "port"};
  const char* names = std::getenv("ROBORUN_TEST_CAN");
  std::istringstream in(names == nullptr ? "" : names);
  for (std::string pair; in >> pair;) out.push_back(pair);
  return out;
}

class CanBusContract : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "fake") {
      pair_ = std::make_unique<FakePair>();
    } else if (GetParam() == "port") {
      pair_ = std::make_unique<PortPair>();
    } else {
      pair_ = std::make_unique<KernelPair>(GetParam());
    }
  }
  std::unique_ptr<Pair> pair_;
};

CanFrame numbered(std::uint32_t number) {
  CanFrame frame;
  frame.id = 0x1004067a;
  frame.size = 8;
  for (unsigned i = 0; i < 4; ++i) frame.data.at(i) = static_cast<std::uint8_t>(number >> (8 * i));
  return frame;
}

TEST_P(CanBusContract, CarriesEveryLengthAndIdentifierBothWays) {
  int carried = 0;
  for (std::uint8_t size = 0; size <= 8; ++size) {
    for (const std::uint32_t id : {0x0U, 0x7ffU, 0x800U, 0x1004067aU, 0x1fffffffU}) {
      CanFrame frame = numbered(id + size);
      frame.id = id;
      frame.size = size;
      for (CanBus* to : {&pair_->b(), &pair_->a()}) {
        CanBus& from = to == &pair_->b() ? pair_->a() : pair_->b();
        ASSERT_EQ(from.send({&frame, 1}), Status::kOk);
        pair_->wait();
        CanFrame got;
        ASSERT_EQ(to->receive(got), Status::kOk) << id << " " << int{size};
        EXPECT_EQ(got.id, id);
        EXPECT_TRUE(std::ranges::equal(got.bytes(), frame.bytes()));
        ++carried;
      }
    }
    if (GetParam() != "fake" && GetParam() != "port" && size == 1)
      size = 7;  // 100 ms each: the ends are enough
  }
  EXPECT_GE(carried, 30);
}

TEST_P(CanBusContract, KeepsTheOrderOfOneSenderAndNeverAnswersItself) {
  for (std::uint32_t i = 0; i < 30; ++i) {
    const CanFrame frame = numbered(i);
    ASSERT_EQ(pair_->a().send({&frame, 1}), Status::kOk);
  }
  pair_->wait();
  CanFrame got;
  for (std::uint32_t i = 0; i < 30; ++i) {
    ASSERT_EQ(pair_->b().receive(got), Status::kOk);
    EXPECT_EQ(got.data[0], i);
  }
  EXPECT_EQ(pair_->b().receive(got), Status::kNotReady);
  EXPECT_EQ(pair_->a().receive(got), Status::kNotReady);
}

TEST_P(CanBusContract, TakesATransferWhole) {
  std::vector<CanFrame> transfer;
  for (std::uint32_t i = 0; i < 55; ++i) transfer.push_back(numbered(i));
  ASSERT_EQ(pair_->a().send(transfer), Status::kOk);
  pair_->wait();
  CanFrame got;
  for (std::uint32_t i = 0; i < 55; ++i) ASSERT_EQ(pair_->b().receive(got), Status::kOk) << i;
}

TEST_P(CanBusContract, RefusesWhatIsNoTransfer) {
  CanFrame frame = numbered(0);
  EXPECT_EQ(pair_->a().send({}), Status::kInvalidArgument);
  EXPECT_EQ(pair_->a().send(std::vector<CanFrame>(CanBus::kMostFrames + 1, frame)), Status::kInvalidArgument);
  frame.id = 0x20000000;
  EXPECT_EQ(pair_->a().send({&frame, 1}), Status::kInvalidArgument);
  frame = numbered(0);
  frame.size = 9;
  EXPECT_EQ(pair_->a().send({&frame, 1}), Status::kInvalidArgument);
  pair_->wait();
  EXPECT_EQ(pair_->b().receive(frame), Status::kNotReady);
}

TEST_P(CanBusContract, NeitherAllocatesNorWaits) {
  const CanFrame frame = numbered(1);
  CanFrame got;
  const test::NoAllocScope scope;
  (void)pair_->a().send({&frame, 1});
  (void)pair_->b().receive(got);
  (void)pair_->a().receive(got);
  EXPECT_EQ(scope.count(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Implementations, CanBusContract, testing::ValuesIn(buses()), [](const auto& made) {
  std::string name = made.param;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
});

}  // namespace
}  // namespace roborun::firmware_if
