/// Whole real-time flights of a few seconds, sound and with faults. No wall time is judged: a shared machine
/// may be late, but it may not call the heap, fault a page in, or let one lane's fault take another one's
/// frames.
#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/mission/audit_run.hpp"
#include "platform/rt/lane_thread.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::mission {
namespace {

class RealTimeRun : public ::testing::Test {
 protected:
  RealTimeRun() : world(sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {})) {
    // A fast board, so that the governor grants what this machine easily holds.
    config.mission.flight.costs = board::paper().costs;
    for (core::StageCost& c : config.mission.flight.costs.stage) c = {};
    config.mission.flight.model = board::paper().model;
    for (governor::LatencyModel& m : config.mission.flight.model) m = {};
    config.best_effort = true;
  }
  static const report::AuditLane& lane(const report::AuditReport& r, core::LaneId id) {
    return r.lanes[static_cast<std::size_t>(id)];
  }
  static const report::AuditSlot& slot(const report::AuditReport& r, core::SlotId id) {
    return r.slots[static_cast<std::size_t>(id)];
  }
  /// Of a flight that nothing is to end. Flown again, three times in all, where the watchdog ended it while
  /// the hypervisor took 50 ms or more of a CPU: then the machine stood still and not the flight lane.
  report::AuditReport fly_to_the_end() const {
    for (int tries = 1;; ++tries) {
      const std::uint64_t before = stolen_ticks();
      report::AuditReport r = run_real_time(world, config, {});
      if (r.stopped_by.empty() || tries == 3 || stolen_ticks() - before < 5) return r;
    }
  }
  /// The trace, the time line, the histograms and the worst frames tell of the same frames.
  static void judge_evidence(const report::AuditReport& r) {
    for (const core::LaneSpec& spec : core::kLanes) {
      const report::AuditLane& l = lane(r, spec.id);
      std::uint64_t traced = 0, drawn = 0, counted = 0;
      for (const core::TraceEvent& e : r.trace) traced += e.is_frame && e.lane == spec.id ? 1U : 0U;
      for (const report::TimeColumn& c : l.time_line) drawn += c.frames;
      for (const auto& [us, count] : l.response.histogram) counted += count;
      EXPECT_EQ(traced, l.frames) << spec.name;
      EXPECT_EQ(drawn, l.frames) << spec.name;
      EXPECT_EQ(counted, l.frames) << spec.name;
    }
    for (const core::SlotSpec& spec : core::kFrameTable) {
      const report::AuditSlot& s = slot(r, spec.id);
      if (s.time.count == 0) continue;
      EXPECT_TRUE(s.longest.known) << spec.name;
      EXPECT_EQ(s.longest.seed, 1U);
      EXPECT_LE(s.longest.decision, r.decisions) << spec.name;
      Nanos spent{0};
      for (const core::TraceEvent& e : r.trace)
        if (!e.is_frame && e.slot == spec.id && e.frame == s.longest.cause.frame) spent += e.end - e.begin;
      EXPECT_NEAR(1e-3 * static_cast<double>(spent.count()), s.time.max_us, 1e-6) << spec.name;
    }
    EXPECT_GT(slot(r, core::SlotId::kPlanner).longest.decision, 0U);
    EXPECT_FALSE(r.interference.empty());
    for (const char* key :
         {"commit", "program_digest", "compiler", "flags", "kernel", "cpu", "microcode", "firmware",
          "governor", "frequency", "isolated", "sched_rt_runtime_us", "seed", "rate_Hz", "host"})
      EXPECT_TRUE(std::any_of(r.identity.begin(), r.identity.end(), [key](const auto& pair) {
        return pair.first == key && !pair.second.empty();
      })) << key;
  }
  /// Of 10 ms, from all CPUs, since the machine started.
  static std::uint64_t stolen_ticks() {
    std::ifstream file("/proc/stat");
    std::string field;
    std::uint64_t ticks = 0;
    for (int i = 0; i <= 7; ++i) file >> field;
    return file >> ticks ? ticks : 0;
  }
  sitl::World world;
  RealTimeConfig config;
};

