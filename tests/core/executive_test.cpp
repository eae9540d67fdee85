#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "core/executive/lane_executive.hpp"
#include "core/executive/slot_statistics.hpp"
#include "core/executive/virtual_clock.hpp"
#include "core/random/counter_rng.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::core {
namespace {

constexpr Nanos us(std::int64_t n) { return Nanos{1000 * n}; }

TEST(DurationHistogram, AgreesWithSortedSamplesWithinOnePart64) {
  DurationHistogram sut;
  EXPECT_EQ(sut.quantile(0.5).count(), 0);
  CounterRng rng(1, 2);
  std::vector<std::int64_t> sorted;
  for (int i = 0; i < 20000; ++i) {
    const auto ns = static_cast<std::int64_t>(rng.next() >> (24U + rng.next() % 40U));
    sorted.push_back(ns);
    sut.add(Nanos{ns});
  }
  std::sort(sorted.begin(), sorted.end());
  for (const double q : {0.0, 0.01, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(q * 20000.0)));
    const auto exact = static_cast<double>(sorted[rank - 1]);
    const auto got = static_cast<double>(sut.quantile(q).count());
    EXPECT_GE(got, exact) << q;
    EXPECT_LE(got, exact * (1.0 + 1.0 / 64.0) + 1.0) << q;
  }
  EXPECT_EQ(sut.min().count(), sorted.front());
  EXPECT_EQ(sut.max().count(), sorted.back());
  EXPECT_EQ(sut.quantile(0.0 / 0.0), sut.max());
}

TEST(BlockMaxima, KeepsTheLargestOfEachBlockAndMergesInPairs) {
  auto sut = std::make_unique<BlockMaxima>();
  const std::size_t blocks = BlockMaxima::kMost;
  for (std::size_t i = 0; i < blocks * BlockMaxima::kFirstBlock; ++i)
    sut->add(Nanos{static_cast<std::int64_t>(i)});
  EXPECT_EQ(sut->count(), blocks / 2);
  EXPECT_EQ(sut->block_length(), 2 * BlockMaxima::kFirstBlock);
  EXPECT_EQ((*sut)[0].count(), 2 * BlockMaxima::kFirstBlock - 1);
  EXPECT_EQ((*sut)[blocks / 2 - 1].count(), static_cast<std::int64_t>(blocks * BlockMaxima::kFirstBlock - 1));
}

/// Spends what it is told to, slot by slot.
class Script final : public LaneProgram {
 public:
  explicit Script(VirtualClock& clock) : clock_(clock) {}
  void run(SlotId slot, LaneExecutive& lane) noexcept override {
    ++runs[static_cast<std::size_t>(slot)];
    granted[static_cast<std::size_t>(slot)] = lane.grant(slot, kLongest);
    clock_.advance(cost[static_cast<std::size_t>(slot)]);
    if (slot == SlotId::kGovernor && period > Nanos{0}) lane.set_period(period);
  }
  static constexpr Nanos kLongest{3'600'000'000'000};
  std::array<Nanos, kSlotCount> cost{};
  std::array<Nanos, kSlotCount> granted{};
  std::array<std::uint64_t, kSlotCount> runs{};
  Nanos period{0};

 private:
  VirtualClock& clock_;
};

struct Bench {
  explicit Bench(LaneId id) : lane(id, clock, script, reactions, &trace) {
    lane.start(MonotonicTime{kMinorFrame});
  }
  /// One frame, woken `late` after its release.
  void frame(Nanos late = Nanos{0}) {
    clock.set(lane.release() + late);
    lane.run_frame();
  }
  Nanos& cost(SlotId slot) { return script.cost[static_cast<std::size_t>(slot)]; }
  VirtualClock clock;
  Script script{clock};
  Reactions reactions;
  TraceRing trace;
  LaneExecutive lane;
};

