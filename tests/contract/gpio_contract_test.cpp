/// The contract of firmware_if::GpioInput and GpioOutput, on the simulated lines and, where there is one, on
/// the kernel's gpio-sim, whose far ends the test moves. ROBORUN_TEST_GPIO=LINE (a name or CHIP:OFFSET, idle
/// low) adds a line of another driver, which nobody moves.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "firmware_if/kill_switch.hpp"
#include "platform/gpio/gpiod_line.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"
#include "tests/contract/gpio_sim.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if {
namespace {

constexpr const char* kFake = "fake";
constexpr const char* kGpioSim = "gpio_sim";

std::vector<std::string> gpio_inputs() {
  std::vector<std::string> out{kFake, kGpioSim};
  if (const char* line = std::getenv("ROBORUN_TEST_GPIO"); line != nullptr) out.emplace_back(line);
  return out;
}

std::string label(const testing::TestParamInfo<std::string>& made) {
  return made.param == kFake || made.param == kGpioSim ? made.param : "kernel";
}

MonotonicTime now() {
  timespec t{};
  (void)clock_gettime(CLOCK_MONOTONIC, &t);
  return MonotonicTime{Nanos{std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec}};
}

/// Until the kernel's interrupt threads have passed on what happened.
void settle() { std::this_thread::sleep_for(std::chrono::milliseconds{2}); }

class GpioInputContract : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == kFake) {
      input_ = &fake_;
      return;
    }
    std::string name = GetParam();
    if (name == kGpioSim) {
      if (!test::GpioSim::there()) GTEST_SKIP() << test::GpioSim::kWhyNot;
      name = "contract_input";
      sim_.emplace(std::vector{name});
    }
    ASSERT_EQ(kernel_.open({.name = name}), "");
    input_ = &kernel_;
  }
  void drive(bool active) {
    fake_.drive(active, now());
    if (!sim_) return;
    sim_->drive(0, active);
    settle();
  }

  std::optional<test::GpioSim> sim_;  // Outlives its line.
  gpio::GpiodInput kernel_;
  sitl::FakeGpioInput fake_;
  GpioInput* input_{};
};

TEST_P(GpioInputContract, ReadsALevelAndHasNoEdgeAtFirst) {
  auto level = input_->active();
  ASSERT_TRUE(level.ok());
  EXPECT_FALSE(level.value());
  GpioEdge edge;
  EXPECT_EQ(input_->next_edge(edge), Status::kNotReady);
}

