/// The kill chain in real time on two controllers of the kernel: from the edge at the switch to the last
/// throttle that arrives at the ESC's side; with simulated lines, and with gpio-sim's through libgpiod. Runs
/// where ROBORUN_TEST_KILL names two interfaces ("can0,can1"): in the ARM guest, where time is counted in
/// instructions.
#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "firmware_if/dronecan/node.hpp"
#include "firmware_if/kill_switch.hpp"
#include "platform/can/socket_can.hpp"
#include "platform/gpio/gpiod_line.hpp"
#include "platform/sitl/bus/fake_esc.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"
#include "tests/contract/gpio_sim.hpp"

namespace roborun {
namespace {

namespace dc = firmware_if::dronecan;

constexpr Nanos kFrame{2'500'000};
constexpr int kPresses = 1000;

MonotonicTime now() {
  timespec t{};
  (void)clock_gettime(CLOCK_MONOTONIC, &t);
  return MonotonicTime{Nanos{std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec}};
}

void sleep_until(MonotonicTime at) {
  const std::int64_t ns = at.time_since_epoch().count();
  const timespec t{static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
  }
}

/// Real-time priority while it lives; the tests after this one run without.
class RealTime {
 public:
  RealTime() { set(SCHED_FIFO, 80); }
  ~RealTime() { set(SCHED_OTHER, 0); }
  RealTime(const RealTime&) = delete;
  RealTime& operator=(const RealTime&) = delete;

 private:
  static void set(int policy, int priority) {
    sched_param parameter{};
    parameter.sched_priority = priority;
    EXPECT_EQ(sched_setscheduler(0, policy, &parameter), 0);
  }
};

class KernelKillChain : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static bool on_gpio_sim() { return GetParam() == std::string("gpio_sim"); }
  void plug_in_gpio_sim() {
    sim_.emplace(std::vector<std::string>{"kill_open", "kill_closed"});
    ASSERT_EQ(kernel_open_.open({.name = "kill_open"}), "");
    ASSERT_EQ(kernel_closed_.open({.name = "kill_closed"}), "");
    open_ = &kernel_open_;
    closed_ = &kernel_closed_;
  }
  void drive(bool pressed) {
    const MonotonicTime t = now();
    fake_open_.drive(pressed, t);
    fake_closed_.drive(!pressed, t);
    if (!sim_) return;
    sim_->drive(0, pressed);
    sim_->drive(1, !pressed);
  }

  std::optional<test::GpioSim> sim_;  // Outlives its lines.
  gpio::GpiodInput kernel_open_;
  gpio::GpiodInput kernel_closed_;
  sitl::FakeGpioInput fake_open_;
  sitl::FakeGpioInput fake_closed_;
  firmware_if::GpioInput* open_{&fake_open_};
  firmware_if::GpioInput* closed_{&fake_closed_};
};

TEST_P(KernelKillChain, StopsTheEscWithinTwoFramesInAThousandRandomPhases) {
  const char* names = std::getenv("ROBORUN_TEST_KILL");
  if (names == nullptr) GTEST_SKIP() << "no kernel bus: ROBORUN_TEST_KILL is not set";
  if (on_gpio_sim()) {
    if (!test::GpioSim::there()) GTEST_SKIP() << test::GpioSim::kWhyNot;
    plug_in_gpio_sim();
  }
  const std::string pair = names;
  can::SocketCan ours;
  can::SocketCan theirs;
  ASSERT_EQ(ours.open(pair.substr(0, pair.find(','))), "");
  ASSERT_EQ(theirs.open(pair.substr(pair.find(',') + 1)), "");
  const RealTime real_time;

  firmware_if::TransmitGate gate({}, ours);
  std::vector<dc::Reassembler::Session> sessions(32);
  dc::Node node({}, gate, ours, sessions);
  sitl::FakeEsc esc({.node_id = 21, .index = 0}, theirs);
  drive(false);
  firmware_if::KillSwitch kill_switch(*open_, *closed_);
  const std::array<double, 4> thrust{0.5, 0.5, 0.5, 0.5};
  core::CounterRng rng(3);

  MonotonicTime next = now();
  double throttle = 0.0;
  const auto frame = [&] {
    next += kFrame;
    sleep_until(next);
    const MonotonicTime t = now();
    if (kill_switch.sample()) gate.kill();
    gate.beat(t);
    (void)node.step(t, {.cycle_ok = true, .armed = true, .thrust_ratio = thrust});
    throttle = esc.step(now());
  };
  std::vector<Nanos> latency;
  for (int press = 0; press < kPresses; ++press) {
    for (int i = 0; i < 3; ++i) frame();
    ASSERT_EQ(gate.arm_unproven(), Status::kOk);
    for (int i = 0; i < 7; ++i) frame();
    ASSERT_GT(throttle, 0.1);
    // Somewhere in the frame, between two samples.
    sleep_until(next +
                Nanos{static_cast<std::int64_t>(rng.uniform() * static_cast<double>(kFrame.count()) * 0.9)});
    const MonotonicTime edge = now();
    drive(true);
    for (int i = 0; i < 5; ++i) frame();
    ASSERT_EQ(throttle, 0.0);
    latency.push_back(esc.last_thrust() - edge);
    drive(false);
    frame();
    ASSERT_EQ(kill_switch.reset(), Status::kOk);
    gate.disarm();
    ASSERT_EQ(gate.reset_kill(kill_switch), Status::kOk);
  }
  std::ranges::sort(latency);
  std::printf("kill edge (%s) to last throttle on the bus, %zu presses: median %lld us, worst %lld us\n",
              GetParam(), latency.size(), static_cast<long long>(latency[latency.size() / 2].count() / 1000),
              static_cast<long long>(latency.back().count() / 1000));
  EXPECT_EQ(latency.size(), std::size_t{kPresses});
  EXPECT_LE(latency.back(), 2 * kFrame);
  // Both lines, pressed and released; and the closed one's first.
  EXPECT_EQ(kill_switch.counters().edges, std::uint64_t{4 * kPresses + 1});
}

INSTANTIATE_TEST_SUITE_P(Lines, KernelKillChain, testing::Values("fake", "gpio_sim"),
                         [](const auto& made) { return std::string(made.param); });

}  // namespace
}  // namespace roborun
