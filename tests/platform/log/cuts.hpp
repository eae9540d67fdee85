#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/platform/log/sample_log.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::log::test {

/// Cuts the file behind each of its bytes, from the end on: all messages of the whole chunks are there, and no others.
inline void expect_cuts_read(const MemorySink& sink, std::size_t least_bytes) {
  ASSERT_GT(sink.bytes.size(), least_bytes);
  const std::string path = roborun::test::scratch_file("cut.mcap", sink.bytes);
  const Read whole = read_all(path);
  ASSERT_EQ(whole.damage, "");
  // The last append is the summary.
  const std::size_t chunks = sink.ends.size() - 1;
  ASSERT_EQ(whole.messages.size(), 10 * chunks);
  std::size_t whole_chunks = chunks;
  std::size_t lines = 0;
  for (std::size_t size = sink.bytes.size(); size-- > 0;) {
    std::filesystem::resize_file(path, size);
    const Read read = read_all(path);
    lines += !read.damage.empty() && read.damage.find('\n') == std::string::npos ? 1U : 0U;
    // A chunk is whole before the message indexes behind it are.
    while (whole_chunks > 0 && read.messages.size() < 10 * whole_chunks && size < sink.ends[whole_chunks - 1])
      --whole_chunks;
    ASSERT_EQ(read.messages.size(), 10 * whole_chunks) << "cut to " << size << " bytes: " << read.damage;
    ASSERT_TRUE(std::equal(read.messages.begin(), read.messages.end(), whole.messages.begin())) << size;
  }
  EXPECT_EQ(lines, sink.bytes.size()) << "a cut that nobody was told of";
  EXPECT_EQ(whole_chunks, 0U);
}

}  // namespace roborun::log::test
