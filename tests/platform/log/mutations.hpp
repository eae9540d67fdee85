#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "core/random/counter_rng.hpp"
#include "tests/platform/log/sample_log.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::log::test {

/// Changes a file in up to three places, as often as asked: no message is read that was not written, and one line says what is wrong.
inline void expect_mutations_read(int mutations) {
  const MemorySink sink = sample_log(8, 200);
  const Read whole = read_all(roborun::test::scratch_file("whole.mcap", sink.bytes));
  ASSERT_EQ(whole.messages.size(), 80U);
  ASSERT_EQ(whole.damage, "");
  core::CounterRng rng(7, 0);
  int unharmed = 0;
  for (int i = 0; i < mutations; ++i) {
    std::string bytes = sink.bytes;
    const auto pick = [&rng](std::size_t below) { return static_cast<std::size_t>(rng.below(below)); };
    for (std::size_t changes = 1 + pick(3); changes > 0; --changes) {
      const std::size_t at = pick(bytes.size());
      switch (pick(4)) {
        case 0:
          bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>(1U << pick(8)));
          break;
        case 1:
          bytes[at] = static_cast<char>(pick(256));
          break;
        case 2:
          bytes.erase(at, 1 + pick(20));
          break;
        default:
          bytes.insert(at, noise(pick(1000), 1 + pick(20)));
      }
    }
    const Read read = read_all(roborun::test::scratch_file("mutated.mcap", bytes));
    unharmed += read.damage.empty() ? 1 : 0;
    if (bytes != sink.bytes && read.damage.empty()) {
      EXPECT_EQ(read.messages, whole.messages) << i;
    }
    EXPECT_EQ(read.damage.find('\n'), std::string::npos) << i;
    auto at = whole.messages.begin();
    for (const auto& message : read.messages) {
      at = std::find(at, whole.messages.end(), message);
      ASSERT_NE(at, whole.messages.end()) << i << ": a message that nobody wrote";
      ++at;
    }
  }
  EXPECT_LT(unharmed, mutations / 33);  // in what no CRC covers, such as the header's texts
}

}  // namespace roborun::log::test
