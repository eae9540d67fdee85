#include "firmware_if/assert.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "firmware_if/status.hpp"
#include "tests/support/config_death.hpp"
#include "tests/support/names.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun {
namespace {

constexpr int checked(int x) {
  ROBORUN_ASSERT(x > 0);
  return x;
}
static_assert(checked(1) == 1, "usable in constant expressions");

/// A fail-safe with a bug of its own.
void broken_handler(const char*, const char*, int) noexcept {
  std::fprintf(stderr, "once\n");
  ROBORUN_ASSERT(false);
  std::fprintf(stderr, "twice\n");
}

TEST(Assert, IsArmedInThisBuildWithNdebugOrWithout) { EXPECT_DEATH(ROBORUN_ASSERT(1 + 1 == 3), ""); }

TEST(Assert, TellsTheHandlerWhatFailedAndWhere) {
  EXPECT_DEATH(
      {
        set_assertion_handler(test::print_assertion);
        ROBORUN_ASSERT(1 + 1 == 3);
      },
      "assert_test.cpp:[0-9]+: assertion failed: 1 \\+ 1 == 3");
}

TEST(Assert, EndsTheProgramWhenTheHandlerReturnsOrFailsItself) {
  EXPECT_DEATH(
      {
        set_assertion_handler(broken_handler);
        ROBORUN_ASSERT(false);
      },
      "^once\n$");
}

TEST(Assert, DoesNothingAndAllocatesNothingWhenTheConditionHolds) {
  int evaluated = 0;
  set_assertion_handler(broken_handler);
  const test::NoAllocScope scope;
  ROBORUN_ASSERT(++evaluated == 1);
  EXPECT_EQ(scope.count(), 0U);
  EXPECT_EQ(evaluated, 1) << "exactly once";
  set_assertion_handler(nullptr);
}

TEST(Result, HasNoValueToReadWhereThereIsNone) {
  Result<int> none = Status::kNotReady;
  EXPECT_DEATH((void)none.value(), "");
}

TEST(Status, HasANameForMessages) {
  test::expect_names<Status>({"ok", "not ready", "invalid argument", "budget spent", "capacity", "stale",
                              "start blocked", "goal blocked", "no path", "infeasible", "i/o"},
                             "unknown status");
}

}  // namespace
}  // namespace roborun
