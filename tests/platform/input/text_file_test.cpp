#include "platform/input/text_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/scratch.hpp"

namespace roborun::input {
namespace {

TEST(TextFile, SaysWhyItCannotWriteAndLeavesNothing) {
  const std::string line = write_file("/nonexistent/folder/trace.csv", "x");
  EXPECT_NE(line.find("/nonexistent/folder/trace.csv: cannot be written"), std::string::npos);
  const auto folder = test::scratch_folder() / "is_a_folder.csv";
  std::filesystem::create_directories(folder / "x");
  EXPECT_NE(write_file(folder.string(), "x"), "");
  EXPECT_NE(cannot_write(folder.string()), "");
  EXPECT_NE(cannot_write("/nonexistent/folder/trace.csv"), "");
  EXPECT_EQ(cannot_write(test::scratch("new.csv")), "");
  EXPECT_EQ(cannot_write(""), "");
  EXPECT_FALSE(std::filesystem::exists(folder.string() + ".part"));
}

}  // namespace
}  // namespace roborun::input
