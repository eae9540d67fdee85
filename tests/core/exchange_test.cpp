#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "core/exchange/mailbox.hpp"
#include "core/exchange/spsc_ring.hpp"
#include "tests/core/exchange_twins.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::core {
namespace {

/// Every order in which the steps of one writer (draft, publish) and one reader (take, finish reading) can
/// follow each other, `length` steps long. Counts the times at which both hold the same cell, and messages
/// that come back in time.
struct Interleavings {
  std::uint64_t runs{}, clashes{}, backwards{}, taken{}, lost_newest{};
};
template <template <typename> class Box>
Interleavings all_interleavings(int length) {
  Interleavings seen;
  for (std::uint32_t order = 0; order < (1U << static_cast<unsigned>(length)); ++order) {
    Box<std::uint64_t> box;
    std::uint64_t* writing = nullptr;
    const std::uint64_t* reading = nullptr;
    std::uint64_t sent = 0, last = 0;
    for (int i = 0; i < length; ++i) {
      if (((order >> static_cast<unsigned>(i)) & 1U) != 0) {
        if (writing == nullptr) {
          writing = &box.draft();
          *writing = sent + 1;
        } else {
          ++sent;
          box.publish();
          writing = nullptr;
        }
      } else if (reading == nullptr) {
        const bool fresh = box.take();
        if (fresh != (sent > last)) ++seen.lost_newest;
        if (fresh) {
          reading = &box.read();
          ++seen.taken;
          if (*reading != sent) ++seen.lost_newest;
          if (*reading < last) ++seen.backwards;
          last = *reading;
        }
      } else {
        if (*reading != last) ++seen.backwards;
        reading = nullptr;
      }
      if (writing != nullptr && writing == reading) ++seen.clashes;
    }
    ++seen.runs;
  }
  return seen;
}

TEST(Mailbox, NeverGivesOneCellToBothSidesInAnyOrderOfSteps) {
  const Interleavings seen = all_interleavings<Mailbox>(16);
  EXPECT_EQ(seen.runs, 65536U);
  EXPECT_GT(seen.taken, 65536U) << "nothing was exchanged: nothing was tested";
  EXPECT_EQ(seen.clashes, 0U);
  EXPECT_EQ(seen.backwards, 0U);
  EXPECT_EQ(seen.lost_newest, 0U);
}

TEST(Mailbox, TheSameTestCatchesTheBrokenTwin) {
  const Interleavings seen = all_interleavings<broken::TwoCellMailbox>(16);
  EXPECT_GT(seen.clashes, 0U);
}

struct Message {
  std::array<std::uint64_t, 64> word{};
};

/// One thread writes for as long as the other has not read `wanted` messages; returns how many were torn or
/// old.
template <typename Box>
std::uint64_t stress(std::uint64_t wanted) {
  auto box = std::make_unique<Box>();
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (std::uint64_t n = 1; !done.load(std::memory_order_relaxed); ++n) {
      box->draft().word.fill(n);
      box->publish();
      if (n % 16 == 0) std::this_thread::yield();
    }
  });
  std::uint64_t bad = 0, last = 0;
  for (std::uint64_t got = 0; got < wanted;) {
    if (!box->take()) {
      std::this_thread::yield();
      continue;
    }
    ++got;
    const Message& message = box->read();
    const std::uint64_t first = message.word[0];
    for (const std::uint64_t word : message.word) bad += word != first ? 1U : 0U;
    bad += first <= last ? 1U : 0U;
    last = first;
  }
  done.store(true, std::memory_order_relaxed);
  writer.join();
  return bad;
}

TEST(Mailbox, IsNeverTornBetweenThreads) { EXPECT_EQ(stress<Mailbox<Message>>(2'000), 0U); }

TEST(Mailbox, DoesNotAllocate) {
  Mailbox<Message> sut;
  const test::NoAllocScope scope;
  sut.draft().word[0] = 7;
  sut.publish();
  EXPECT_TRUE(sut.take());
  EXPECT_EQ(sut.read().word[0], 7U);
  EXPECT_FALSE(sut.take());
  EXPECT_EQ(scope.count(), 0U);
}

/// A value that lets the other side run in the middle of its being copied.
struct Interrupted {
  std::uint64_t value{};
  static inline std::function<void()> meanwhile;
  Interrupted() = default;
  explicit Interrupted(std::uint64_t v) : value(v) {}
  Interrupted(const Interrupted&) = default;
  Interrupted& operator=(const Interrupted& other) {
    const std::function<void()> once = std::exchange(meanwhile, {});
    if (once) once();
    value = other.value;
    return *this;
  }
};

/// The reader looks while a push copies, the writer pushes while a pop copies. Returns what came out.
template <typename Ring>
std::vector<std::uint64_t> interrupted_exchange() {
  Ring ring;
  std::vector<std::uint64_t> out;
  const auto pop = [&] {
    Interrupted got(999);
    if (ring.pop(got)) out.push_back(got.value);
  };
  Interrupted::meanwhile = pop;
  ring.push(Interrupted(1));
  ring.push(Interrupted(2));
  Interrupted::meanwhile = [&] {
    ring.push(Interrupted(3));
    ring.push(Interrupted(4));
  };
  for (int i = 0; i < 6; ++i) pop();
  Interrupted::meanwhile = {};
  return out;
}

TEST(SpscRing, HandsOutWholeValuesInOrderThoughInterruptedAnywhere) {
  const auto out = interrupted_exchange<SpscRing<Interrupted, 2>>();
  ASSERT_GE(out.size(), 2U);
  // 3 and 4 find a full ring while 1 is being read, and are refused.
  EXPECT_EQ(out, (std::vector<std::uint64_t>{1, 2}));
}

TEST(SpscRing, TheSameTestCatchesTheBrokenTwin) {
  EXPECT_NE((interrupted_exchange<broken::HastyRing<Interrupted, 2>>()), (std::vector<std::uint64_t>{1, 2}));
}

TEST(SpscRing, RefusesAndCountsWhenFull) {
  SpscRing<int, 4> sut;
  int got = 0;
  EXPECT_FALSE(sut.pop(got));
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(sut.push(i));
  EXPECT_FALSE(sut.push(4));
  EXPECT_EQ(sut.dropped(), 1U);
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(sut.pop(got));
    EXPECT_EQ(got, i);
  }
  EXPECT_FALSE(sut.pop(got));
}

TEST(SpscRing, LosesNothingBetweenThreads) {
  constexpr std::uint64_t kCount = 200'000;
  SpscRing<std::uint64_t, 64> sut;
  std::thread writer([&] {
    for (std::uint64_t n = 0; n < kCount;) {
      if (sut.push(n))
        ++n;
      else
        std::this_thread::yield();
    }
  });
  std::uint64_t wrong = 0, got = 0;
  for (std::uint64_t n = 0; n < kCount;) {
    if (!sut.pop(got)) {
      std::this_thread::yield();
      continue;
    }
    wrong += got != n++ ? 1U : 0U;
  }
  writer.join();
  EXPECT_EQ(wrong, 0U);
}

}  // namespace
}  // namespace roborun::core
