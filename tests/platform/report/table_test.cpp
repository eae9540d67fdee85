#include "platform/report/table.hpp"

#include <gtest/gtest.h>

#include <sstream>
#include <vector>

#include "tests/platform/report/sample.hpp"

namespace roborun::report {
namespace {

TEST(ComparisonTable, HasARowADesignAndRatiosAgainstStatic) {
  const std::vector<MissionResult> results = {test::sample_mission("aware", 4.0).result,
                                              test::sample_mission("static", 0.5).result};
  const std::string text = comparison_table(results);
  EXPECT_NE(text.find("8.0x v, 0.12x kJ"), std::string::npos) << text;
  EXPECT_NE(text.find("  121.2 + 3.8 "), std::string::npos) << text;
  std::istringstream lines(text);
  std::string line;
  int rows = 0;
  while (std::getline(lines, line)) {
    EXPECT_LE(line.size(), 110U + 20U);
    ++rows;
  }
  EXPECT_EQ(rows, 4);
}

TEST(ComparisonTable, GivesNoRatioAgainstABaselineThatFailed) {
  std::vector<MissionResult> results = {test::sample_mission("aware", 4.0).result,
                                        test::sample_mission("static", 0.5).result};
  results[1].reached_goal = false;
  results[1].reason = "gave_up";
  EXPECT_EQ(comparison_table(results).find("x v"), std::string::npos);
  EXPECT_NE(comparison_table(results).find("gave_up"), std::string::npos);
}

}  // namespace
}  // namespace roborun::report
