#include "stages/control/past_states.hpp"

#include <gtest/gtest.h>

#include "core/random/counter_rng.hpp"

namespace roborun::stages {
namespace {

MonotonicTime at_ms(double ms) { return MonotonicTime{Nanos{static_cast<std::int64_t>(ms * 1e6)}}; }
PastStates::Past state(int i) {
  PastStates::Past past;
  past.stamp = at_ms(2.5 * i);
  past.p_WB.x() = i;
  return past;
}

TEST(PastStates, FindsTheNewestNotYoungerAndForgetsTheOld) {
  PastStates sut(Nanos{450'000'000});
  EXPECT_EQ(sut.at(at_ms(0)), nullptr);
  for (int i = 0; i < 1000; ++i) sut.add(state(i));
  ASSERT_NE(sut.at(at_ms(2400)), nullptr);
  EXPECT_EQ(sut.at(at_ms(2400))->p_WB.x(), 960);
  EXPECT_EQ(sut.at(at_ms(2401.2))->p_WB.x(), 960);
  EXPECT_EQ(sut.at(at_ms(2401.3))->p_WB.x(), 961);
  EXPECT_EQ(sut.at(at_ms(2497.6)), nullptr) << "the future";
  EXPECT_NE(sut.at(at_ms(2047.5)), nullptr);
  EXPECT_EQ(sut.at(at_ms(2047.4)), nullptr) << "450 ms and more ago";
  sut.clear();
  EXPECT_EQ(sut.at(at_ms(2400)), nullptr);
  sut.add(state(1000));
  EXPECT_EQ(sut.at(at_ms(2500))->p_WB.x(), 1000);
  EXPECT_EQ(sut.at(at_ms(2490)), nullptr) << "from before it was cleared";
}

/// Three copies caught up in turn, as the cells of a mailbox are, however far behind each of them is.
TEST(PastStates, CatchesUpWithAnotherAfterAnyNumberOfSteps) {
  core::CounterRng rng(5);
  PastStates newest(Nanos{450'000'000});
  std::array<PastStates, 3> copy{PastStates(Nanos{0}), PastStates(Nanos{0}), PastStates(Nanos{0})};
  int n = 0;
  for (int round = 0; round < 300; ++round) {
    const auto steps = static_cast<int>(rng.below(round % 10 == 0 ? 700 : 5));
    for (int i = 0; i < steps; ++i) newest.add(state(++n));
    if (rng.below(20) == 0) newest.clear();
    PastStates& sut = copy[static_cast<std::size_t>(rng.below(3))];
    sut.catch_up(newest);
    for (int back = 0; back < 220; ++back) {
      const PastStates::Past* a = newest.at(at_ms(2.5 * (n - back)));
      const PastStates::Past* b = sut.at(at_ms(2.5 * (n - back)));
      ASSERT_EQ(a == nullptr, b == nullptr) << round << " " << back;
      if (a != nullptr) {
        ASSERT_EQ(a->stamp, b->stamp);
        ASSERT_EQ(a->p_WB, b->p_WB);
      }
    }
  }
  EXPECT_GT(n, 5000);
}

}  // namespace
}  // namespace roborun::stages
