// The texts of an enumeration, as files, messages and machines read them.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

namespace roborun::test {

/// Enumerators count from 0. `beyond`: the text of a value that is none.
template <typename Enum>
void expect_names(std::initializer_list<const char*> names, const char* beyond = nullptr) {
  ASSERT_GT(names.size(), 1U);
  unsigned value = 0;
  for (const char* name : names) EXPECT_EQ(std::string(to_string(static_cast<Enum>(value++))), name);
  if (beyond != nullptr) {
    EXPECT_EQ(std::string(to_string(static_cast<Enum>(value))), beyond);
  }
}

}  // namespace roborun::test