TEST_P(GpioInputContract, DoesNotAllocate) {
  GpioEdge edge;
  const test::NoAllocScope scope;
  EXPECT_TRUE(input_->active().ok());
  (void)input_->next_edge(edge);
  EXPECT_EQ(scope.count(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Implementations, GpioInputContract, testing::ValuesIn(gpio_inputs()), label);

/// Those whose wire the test moves.
using MovedGpioInputContract = GpioInputContract;

TEST_P(MovedGpioInputContract, FollowsTheLevel) {
  for (int i = 1; i <= 6; ++i) {
    drive(i % 2 == 1);
    auto level = input_->active();
    ASSERT_TRUE(level.ok());
    EXPECT_EQ(level.value(), i % 2 == 1);
  }
}

TEST_P(MovedGpioInputContract, HandsOutEdgesInOrderEachWithItsTime) {
  std::array<MonotonicTime, 7> between{};
  for (int i = 1; i <= 6; ++i) {
    between.at(static_cast<std::size_t>(i) - 1) = now();
    drive(i % 2 == 1);
  }
  between.back() = now();
  for (std::size_t i = 0; i < 6; ++i) {
    GpioEdge edge;
    ASSERT_EQ(input_->next_edge(edge), Status::kOk) << i;
    EXPECT_EQ(edge.active, i % 2 == 0);
    EXPECT_GE(edge.stamp, between.at(i));
    EXPECT_LE(edge.stamp, between.at(i + 1));
  }
  GpioEdge edge;
  EXPECT_EQ(input_->next_edge(edge), Status::kNotReady);
}

TEST_P(MovedGpioInputContract, HasNoEdgeWhereTheLevelStays) {
  for (const bool active : {false, true, true}) drive(active);
  GpioEdge edge;
  EXPECT_EQ(input_->next_edge(edge), Status::kOk);
  EXPECT_TRUE(edge.active);
  EXPECT_EQ(input_->next_edge(edge), Status::kNotReady);
}

TEST_P(MovedGpioInputContract, KeepsTheFirstSixteenEdgesAndTheLevel) {
  const MonotonicTime start = now();
  MonotonicTime sixteenth{};
  for (int i = 1; i <= 41; ++i) {
    drive(i % 2 == 1);
    if (i == 16) sixteenth = now();
  }
  GpioEdge edge;
  MonotonicTime last = start;
  for (int i = 1; i <= 16; ++i) {
    ASSERT_EQ(input_->next_edge(edge), Status::kOk) << i;
    EXPECT_EQ(edge.active, i % 2 == 1) << i;
    EXPECT_GE(edge.stamp, last);
    EXPECT_LE(edge.stamp, sixteenth);
    last = edge.stamp;
  }
  EXPECT_EQ(input_->next_edge(edge), Status::kNotReady);
  EXPECT_TRUE(input_->active().value());
  drive(false);
  ASSERT_EQ(input_->next_edge(edge), Status::kOk);
  EXPECT_FALSE(edge.active);
}

TEST_P(MovedGpioInputContract, DoesNotAllocateWhenThereAreEdges) {
  drive(true);
  GpioEdge edge;
  const test::NoAllocScope scope;
  EXPECT_TRUE(input_->active().ok());
  EXPECT_EQ(input_->next_edge(edge), Status::kOk);
  EXPECT_EQ(scope.count(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Implementations, MovedGpioInputContract, testing::Values(kFake, kGpioSim), label);

class GpioOutputContract : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == kFake) {
      output_ = &fake_;
      return;
    }
    if (!test::GpioSim::there()) GTEST_SKIP() << test::GpioSim::kWhyNot;
    sim_.emplace(std::vector<std::string>{"contract_output"});
    ASSERT_EQ(kernel_.open({.name = "contract_output"}), "");
    output_ = &kernel_;
  }
  bool active() { return sim_ ? sim_->high(0) : fake_.active(); }
  void remove() {
    fake_.remove();
    if (sim_) sim_->unplug();
  }

  std::optional<test::GpioSim> sim_;
  gpio::GpiodOutput kernel_;
  sitl::FakeGpioOutput fake_;
  GpioOutput* output_{};
};

TEST_P(GpioOutputContract, IsInactiveAtFirstAndThenWhatItIsSetTo) {
  EXPECT_FALSE(active());
  for (const bool level : {true, true, false, true}) {
    EXPECT_EQ(output_->set(level), Status::kOk);
    EXPECT_EQ(active(), level);
  }
}

TEST_P(GpioOutputContract, DoesNotAllocate) {
  const test::NoAllocScope scope;
  EXPECT_EQ(output_->set(true), Status::kOk);
  EXPECT_EQ(scope.count(), 0U);
}

TEST_P(GpioOutputContract, AnswersIoOnceTheLineIsGone) {
  remove();
  EXPECT_EQ(output_->set(true), Status::kIo);
}

INSTANTIATE_TEST_SUITE_P(Implementations, GpioOutputContract, testing::Values(kFake, kGpioSim), label);

// Not on gpio-sim: Linux 6.1 frees an input's interrupt under its owner when the chip goes (a warning, and a
// leak).
TEST(FakeGpio, AnswersIoOnceTheLineIsGone) {
  sitl::FakeGpioInput sut;
  sut.drive(true, now());
  sut.remove();
  EXPECT_EQ(sut.active().status(), Status::kIo);
  GpioEdge edge;
  EXPECT_EQ(sut.next_edge(edge), Status::kIo);
}

TEST(GpiodLine, NamesTheLineThatIsNotThere) {
  gpio::GpiodInput input;
  EXPECT_NE(input.open({.name = "no_such_line"}).find("'no_such_line'"), std::string::npos);
  EXPECT_EQ(input.active().status(), Status::kIo);
  gpio::GpiodOutput output;
  EXPECT_NE(output.open({.name = "nochip:3"}).find("'nochip:3'"), std::string::npos);
  EXPECT_NE(output.open({.name = "nochip:x"}).find("CHIP:OFFSET"), std::string::npos);
  EXPECT_EQ(output.set(true), Status::kIo);
}

TEST(GpiodLine, IsRefusedToASecondOwnerByName) {
  const char* name = std::getenv("ROBORUN_TEST_GPIO");
  if (name == nullptr) GTEST_SKIP() << "no kernel line: ROBORUN_TEST_GPIO is not set";
  gpio::GpiodInput first;
  ASSERT_EQ(first.open({.name = name}), "");
  gpio::GpiodInput second;
  EXPECT_NE(second.open({.name = name}).find("busy, used by 'roborun'"), std::string::npos);
}

/// What only a real line has: polarity, bias, a name, other owners.
class SimulatedLine : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::GpioSim::there()) GTEST_SKIP() << test::GpioSim::kWhyNot;
    sim_.emplace(std::vector<std::string>{"kill_open", "kill_closed"});
  }
  std::optional<test::GpioSim> sim_;
};

