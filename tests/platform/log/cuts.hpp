#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <string>

#include "tests/platform/log/sample_log.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::log::test {

/// How many messages can be read, all of them those of `whole` in its order; -1: one of them is another.
inline std::ptrdiff_t same_messages(const std::string& path, const Read& whole, std::string& damage) {
  std::size_t count = 0;
  try {
    McapReader reader(path);
    for (Message message; reader.next(message); ++count) {
      if (count >= whole.messages.size() || message.channel->topic != whole.messages[count].first ||
          message.data != whole.messages[count].second)
        return -1;
    }
    damage = reader.damage();
  } catch (const InputError& error) {
    damage = error.what();
  }
  return static_cast<std::ptrdiff_t>(count);
}

/// Cuts the file behind each of its bytes, from the end on: all messages of the whole chunks are there, and no others.
inline void expect_cuts_read(const MemorySink& sink, std::size_t least_bytes) {
  ASSERT_GE(sink.bytes.size(), least_bytes);
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
    std::string damage;
    const std::ptrdiff_t read = same_messages(path, whole, damage);
    lines += !damage.empty() && damage.find('\n') == std::string::npos ? 1U : 0U;
    // A chunk is whole before the message indexes behind it are.
    const auto left = [&] { return static_cast<std::ptrdiff_t>(10 * whole_chunks); };
    while (whole_chunks > 0 && read < left() && size < sink.ends[whole_chunks - 1]) --whole_chunks;
    ASSERT_EQ(read, left()) << "cut to " << size << " bytes: " << damage;
  }
  EXPECT_EQ(lines, sink.bytes.size()) << "a cut that nobody was told of";
  EXPECT_EQ(whole_chunks, 0U);
}

}  // namespace roborun::log::test
