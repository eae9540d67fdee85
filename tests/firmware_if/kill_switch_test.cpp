/// The switch alone; from it to the motor: tests/platform/sitl/bus/kill_chain_test.cpp.
#include "firmware_if/kill_switch.hpp"

#include <gtest/gtest.h>

#include "platform/sitl/bus/fake_gpio.hpp"

namespace roborun::firmware_if {
namespace {

struct Switch {
  sitl::FakeGpioInput open, closed;
  KillSwitch sut{open, closed};
  MonotonicTime now{};

  bool sample(bool open_active, bool closed_active) {
    now += Nanos{2'500'000};
    open.drive(open_active, now);
    closed.drive(closed_active, now);
    return sut.sample();
  }
  bool run() { return sample(false, true); }
  bool pressed() { return sample(true, false); }
};

TEST(KillSwitch, CountsWhatItSees) {
  Switch s;
  EXPECT_FALSE(s.run());
  EXPECT_FALSE(s.pressed());
  EXPECT_FALSE(s.run());
  EXPECT_FALSE(s.sample(false, false));
  EXPECT_FALSE(s.run());
  EXPECT_EQ(s.sut.counters().samples, 5U);
  EXPECT_EQ(s.sut.counters().pressed, 1U);
  EXPECT_EQ(s.sut.counters().faults, 1U);
  EXPECT_EQ(s.sut.counters().glitches, 2U);
  EXPECT_EQ(s.sut.counters().edges, 1U + 2U + 2U + 1U + 1U);

  EXPECT_FALSE(s.sample(true, true));
  EXPECT_TRUE(s.sample(true, true));
  EXPECT_TRUE(s.run()) << "latched";
  EXPECT_EQ(s.sut.counters().pressed, 1U);
  EXPECT_EQ(s.sut.counters().faults, 3U);
  EXPECT_EQ(s.sut.counters().glitches, 2U) << "what killed is no glitch";
}

TEST(KillSwitch, IsProvenByBothPositionsAndByNothingElse) {
  Switch s;
  EXPECT_FALSE(s.sample(true, true));
  EXPECT_TRUE(s.pressed());
  EXPECT_TRUE(s.pressed());
  EXPECT_FALSE(s.sut.proven()) << "it may stand on pressed for ever";
  EXPECT_EQ(s.sut.reset(), Status::kNotReady);
  EXPECT_TRUE(s.run());
  EXPECT_TRUE(s.sut.proven());
  EXPECT_EQ(s.sut.reset(), Status::kOk);
  EXPECT_FALSE(s.run());

  Switch other;
  EXPECT_FALSE(other.run());
  EXPECT_FALSE(other.run());
  EXPECT_FALSE(other.sut.proven()) << "it may stand on run for ever";
  EXPECT_FALSE(other.pressed());
  EXPECT_TRUE(other.sut.proven());
  EXPECT_FALSE(other.run());
  EXPECT_TRUE(other.sut.proven());
}

TEST(KillSwitch, TakesALineThatIsGoneForPressed) {
  for (const bool open_goes : {true, false}) {
    Switch s;
    EXPECT_FALSE(s.run());
    (open_goes ? s.open : s.closed).remove();
    EXPECT_FALSE(s.run()) << open_goes;
    EXPECT_FALSE(s.sut.released());
    EXPECT_TRUE(s.run()) << open_goes;
    EXPECT_EQ(s.sut.counters().pressed, 0U);
    EXPECT_EQ(s.sut.counters().faults, 2U);
  }
}

/// Has another edge for everybody who asks.
class Chattering final : public GpioInput {
 public:
  explicit Chattering(bool active) noexcept : active_(active) {}
  [[nodiscard]] Result<bool> active() noexcept override { return active_; }
  [[nodiscard]] Status next_edge(GpioEdge& edge) noexcept override {
    edge = {};
    return Status::kOk;
  }

 private:
  bool active_;
};

TEST(KillSwitch, ReadsAtMostSixteenEdgesOfALine) {
  Chattering open(false), closed(true);
  KillSwitch sut(open, closed);
  EXPECT_FALSE(sut.sample());
  EXPECT_EQ(sut.counters().edges, 32U);
}

}  // namespace
}  // namespace roborun::firmware_if