TEST_F(RealTimeRun, FliesWithoutAHeapCallOrAPageFault) {
  config.seconds = 9.0;
  config.trace = true;
  const report::AuditReport r = fly_to_the_end();
  EXPECT_GT(r.decisions, 0U) << "it never got as far as a decision: nothing was tested";
  EXPECT_GT(lane(r, core::LaneId::kFlight).frames, 1000U);
  EXPECT_GT(slot(r, core::SlotId::kPlanner).time.count, 0U);
  EXPECT_GT(r.trace.size(), 1000U);
  EXPECT_EQ(r.events_lost, 0U);
  judge_evidence(r);
  EXPECT_EQ(r.stopped_by, "");
  EXPECT_EQ(r.heap_calls_after_start, 0U);
  const bool locked = std::none_of(r.missing.begin(), r.missing.end(),
                                   [](const std::string& why) { return why.rfind("memory lock", 0) == 0; });
  if (!locked) GTEST_SKIP() << "page faults are not judged: " << r.missing.front();
  EXPECT_EQ(report::minor_faults(r), 0U);
  EXPECT_EQ(report::major_faults(r), 0U);
  EXPECT_LE(r.locked_bytes, 96U << 20U);
  for (const report::PoolUse& p : r.pools) EXPECT_LE(p.high_water, p.count) << p.name;
}

TEST_F(RealTimeRun, LanesThatShareACpuKeepTheirPrioritiesAndTheReportSaysSo) {
  if (const std::string why = rt::why_no_priority(); !why.empty()) GTEST_SKIP() << why;
  cpu_set_t all, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
  CPU_ZERO(&one);
  for (std::size_t cpu = 0; CPU_COUNT(&one) == 0; ++cpu) {
    if (CPU_ISSET(cpu, &all)) CPU_SET(cpu, &one);
  }
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  config.seconds = 2.0;
  const report::AuditReport r = run_real_time(world, config, {});
  ASSERT_EQ(sched_setaffinity(0, sizeof all, &all), 0);
  EXPECT_EQ(lane(r, core::LaneId::kFlight).priority, 80);
  EXPECT_EQ(lane(r, core::LaneId::kDecision).priority, 60);
  EXPECT_EQ(lane(r, core::LaneId::kDecision).cpu, lane(r, core::LaneId::kFlight).cpu);
  EXPECT_GT(lane(r, core::LaneId::kFlight).frames, 100U);
  ASSERT_FALSE(r.missing.empty());
  EXPECT_EQ(r.missing.front().rfind("CPU: lane decision", 0), 0U) << r.missing.front();
}

