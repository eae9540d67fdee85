#include "platform/input/input_file.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::input {
namespace {

std::string complaint(const std::string& path, std::size_t most_bytes) {
  try {
    InputFile file(path, "a log");
    for (std::string line; file.line(line, most_bytes);) {
    }
    (void)read_text(path, "a log", most_bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(InputFile, GivesLinesWhateverTheirEnd) {
  const std::string longest(200000, 'x');
  const std::string path = test::scratch_file("lines", "a\n\n" + longest + "\nlast");
  InputFile file(path, "a log");
  std::vector<std::string> lines;
  for (std::string line; file.line(line, longest.size());) lines.push_back(line);
  EXPECT_EQ(lines, (std::vector<std::string>{"a", "", longest, "last"}));
}

TEST(InputFile, WhatCannotBeReadIsNotTheEnd) {
  EXPECT_EQ(complaint("nope", 10), "nope: cannot be opened: must be a log");
  const std::string folder = test::scratch_folder().string();
  EXPECT_EQ(complaint(folder, 10), folder + ": cannot be read: Is a directory");
  // A page that is not mapped: EIO.
  EXPECT_EQ(complaint("/proc/self/mem", 10), "/proc/self/mem: cannot be read: Input/output error");
}

TEST(InputFile, NothingIsLongerThanItsLimit) {
  const std::string path = test::scratch_file("long", "short\n" + std::string(100, 'x') + "\n");
  EXPECT_EQ(complaint(path, 99), path + ": line 2: longer than 99 bytes: must be a file of lines");
  EXPECT_EQ(complaint(path, 100), path + ": larger than 0 MiB: must be a log") << "read_text";
  EXPECT_EQ(complaint(path, 1000), "");
  EXPECT_EQ(complaint("/dev/zero", 1U << 20U),
            "/dev/zero: line 1: longer than 1048576 bytes: must be a file of lines");
}

}  // namespace
}  // namespace roborun::input