TEST(LaneExecutive, ChargesEachSlotItsOwnTime) {
  auto b = std::make_unique<Bench>(LaneId::kFlight);
  b->cost(SlotId::kSense) = us(50);
  b->cost(SlotId::kTrack) = us(30);
  b->cost(SlotId::kPublish) = us(5);
  for (int i = 0; i < 100; ++i) b->frame(us(7));
  EXPECT_EQ(b->lane.statistics(SlotId::kSense).time.max(), us(50));
  EXPECT_EQ(b->lane.statistics(SlotId::kTrack).time.min(), us(30));
  EXPECT_EQ(b->lane.statistics(SlotId::kWorld).time.max(), us(0));
  EXPECT_EQ(b->lane.statistics(SlotId::kTrack).time.count(), 100U);
  EXPECT_DOUBLE_EQ(b->lane.statistics(SlotId::kSense).margin_ratio, 1.0 - 50.0 / 400.0);
  const LaneStatistics& all = b->lane.statistics();
  EXPECT_EQ(all.frames, 100U);
  EXPECT_EQ(all.jitter.max(), us(7));
  EXPECT_EQ(all.overhead.max(), us(5)) << "publish is no stage";
  EXPECT_EQ(all.response.max(), us(92));
  EXPECT_EQ(all.slips + all.deadline_misses, 0U);
}

TEST(LaneExecutive, SkipsLateFramesWithoutABurstAndKeepsItsPhase) {
  auto b = std::make_unique<Bench>(LaneId::kFlight);
  b->frame();
  b->cost(SlotId::kSense) = us(9000);  // release 5 ms, end 14 ms: 7.5, 10, 12.5 are lost
  b->frame();
  b->cost(SlotId::kSense) = us(10);
  EXPECT_EQ(b->lane.release(), MonotonicTime{us(15000)});
  EXPECT_EQ(b->lane.statistics().slips, 3U);
  EXPECT_EQ(b->lane.statistics().deadline_misses, 1U);
  const std::uint64_t before = b->lane.statistics().frames;
  for (int i = 0; i < 10; ++i) b->frame();
  EXPECT_EQ(b->lane.statistics().frames, before + 10);
  EXPECT_EQ(b->lane.release(), MonotonicTime{us(15000 + 10 * 2500)});
  EXPECT_EQ(b->lane.statistics(SlotId::kSense).longest.frame, 1U) << "the frame that took longest";
}

/// Every slot of the flight and the decision lane, 1.1, 2 and 100 times over its budget.
TEST(LaneExecutive, BlamesTheSlotThatOverranWhicheverItIs) {
  int cells = 0;
  for (const SlotSpec& spec : kFrameTable) {
    for (const double factor : {1.1, 2.0, 100.0}) {
      auto b = std::make_unique<Bench>(spec.lane);
      for (int i = 0; i < 3; ++i) b->frame();
      b->cost(spec.id) = Nanos{static_cast<std::int64_t>(factor * static_cast<double>(spec.budget.count()))};
      b->frame();
      b->cost(spec.id) = Nanos{0};
      for (int i = 0; i < 3; ++i) b->frame();
      for (const SlotSpec& other : kFrameTable) {
        if (other.lane != spec.lane) continue;
        EXPECT_EQ(b->lane.statistics(other.id).overruns, other.id == spec.id ? 1U : 0U)
            << spec.name << " x " << factor << ": " << other.name;
      }
      EXPECT_LT(b->lane.statistics(spec.id).margin_ratio, 0.0);
      ++cells;
    }
  }
  EXPECT_EQ(cells, 3 * static_cast<int>(kSlotCount));
}

/// As often in a row as the table says, and the policy of the table follows.
TEST(LaneExecutive, ReactsAsTheTableSays) {
  for (const SlotSpec& spec : kFrameTable) {
    auto b = std::make_unique<Bench>(spec.lane);
    b->cost(spec.id) = spec.budget + us(1);
    for (std::uint32_t i = 0; i + 1 < spec.overruns_to_act; ++i) b->frame();
    EXPECT_FALSE(b->reactions.braking() || b->reactions.stopping()) << spec.name << ": too early";
    EXPECT_EQ(b->lane.statistics(spec.id).reactions, 0U) << spec.name;
    b->frame();
    EXPECT_EQ(b->lane.statistics(spec.id).reactions, 1U) << spec.name;
    b->cost(spec.id) = Nanos{0};
    const std::uint64_t runs = b->script.runs[static_cast<std::size_t>(spec.id)];
    switch (spec.on_overrun) {
      case OverrunPolicy::kSkip:
        b->frame();
        EXPECT_EQ(b->script.runs[static_cast<std::size_t>(spec.id)], runs) << spec.name;
        EXPECT_EQ(b->lane.statistics(spec.id).skipped, 1U);
        b->frame();
        EXPECT_EQ(b->script.runs[static_cast<std::size_t>(spec.id)], runs + 1) << spec.name;
        break;
      case OverrunPolicy::kDegrade:
        b->frame();
        EXPECT_EQ(b->script.granted[static_cast<std::size_t>(spec.id)], spec.budget / 2) << spec.name;
        b->frame();
        EXPECT_EQ(b->script.granted[static_cast<std::size_t>(spec.id)], spec.budget) << spec.name;
        break;
      case OverrunPolicy::kBrake:
        EXPECT_TRUE(b->reactions.braking()) << spec.name;
        b->frame();
        EXPECT_FALSE(b->reactions.braking()) << spec.name << ": in time again";
        break;
      case OverrunPolicy::kStop:
        EXPECT_TRUE(b->reactions.stopping()) << spec.name;
        EXPECT_EQ(b->reactions.stopped_by(), spec.id);
        break;
    }
  }
}