TEST_F(RealTimeRun, AStageThatSpinsInTheDecisionLaneTakesNoFrameFromTheFlightLane) {
  config.seconds = 4.0;
  // The gather slot runs from the first frame on: 2 s without giving its CPU away.
  config.inject = Injection{core::SlotId::kGather, Nanos{2'000'000'000}, 100, 1, false};
  const report::AuditReport r = fly_to_the_end();
  const report::AuditLane& decision = lane(r, core::LaneId::kDecision);
  ASSERT_GE(decision.response.max_us, 2e6) << "the fault was not there";
  EXPECT_GE(decision.slips, 700U);
  EXPECT_GE(slot(r, core::SlotId::kGather).overruns, 1U) << "blamed";
  for (const report::AuditSlot& s : r.slots) {
    if (s.lane == "decision" && s.name != "gather") {
      EXPECT_LT(s.time.max_us, 2e6) << s.name << " is blamed for the fault of gather";
    }
  }
  const report::AuditLane& flight = lane(r, core::LaneId::kFlight);
  EXPECT_GT(flight.frames, 1000U) << "of 1,600; 800 fell into the fault";
}

TEST_F(RealTimeRun, WhereADecisionNeverEndsTheFlightLaneStopsTheVehicleAndGoesOn) {
  config.seconds = 16.0;
  config.inject = Injection{core::SlotId::kMap, Nanos{3'600'000'000'000}, 3, 1, false};
  const report::AuditReport r = fly_to_the_end();
  ASSERT_EQ(r.decisions, 4U) << "the fourth one is the last";
  EXPECT_EQ(r.decision_stalls, 1U);
  EXPECT_EQ(r.stalled_in, "map");
  EXPECT_EQ(r.stopped_by, "") << "the flight lane is well";
  EXPECT_GT(lane(r, core::LaneId::kFlight).frames, 4800U) << "of 6,400";
  EXPECT_GT(r.flown_m, 2.0) << "it never left: nothing was tested";
  EXPECT_LT(r.speed_mps, 0.5) << "the committed trajectory ends in a stop";
  EXPECT_GT(r.least_clearance_m, 0.6);
}

TEST_F(RealTimeRun, AFlightLaneThatHangsEndsTheRunByName) {
  config.seconds = 30.0;
  config.inject = Injection{core::SlotId::kTrack, Nanos{3'600'000'000'000}, 100, 1, false};
  const report::AuditReport r = run_real_time(world, config, {});
  EXPECT_EQ(r.stopped_by, "track");
  EXPECT_LT(r.seconds, 29.0);
}

TEST_F(RealTimeRun, NoCatchUpAfterAStallInTheFlightLane) {
  config.seconds = 2.0;
  config.inject = Injection{core::SlotId::kTrack, Nanos{100'000'000}, 100, 1, false};
  const report::AuditReport r = fly_to_the_end();
  const report::AuditLane& flight = lane(r, core::LaneId::kFlight);
  EXPECT_GE(flight.slips, 39U);
  EXPECT_LE(static_cast<double>(flight.frames + flight.slips), 400.0 * r.seconds + 2.0)
      << "frames were made up for";
  EXPECT_GE(slot(r, core::SlotId::kTrack).overruns, 1U);
  EXPECT_LT(slot(r, core::SlotId::kTrack).margin_ratio, 0.0);
  EXPECT_EQ(r.stopped_by, "") << "one overrun is not four hundred";
}

TEST_F(RealTimeRun, FliesAtTheRateAskedFor) {
  config.seconds = 2.0;
  config.mission.flight.minor_frame = core::minor_frame_of(100);
  const report::AuditReport r = fly_to_the_end();
  const report::AuditLane& flight = lane(r, core::LaneId::kFlight);
  EXPECT_EQ(r.rate_Hz, 100.0);
  EXPECT_GT(flight.frames, 0U);
  EXPECT_GT(flight.frames + flight.slips, 100U) << "on a busy machine some of 200 slip";
  EXPECT_LE(static_cast<double>(flight.frames + flight.slips), 100.0 * r.seconds + 2.0);
}

TEST_F(RealTimeRun, ATrackerThatIsAlwaysLateStopsTheRun) {
  config.seconds = 30.0;
  config.inject = Injection{core::SlotId::kTrack, Nanos{3'000'000}, 10, UINT64_MAX, false};
  const report::AuditReport r = run_real_time(world, config, {});
  EXPECT_EQ(r.stopped_by, "track");
  EXPECT_LT(r.seconds, 29.0);
}

TEST_F(RealTimeRun, CountsAndNamesAHeapCallAfterStart) {
  if (!rt::heap_seal_works()) GTEST_SKIP() << "the sanitizer owns the heap";
  config.seconds = 1.0;
  config.inject = Injection{core::SlotId::kSense, Nanos{0}, 50, 3, true};
  const report::AuditReport r = run_real_time(world, config, {});
  EXPECT_EQ(r.heap_calls_after_start, 6U) << "three times malloc and free";
  std::uint64_t named = 0;
  for (const auto& [name, count] : r.heap_sites) named += count;
  EXPECT_EQ(named, 6U);
}

}  // namespace
}  // namespace roborun::mission
