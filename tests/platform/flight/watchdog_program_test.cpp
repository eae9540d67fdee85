#include "platform/flight/watchdog_program.hpp"

#include <gtest/gtest.h>

#include "core/executive/virtual_clock.hpp"

namespace roborun::flight {
namespace {

using core::LaneExecutive;
using core::LaneId;
using core::SlotId;

class Idle final : public core::LaneProgram {
 public:
  void run(SlotId, LaneExecutive&) noexcept override {}
};

class Watchdog : public ::testing::Test {
 protected:
  Watchdog() { sut_.watch(flight_, decision_); }
  /// `ms` later, the lanes that run having kept their releases; then the watchdog looks.
  void pass(int ms, bool flight_runs, bool decision_runs) {
    now_ += Nanos{ms * 1'000'000LL};
    clock_.set(now_);
    while (flight_runs && flight_.release() <= now_) flight_.run_frame();
    while (decision_runs && decision_.release() <= now_) decision_.run_frame();
    sut_.run(SlotId::kWatch, watch_);
  }
  MonotonicTime now_{Nanos{1'000'000'000}};
  core::VirtualClock clock_;
  core::Reactions reactions_;
  Idle idle_;
  WatchdogProgram sut_;
  LaneExecutive flight_{LaneId::kFlight, clock_, idle_, reactions_, nullptr};
  LaneExecutive decision_{LaneId::kDecision, clock_, idle_, reactions_, nullptr};
  LaneExecutive watch_{LaneId::kWatchdog, clock_, sut_, reactions_, nullptr};
};

TEST_F(Watchdog, SaysNothingOfLanesThatComeRound) {
  for (int i = 0; i < 100; ++i) pass(20, true, true);
  EXPECT_FALSE(reactions_.braking());
  EXPECT_FALSE(reactions_.stopping());
  EXPECT_EQ(sut_.stalls(), 0U);
  EXPECT_FALSE(sut_.stalled());
}

TEST_F(Watchdog, BrakesWhileTheDecisionLaneHangsAndNamesTheSlot) {
  pass(20, true, true);
  pass(110, true, false);
  EXPECT_FALSE(reactions_.braking()) << "once may be the host";
  pass(20, true, false);
  EXPECT_TRUE(reactions_.braking());
  EXPECT_FALSE(reactions_.stopping());
  EXPECT_EQ(sut_.stalled(), SlotId::kGather);
  pass(20, true, false);
  EXPECT_EQ(sut_.stalls(), 1U) << "the same hang";
  pass(20, true, true);
  EXPECT_FALSE(reactions_.braking());
  for (int i = 0; i < 2; ++i) pass(110, true, false);
  EXPECT_TRUE(reactions_.braking());
  EXPECT_EQ(sut_.stalls(), 2U);
}

TEST_F(Watchdog, StopsTheRunWhereTheFlightLaneHangsAndNamesTheSlot) {
  pass(20, true, true);
  pass(110, false, true);
  EXPECT_FALSE(reactions_.stopping()) << "once may be the host";
  pass(20, false, true);
  ASSERT_TRUE(reactions_.stopping());
  EXPECT_EQ(reactions_.stopped_by(), SlotId::kWorld);
}

TEST_F(Watchdog, ForgivesALaneThatIsLateOnceAndComesBack) {
  pass(20, true, true);
  for (int i = 0; i < 5; ++i) {
    pass(110, false, false);
    pass(20, true, true);
  }
  EXPECT_FALSE(reactions_.stopping());
  EXPECT_EQ(sut_.stalls(), 0U);
}

}  // namespace
}  // namespace roborun::flight