TEST_F(SimulatedLine, IsActiveWhereItIsLowWhenItIsWiredSo) {
  sim_->drive(0, true);
  gpio::GpiodInput sut;
  ASSERT_EQ(sut.open({.name = "kill_open", .active_low = true}), "");
  EXPECT_FALSE(sut.active().value());
  for (const bool active : {true, false}) {
    sim_->drive(0, !active);
    settle();
    EXPECT_EQ(sut.active().value(), active);
    GpioEdge edge;
    ASSERT_EQ(sut.next_edge(edge), Status::kOk);
    EXPECT_EQ(edge.active, active);
  }
}

TEST_F(SimulatedLine, TakesTheLevelOfItsBiasWhereNothingElsePulls) {
  struct Case {
    bool before, active_low;
    GpioBias bias;
    bool high, active;
  };
  for (const Case& c :
       {Case{false, false, GpioBias::kPullUp, true, true},
        Case{true, false, GpioBias::kPullDown, false, false},
        Case{false, true, GpioBias::kPullUp, true, false}, Case{true, true, GpioBias::kPullDown, false, true},
        Case{true, false, GpioBias::kNone, true, true}}) {
    sim_->drive(0, c.before);
    gpio::GpiodInput sut;
    ASSERT_EQ(sut.open({.name = "kill_open", .active_low = c.active_low, .bias = c.bias}), "");
    EXPECT_EQ(sim_->high(0), c.high);
    EXPECT_EQ(sut.active().value(), c.active);
  }
}

TEST_F(SimulatedLine, OutputWiredActiveLowIsHighUntilItIsSet) {
  sim_->drive(0, true);
  gpio::GpiodOutput sut;
  ASSERT_EQ(sut.open({.name = "kill_open", .active_low = true}), "");
  for (const bool active : {false, true, false}) {
    EXPECT_EQ(sut.set(active), Status::kOk);
    EXPECT_EQ(sim_->high(0), !active);
  }
}

TEST_F(SimulatedLine, OutputIsInactiveAgainWhenItsOwnerEnds) {
  auto sut = std::make_unique<gpio::GpiodOutput>();
  ASSERT_EQ(sut->open({.name = "kill_open"}), "");
  ASSERT_EQ(sut->set(true), Status::kOk);
  EXPECT_TRUE(sim_->high(0));
  sut.reset();
  EXPECT_FALSE(sim_->high(0));
}

TEST_F(SimulatedLine, OutputIsInactiveAgainWhenItsOwnerIsKilled) {
  const pid_t owner = fork();
  if (owner == 0) {
    gpio::GpiodOutput output;
    if (!output.open({.name = "kill_open"}).empty() || output.set(true) != Status::kOk) _exit(1);
    pause();
  }
  for (int i = 0; i < 1000 && !sim_->high(0); ++i) settle();
  EXPECT_TRUE(sim_->high(0));
  EXPECT_EQ(kill(owner, SIGKILL), 0);
  EXPECT_EQ(waitpid(owner, nullptr, 0), owner);
  EXPECT_FALSE(sim_->high(0));
}

TEST_F(SimulatedLine, IsRefusedByNameWhenItWasRenamedOrIsMissing) {
  sim_->rename(0, "kill_opne");
  gpio::GpiodInput sut;
  EXPECT_EQ(sut.open({.name = "kill_open"}),
            "line 'kill_open': no chip has a line of this name (roborun gpio list)");
  EXPECT_EQ(sut.active().status(), Status::kIo);
  EXPECT_EQ(gpio::GpiodInput().open({.name = "kill_opne"}), "");
  EXPECT_EQ(gpio::GpiodInput().open({.name = "kill_closed"}), "");
  sim_->unplug();
  EXPECT_NE(sut.open({.name = "kill_closed"}).find("'kill_closed'"), std::string::npos);
}

