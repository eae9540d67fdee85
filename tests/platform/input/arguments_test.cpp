#include "platform/input/arguments.hpp"

#include <gtest/gtest.h>

#include "platform/input/input_error.hpp"

namespace roborun::input {
namespace {

TEST(Arguments, NumbersAreWholeFiniteAndInRange) {
  EXPECT_EQ(whole_of("--jobs", "8", 1, 9), 8);
  EXPECT_EQ(number_of("--at", "2.5e1", 0, 100), 25.0);
  EXPECT_EQ(seed_of("--seed", "18446744073709551615"), UINT64_MAX);
  for (const char* text : {"", " 1", "1 ", "1x", "x", "--1", "nan", "inf", "1e999", "101", "-1", "0x1p3"}) {
    EXPECT_FALSE(number(text) && *number(text) >= 0 && *number(text) <= 100) << text;
    EXPECT_THROW((void)number_of("--at", text, 0, 100), InputError) << text;
    EXPECT_THROW((void)whole_of("--jobs", text, 0, 100), InputError) << text;
  }
  for (const char* text : {"", "-1", "+1", "1.0", "1x", "18446744073709551616"})
    EXPECT_THROW((void)seed_of("--seed", text), InputError) << text;
  EXPECT_THROW((void)whole_of("--jobs", "1.5", 0, 100), InputError);
}

}  // namespace
}  // namespace roborun::input
