#include "platform/rt/lane_thread.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <memory>
#include <thread>

#include "platform/rt/host_identity.hpp"
#include "platform/rt/monotonic_clock.hpp"

namespace roborun::rt {
namespace {

/// Notes on which CPU it runs.
class WhereAmI final : public core::LaneProgram {
 public:
  void run(core::SlotId slot, core::LaneExecutive&) noexcept override {
    if (slot != core::SlotId::kSense) return;
    cpu.store(sched_getcpu());
    frames.fetch_add(1);
  }
  std::atomic<int> cpu{-1};
  std::atomic<int> frames{0};
};

TEST(MonotonicClock, NeverGoesBackAndMeetsItsSystemTime) {
  const MonotonicClock sut;
  MonotonicTime last = sut.now();
  EXPECT_GE(last, MonotonicTime{});
  for (int i = 0; i < 100'000; ++i) {
    const MonotonicTime now = sut.now();
    ASSERT_GE(now, last);
    last = now;
  }
  const timespec a = sut.raw_time(MonotonicTime{});
  const timespec b = sut.raw_time(MonotonicTime{Nanos{1'500'000'000}});
  const std::int64_t apart_ns = (b.tv_sec - a.tv_sec) * 1'000'000'000 + b.tv_nsec - a.tv_nsec;
  EXPECT_EQ(apart_ns, 1'500'000'000);
}

TEST(LaneThread, RunsFramesOnItsCpuAndNeverBeforeTheirRelease) {
  const MonotonicClock clock;
  WhereAmI program;
  core::Reactions reactions;
  auto lane =
      std::make_unique<core::LaneExecutive>(core::LaneId::kFlight, clock, program, reactions, nullptr);
  lane->start(clock.now() + Nanos{5'000'000});
  LaneThread sut(*lane, clock);
  Placement placement = placement_of(core::lane(core::LaneId::kFlight));
  EXPECT_EQ(placement.priority, 80);
  if (!why_not_real_time().empty()) placement.priority = 0;
  ASSERT_EQ(sut.start(placement, false), "");
  while (program.frames.load() < 50) std::this_thread::yield();
  sut.request_stop();
  sut.join();
  EXPECT_EQ(program.cpu.load(), placement.cpu);
  const core::LaneStatistics& s = lane->statistics();
  EXPECT_GE(s.frames, 50U);
  EXPECT_GT(s.jitter.min(), Nanos{0});
  EXPECT_GT(sut.counters().voluntary_switches, 0U) << "it slept";
  EXPECT_GT(sut.stack_high_water_bytes(), 1000U);
  EXPECT_LT(sut.stack_high_water_bytes(), sut.stack_bytes());
}

TEST(LaneThread, RefusesACpuThatIsNotThere) {
  const MonotonicClock clock;
  WhereAmI program;
  core::Reactions reactions;
  auto lane =
      std::make_unique<core::LaneExecutive>(core::LaneId::kFlight, clock, program, reactions, nullptr);
  LaneThread sut(*lane, clock);
  const std::string error = sut.start({1000, 0}, false);
  EXPECT_NE(error.find("lane flight"), std::string::npos) << error;
}

TEST(HostIdentity, SaysOnWhatItRuns) {
  const HostIdentity id = identify_host();
  EXPECT_NE(id.kernel, "");
  for (const std::string& text : {id.host, id.cpu, id.microcode, id.firmware, id.governor, id.frequency,
                                  id.isolated, id.nohz_full, id.rt_runtime})
    EXPECT_NE(text, "");
  EXPECT_GE(id.cpus, 1);
}

}  // namespace
}  // namespace roborun::rt
