#include "platform/rt/lane_set.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

namespace roborun::rt {
namespace {

constexpr const char* kWhy = "no seccomp filter: Operation not permitted";

class Idle final : public core::LaneProgram {
 public:
  void run(core::SlotId, core::LaneExecutive&) noexcept override {}
};

/// All lanes idle, confined by something that fails.
struct Unconfined {
  explicit Unconfined(bool best_effort) {
    LaneSetConfig config;
    config.best_effort = best_effort;
    config.confine = [this] {
      ++asked;
      return std::string(kWhy);
    };
    sut = std::make_unique<LaneSet>(
        config, clock, reactions,
        std::array<core::LaneProgram*, core::kLaneCount>{&idle, &idle, &idle, &idle});
    (void)sut->prepare();  // whatever else this machine lacks
    (void)sut->choose_first_release();
  }
  [[nodiscard]] bool says_what_is_missing() const {
    const auto& missing = sut->missing();
    return std::find(missing.begin(), missing.end(), kWhy) != missing.end();
  }

  int asked{0};
  MonotonicClock clock;
  core::Reactions reactions;
  Idle idle;
  std::unique_ptr<LaneSet> sut;
};

TEST(LaneSet, RefusesToRunWhereItCannotBeConfined) {
  Unconfined set(false);
  EXPECT_EQ(set.sut->start(), std::string(kWhy) + " (--best-effort runs on without)");
  set.sut->stop();
  EXPECT_EQ(set.asked, 1);
  EXPECT_TRUE(set.says_what_is_missing());
}

TEST(LaneSet, RunsOnUnconfinedAtBestEffortAndSaysSo) {
  Unconfined set(true);
  EXPECT_EQ(set.sut->start(), "");
  set.sut->stop();
  EXPECT_EQ(set.asked, 1);
  EXPECT_TRUE(set.says_what_is_missing());
}

}  // namespace
}  // namespace roborun::rt
