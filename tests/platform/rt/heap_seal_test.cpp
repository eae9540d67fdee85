#include "platform/rt/heap_seal.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

namespace roborun::rt {
namespace {

/// A heap call that no compiler may leave out.
void one_heap_call() {
  void* volatile block = std::malloc(32);
  std::free(block);
}

class HeapSealed : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!heap_seal_works()) GTEST_SKIP() << "the sanitizer owns the heap";
  }
  void TearDown() override {
    seal_heap(HeapSeal::kOpen);
    watch_this_thread(false);
  }
};

TEST_F(HeapSealed, CountsWhatAWatchedThreadDoesAfterTheSealAndNothingElse) {
  const std::uint64_t before = sealed_heap_calls();
  watch_this_thread(true);
  one_heap_call();
  EXPECT_EQ(sealed_heap_calls(), before) << "not sealed yet";
  seal_heap(HeapSeal::kCount);
  one_heap_call();
  const std::uint64_t two = sealed_heap_calls();
  void* volatile made = ::operator new(400);
  ::operator delete(made);
  const std::uint64_t four = sealed_heap_calls();
  watch_this_thread(false);
  one_heap_call();
  const std::uint64_t after = sealed_heap_calls();
  seal_heap(HeapSeal::kOpen);
  EXPECT_EQ(two - before, 2U);
  EXPECT_EQ(four - two, 2U) << "operator new and delete come by malloc and free";
  EXPECT_EQ(after, four) << "another thread's business";
}

TEST_F(HeapSealed, NamesTheCallSites) {
  const std::uint64_t before = sealed_heap_calls();
  watch_this_thread(true);
  seal_heap(HeapSeal::kCount);
  for (int i = 0; i < 5; ++i) one_heap_call();
  seal_heap(HeapSeal::kOpen);
  watch_this_thread(false);
  std::uint64_t named = 0;
  for (const HeapCallSite& site : heap_call_sites()) {
    EXPECT_FALSE(site.name.empty());
    named += site.count;
  }
  EXPECT_EQ(sealed_heap_calls() - before, 10U);
  EXPECT_GE(named, 10U);
}

using HeapSealedDeathTest = HeapSealed;
TEST_F(HeapSealedDeathTest, IsFatalWhereTestsWantItSo) {
  EXPECT_DEATH(
      {
        watch_this_thread(true);
        seal_heap(HeapSeal::kFatal);
        one_heap_call();
      },
      "heap call in a real-time lane after start");
}

}  // namespace
}  // namespace roborun::rt