TEST(LaneExecutive, CutsDecisionFramesToWholeMinorFrames) {
  auto b = std::make_unique<Bench>(LaneId::kDecision);
  b->script.period = us(201'000);
  b->cost(SlotId::kMap) = us(10'000);
  b->frame();
  EXPECT_EQ(b->lane.release(), MonotonicTime{us(2500 + 202'500)});
  b->cost(SlotId::kMap) = us(204'000);  // ends 6.5 ms after the deadline's grid point, 1.5 ms late
  b->frame();
  EXPECT_EQ(b->lane.release(), MonotonicTime{us(205'000 + 205'000)});
  EXPECT_EQ(b->lane.statistics().deadline_misses, 1U);
  EXPECT_EQ(b->lane.statistics().slips, 1U);
}

TEST(FrameTable, ARateIsLegalIfItsMinorFrameIsWholeMicrosecondsFrom2500To10000) {
  int legal = 0;
  for (int rate_Hz = -1; rate_Hz <= 2000; ++rate_Hz) {
    if (!is_flight_rate(rate_Hz)) continue;
    ++legal;
    EXPECT_EQ(minor_frame_of(rate_Hz) * rate_Hz, Nanos{1'000'000'000});
    EXPECT_EQ(minor_frame_of(rate_Hz).count() % 1000, 0);
    EXPECT_GE(minor_frame_of(rate_Hz), kMinorFrame) << "the budgets of the flight lane fit into kMinorFrame";
  }
  EXPECT_EQ(legal, 7);
  EXPECT_EQ(minor_frame_of(400), kMinorFrame);
}

TEST(LaneExecutive, KeepsTheGridOfTheRateItIsStartedWith) {
  for (const LaneId id : {LaneId::kFlight, LaneId::kDecision}) {
    auto b = std::make_unique<Bench>(id);
    b->lane.start(MonotonicTime{us(8000)}, us(8000));
    for (int i = 0; i < 5; ++i) b->frame();
    EXPECT_EQ(b->lane.release(), MonotonicTime{us(48'000)});
    b->script.period = us(17'000);
    b->frame();
    EXPECT_EQ(b->lane.release(), MonotonicTime{us(id == LaneId::kDecision ? 72'000 : 56'000)});
  }
  auto background = std::make_unique<Bench>(LaneId::kBackground);
  background->lane.start(MonotonicTime{us(8000)}, us(8000));
  background->frame();
  EXPECT_EQ(background->lane.release(), MonotonicTime{us(13'000)}) << "its own";
}

TEST(LaneExecutive, TellsTheTraceEverySlot) {
  auto b = std::make_unique<Bench>(LaneId::kFlight);
  b->cost(SlotId::kCommit) = us(101);
  b->frame();
  TraceEvent event;
  std::vector<SlotId> slots;
  while (b->trace.pop(event) && !event.is_frame) {
    slots.push_back(event.slot);
    EXPECT_EQ(event.overrun, event.slot == SlotId::kCommit);
  }
  EXPECT_EQ(slots, (std::vector<SlotId>{SlotId::kWorld, SlotId::kSense, SlotId::kCommit, SlotId::kTrack,
                                        SlotId::kPublish, SlotId::kLook}));
  EXPECT_TRUE(event.is_frame) << "after its pieces";
  EXPECT_EQ(event.end - event.begin, us(101));
}

/// Slots that take turns: their pieces follow each other within the frame and sum up to what each is charged.
TEST(LaneExecutive, PiecesOfTheTraceNeitherOverlapNorLoseTime) {
  class Turns final : public LaneProgram {
   public:
    explicit Turns(VirtualClock& clock) : clock_(clock) {}
    void run(SlotId slot, LaneExecutive& lane) noexcept override {
      clock_.advance(us(10));
      if (slot != SlotId::kMap) return;
      lane.charge_to(SlotId::kGovernor);
      clock_.advance(us(3));
      lane.charge_to(SlotId::kMap);
      clock_.advance(us(4));
    }

   private:
    VirtualClock& clock_;
  };
  VirtualClock clock;
  Turns program(clock);
  Reactions reactions;
  const auto trace = std::make_unique<TraceRing>();
  const auto lane =
      std::make_unique<LaneExecutive>(LaneId::kDecision, clock, program, reactions, trace.get());
  lane->start(MonotonicTime{kMinorFrame});
  clock.set(MonotonicTime{kMinorFrame} + us(5));
  lane->run_frame();
  std::array<Nanos, kSlotCount> sum{};
  MonotonicTime last{kMinorFrame};
  TraceEvent event;
  int pieces = 0;
  while (trace->pop(event) && !event.is_frame) {
    EXPECT_GE(event.begin, last);
    EXPECT_GE(event.end, event.begin);
    last = event.end;
    sum[static_cast<std::size_t>(event.slot)] += event.end - event.begin;
    ++pieces;
  }
  ASSERT_TRUE(event.is_frame);
  EXPECT_EQ(pieces, 10) << "eight slots, and map and governor once more";
  EXPECT_EQ(event.begin - event.release, us(5)) << "the jitter";
  EXPECT_LE(last, event.end);
  for (const SlotSpec& spec : kFrameTable) {
    if (spec.lane != LaneId::kDecision) continue;
    EXPECT_EQ(sum[static_cast<std::size_t>(spec.id)], lane->statistics(spec.id).time.max()) << spec.name;
  }
  EXPECT_EQ(sum[static_cast<std::size_t>(SlotId::kMap)], us(14));
}

/// What the watchdog asks while a slot still runs and its frame has not been judged.
class Watched final : public LaneProgram {
 public:
  explicit Watched(VirtualClock& clock) : clock_(clock) {}
  void run(SlotId slot, LaneExecutive& lane) noexcept override {
    if (slot != hangs) return;
    if (granted > Nanos{0}) (void)lane.grant(slot, granted);
    const MonotonicTime begin = clock_.now();
    const Nanos budget = granted > Nanos{0} ? granted : roborun::core::slot(slot).budget;
    last_good = lane.overdue(begin + budget + kWatchdogPatience);
    first_bad = lane.overdue(begin + budget + kWatchdogPatience + Nanos{1});
  }
  SlotId hangs{};
  Nanos granted{0};
  std::optional<SlotId> last_good, first_bad;

 private:
  VirtualClock& clock_;
};

TEST(LaneExecutive, SaysInWhichSlotItHangsWhileItHangs) {
  for (const SlotSpec& spec : kFrameTable) {
    for (const Nanos granted : {Nanos{0}, us(50)}) {
      VirtualClock clock;
      Watched program(clock);
      program.hangs = spec.id;
      program.granted = granted;
      Reactions reactions;
      const auto lane = std::make_unique<LaneExecutive>(spec.lane, clock, program, reactions, nullptr);
      lane->start(MonotonicTime{kMinorFrame});
      clock.set(MonotonicTime{kMinorFrame});
      lane->run_frame();
      EXPECT_EQ(program.last_good, std::nullopt) << spec.name;
      EXPECT_EQ(program.first_bad, spec.id) << spec.name;
      // Asleep until the next release; one that never wakes up is overdue too.
      EXPECT_EQ(lane->overdue(lane->release() + kWatchdogPatience), std::nullopt);
      EXPECT_TRUE(lane->overdue(lane->release() + kWatchdogPatience + Nanos{1}).has_value());
    }
  }
}

TEST(LaneExecutive, DoesNotAllocate) {
  auto b = std::make_unique<Bench>(LaneId::kDecision);
  const test::NoAllocScope scope;
  for (int i = 0; i < 1000; ++i) b->frame();
  EXPECT_EQ(scope.count(), 0U);
  EXPECT_EQ(b->lane.statistics().frames, 1000U);
}

}  // namespace
}  // namespace roborun::core
