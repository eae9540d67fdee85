#include "platform/report/trace_csv.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/platform/report/sample.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::report {
namespace {

TEST(TraceCsv, HasAHeaderALineADecisionAndAsManyFieldsEverywhere) {
  const std::string path = test::scratch("trace.csv");
  const std::vector<MissionReport> missions = {test::sample_mission("aware", 4.0),
                                               test::sample_mission("static", 0.5)};
  ASSERT_EQ(write_trace_csv(path, missions), "");
  std::ifstream file(path);
  std::string line;
  std::size_t lines = 0;
  std::ptrdiff_t commas = -1;
  while (std::getline(file, line)) {
    const auto here = std::count(line.begin(), line.end(), ',');
    if (commas < 0) commas = here;
    EXPECT_EQ(here, commas) << line;
    ++lines;
  }
  EXPECT_EQ(lines, 41U);
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

TEST(TraceCsv, SaysWhyItCannotWriteAndLeavesNothing) {
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
}  // namespace roborun::report
