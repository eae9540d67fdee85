#include "platform/report/trace_csv.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/platform/report/sample.hpp"

namespace roborun::report {
namespace {

TEST(TraceCsv, HasAHeaderALineADecisionAndAsManyFieldsEverywhere) {
  const std::vector<MissionReport> missions = {test::sample_mission("aware", 4.0),
                                               test::sample_mission("static", 0.5)};
  std::istringstream text(trace_csv(missions));
  std::string line;
  std::size_t lines = 0;
  std::ptrdiff_t commas = -1;
  while (std::getline(text, line)) {
    const auto here = std::count(line.begin(), line.end(), ',');
    if (commas < 0) commas = here;
    EXPECT_EQ(here, commas) << line;
    ++lines;
  }
  EXPECT_EQ(lines, 41U);
}

TEST(TraceCsv, SaysWhichImagesOfADecisionWereRefused) {
  std::vector<MissionReport> missions = {test::sample_mission("aware", 4.0)};
  missions[0].decisions[1].refused = "camera 1 fog+camera 2 turned";
  std::istringstream text(trace_csv(missions));
  std::string header, none, two;
  ASSERT_TRUE(std::getline(text, header) && std::getline(text, none) && std::getline(text, two));
  EXPECT_NE(header.find("planner,smoother,refused,missed"), std::string::npos) << header;
  EXPECT_TRUE(none.ends_with(",ok,ok,,0")) << none;
  EXPECT_TRUE(two.ends_with(",ok,ok,camera 1 fog+camera 2 turned,0")) << two;
}

}  // namespace
}  // namespace roborun::report