TEST_F(SimulatedLine, IsRefusedByNameWhenAnotherDriverOwnsIt) {
  sim_->hog("landing_light");
  gpio::GpiodInput input;
  EXPECT_EQ(input.open({.name = "kill_open"}), "line 'kill_open': busy, used by 'landing_light'");
  gpio::GpiodOutput output;
  EXPECT_EQ(output.open({.name = "kill_open"}), "line 'kill_open': busy, used by 'landing_light'");
  EXPECT_EQ(input.open({.name = "kill_closed"}), "");
}

/// A kill switch as a vehicle has it: each contact pulls its line low, an open one leaves it to the pull-up.
class SimulatedKillSwitch : public SimulatedLine {
 protected:
  void SetUp() override {
    SimulatedLine::SetUp();
    if (!sim_) return;
    const auto wired = [](const char* name) {
      return gpio::LineConfig{.name = name, .active_low = true, .bias = GpioBias::kPullUp};
    };
    ASSERT_EQ(open_.open(wired("kill_open")), "");
    ASSERT_EQ(closed_.open(wired("kill_closed")), "");
    wires(true, false);
    (void)sut_.sample();
    (void)sut_.sample();
    ASSERT_EQ(sut_.reset(), Status::kOk);
    start_ = sut_.counters();
  }
  void wires(bool open_high, bool closed_high) {
    sim_->drive(0, open_high);
    sim_->drive(1, closed_high);
    settle();
  }
  void press() { wires(false, true); }
  void release() { wires(true, false); }

  gpio::GpiodInput open_;
  gpio::GpiodInput closed_;
  KillSwitch sut_{open_, closed_};
  KillSwitch::Counters start_;
};

TEST_F(SimulatedKillSwitch, KillsWhenPressedAndIsProvenByIt) {
  EXPECT_FALSE(sut_.sample());
  EXPECT_FALSE(sut_.proven());
  press();
  EXPECT_FALSE(sut_.sample());
  EXPECT_TRUE(sut_.sample());
  EXPECT_TRUE(sut_.proven());
  EXPECT_EQ(sut_.reset(), Status::kNotReady);
  release();
  EXPECT_TRUE(sut_.sample());  // latched
  EXPECT_EQ(sut_.counters().edges - start_.edges, 4U);
  EXPECT_EQ(sut_.counters().pressed, 2U);
  EXPECT_EQ(sut_.counters().faults, start_.faults);
  EXPECT_EQ(sut_.reset(), Status::kOk);
  EXPECT_FALSE(sut_.sample());
}

TEST_F(SimulatedKillSwitch, KillsOnEveryFaultThatMakesTheLinesAgree) {
  // Both high: the wire of the closed contact is broken, or that of the open one, which shows when it is
  // pressed. Both low: the wire of the open contact is shorted, or that of the closed one, which shows when
  // it is pressed.
  for (const bool high : {true, false}) {
    wires(high, high);
    EXPECT_FALSE(sut_.sample());
    EXPECT_TRUE(sut_.sample());
    EXPECT_EQ(sut_.reset(), Status::kNotReady);
    release();
    (void)sut_.sample();
    ASSERT_EQ(sut_.reset(), Status::kOk);
  }
  EXPECT_EQ(sut_.counters().faults - start_.faults, 4U);
  EXPECT_EQ(sut_.counters().pressed, 0U);
  EXPECT_FALSE(sut_.proven());
}

TEST_F(SimulatedKillSwitch, ForgivesOneSample) {
  press();
  EXPECT_FALSE(sut_.sample());
  release();
  EXPECT_FALSE(sut_.sample());
  EXPECT_EQ(sut_.counters().glitches, start_.glitches + 1);
}

TEST_F(SimulatedKillSwitch, StaysKilledWhereALineWasRefused) {
  gpio::GpiodInput taken;
  EXPECT_NE(taken.open({.name = "kill_open"}).find("'kill_open': busy, used by 'roborun'"),
            std::string::npos);
  KillSwitch sut(taken, closed_);
  EXPECT_FALSE(sut.sample());
  EXPECT_TRUE(sut.sample());
  EXPECT_EQ(sut.reset(), Status::kNotReady);
  EXPECT_EQ(sut.counters().faults, 2U);
}

}  // namespace
}  // namespace roborun::firmware_if
