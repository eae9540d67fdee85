#include "platform/report/evaluation_table.hpp"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/platform/report/sample.hpp"

namespace roborun::report {
namespace {

SweepRow row(const char* design, std::uint64_t seed, double speed_mps, double density_ratio = 0.45) {
  SweepRow r;
  r.result = test::sample_mission(design, speed_mps).result;
  r.result.seed = seed;
  r.result.map = r.result.planner = "own";
  r.density_ratio = density_ratio;
  r.spread_m = 80.0;
  r.distance_m = 900.0;
  return r;
}

/// True if a line of the table begins with `start` and has `value`.
::testing::AssertionResult says(const std::string& table, const std::string& start,
                                const std::string& value) {
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    if (line.size() > 110) return ::testing::AssertionFailure() << "too wide: " << line;
    if (line.rfind(start, 0) == 0 && line.find(value) != std::string::npos)
      return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure() << start << ": no " << value << " in\n" << table;
}

TEST(KernelTable, TellsWhatAwarenessGainsFromWhatFasterCodeGains) {
  std::vector<SweepRow> rows{row("static-fair", 1, 1.0), row("aware", 1, 2.0), row("static-fair", 1, 3.0),
                             row("aware", 1, 5.0)};
  rows[0].result.map = rows[1].result.map = "octomap";
  rows[0].result.planner = rows[1].result.planner = "ompl:RRTstar";
  const std::string table = kernel_table(rows);
  EXPECT_TRUE(says(table, "paper: awareness, octomap + ompl:RRTstar", "2.00"));
  EXPECT_TRUE(says(table, "paper: awareness, own", "1.67"));
  EXPECT_TRUE(says(table, "paper: own code, static-fair", "3.00"));
  EXPECT_TRUE(says(table, "paper: own code, aware", "2.50"));
  EXPECT_TRUE(says(table, "paper: both", "5.00"));
  EXPECT_EQ(kernel_table({}).find("nan"), std::string::npos);
}

TEST(SensitivityTable, GivesTimesTheirRatioItsIntervalOverSeedsAndThePublishedOne) {
  // 900 m: 180 and 225 s (ratio 1.25) with seed 1, 180 and 450 s (2.5) with seed 2: 1.875 +- 12.706 * 0.625.
  const std::vector<SweepRow> rows{row("aware", 1, 5.0, 0.3), row("aware", 1, 5.0),
                                   row("aware", 1, 4.0, 0.6), row("aware", 2, 5.0, 0.3),
                                   row("aware", 2, 5.0),      row("aware", 2, 2.0, 0.6)};
  const std::string table = sensitivity_table(rows, "paper");
  EXPECT_TRUE(says(table, "density ", "s at 0.3"));
  EXPECT_TRUE(says(table, "                  aware", "6 of 6"));
  EXPECT_TRUE(says(table, "                  aware", "1.88 +-7.94        1.5"));
  EXPECT_TRUE(says(table, "                  aware", "not compared; beside 5: 2, 8 missing")) << "spread";
  EXPECT_TRUE(says(table, "                  aware", "not compared; beside 5: 4, 6 missing")) << "distance";
}

TEST(SensitivityTable, ComparesNothingWhereAllKnobsChangeAtOnce) {
  // Environments 1, 14 and 27.
  std::vector<SweepRow> rows{row("aware", 1, 5.0, 0.3), row("aware", 1, 5.0), row("aware", 1, 4.0, 0.6)};
  rows.front().spread_m = 40.0;
  rows.front().distance_m = 600.0;
  rows.back().spread_m = 120.0;
  rows.back().distance_m = 1200.0;
  const std::string table = sensitivity_table(rows, "paper");
  EXPECT_TRUE(says(table, "                  aware", "not compared; beside 1: 10, 19 missing"));
  EXPECT_TRUE(says(table, "                  aware", "not compared; beside 1: 4, 7 missing"));
  EXPECT_TRUE(says(table, "                  aware", "not compared; beside 1: 2, 3 missing"));
  EXPECT_EQ(table.find("1.5\n"), std::string::npos) << "the published ratio has nothing beside it";
}

TEST(RepresentativeTable, SplitsLatencyByZoneAndStageBesideWhatWasPublished) {
  std::vector<MissionReport> flights;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    flights.push_back(test::sample_mission("aware", 4.0));  // 20 decisions, 45 m apart
    flights.back().result.seed = seed;
    for (DecisionRecord& d : flights.back().decisions) {
      d.stage_s = {0.1, 0.1, d.p_WB.x() < 200.0 ? 2.0 : 0.25, 0.1, 0.1, 0.1};
      d.latency_s = d.stage_s[2] + 0.5;
    }
    flights.back().decisions[0].latency_s = 3.0 * static_cast<double>(seed);
    flights.push_back(test::sample_mission("static", 0.5));
    flights.back().result.seed = seed;
  }
  const std::string table = representative_table(flights, {200.0, 700.0});
  EXPECT_TRUE(says(table, "aware ", "2/2        225 +-0"));
  EXPECT_TRUE(says(table, "aware against static", "8.00"));
  // Zone A: 5 decisions, the first of 3 and of 6 s: (3 + 4 * 2.5) / 5 = 2.6 and 3.2.
  EXPECT_TRUE(says(table, "aware        A", "2.90 +-3.81     6.00    up to 10    0.100    0.100    2.000"));
  EXPECT_TRUE(says(table, "aware        B", "0.15"));
  EXPECT_TRUE(says(representative_table(flights, {}), "aware        all", "6.00"));
  EXPECT_TRUE(says(table, "  published", "2.01"));
  for (MissionReport& flight : flights) flight.result.env = "2";
  const std::string other = representative_table(flights, {200.0, 700.0});
  EXPECT_TRUE(says(other, "aware ", "2/2        225 +-0"));
  for (const char* printed : {"2.01", "0.43", "4.6 velocity", "up to"})
    EXPECT_EQ(other.find(printed), std::string::npos) << printed << " is of environment 14";
  EXPECT_FALSE(says(other, "aware        B", "0.15"));
}

}  // namespace
}  // namespace roborun::report
