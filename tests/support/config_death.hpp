// Configs that are not valid cannot be made: every one of a table fails validate() and ends the program in the
// constructor.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <vector>

#include "firmware_if/assert.hpp"
#include "firmware_if/status.hpp"

namespace roborun::test {

inline void print_assertion(const char* condition, const char* file, int line) noexcept {
  std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
}

template <typename Config>
struct Spoilt {
  const char* what;
  std::function<void(Config&)> spoil;
};

/// `make` makes something of a config. Valid ones live, each spoilt one dies.
template <typename Config>
void expect_only_valid_configs(const Config& valid, const std::function<void(const Config&)>& make,
                               const std::vector<Spoilt<Config>>& spoilt) {
  ASSERT_EQ(valid.validate(), Status::kOk);
  make(valid);
  ASSERT_FALSE(spoilt.empty());
  for (const Spoilt<Config>& s : spoilt) {
    Config config = valid;
    s.spoil(config);
    EXPECT_EQ(config.validate(), Status::kInvalidArgument) << s.what;
    EXPECT_DEATH(
        {
          set_assertion_handler(print_assertion);
          make(config);
        },
        "assertion failed: .*validate\\(\\)")
        << s.what;
  }
}

}  // namespace roborun::test
