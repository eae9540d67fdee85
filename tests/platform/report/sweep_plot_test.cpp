#include "platform/report/sweep_plot.hpp"

#include <gtest/gtest.h>

#include "tests/platform/report/sample.hpp"
#include "tests/platform/report/xml.hpp"

namespace roborun::report {
namespace {

using test::count;
using test::well_formed;

/// Three environments along the density, two designs, `seeds` seeds.
std::vector<SweepRow> rows(std::uint64_t seeds) {
  std::vector<SweepRow> rows;
  for (int env = 0; env < 3; ++env) {
    for (const char* design : {"aware", "static"}) {
      for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        SweepRow row;
        const double speed_mps = (design[0] == 'a' ? 4.0 : 0.5) + 0.1 * static_cast<double>(seed);
        row.result = test::sample_mission(design, speed_mps).result;
        row.result.env = std::to_string(env);
        row.result.seed = seed;
        row.result.latency_s = {0.5, 1.0, 2.0};
        row.density_ratio = 0.3 + 0.15 * env;
        row.spread_m = 80.0;
        row.distance_m = 900.0;
        rows.push_back(row);
      }
    }
  }
  return rows;
}

/// Well formed, alone in its file, and no number that is none.
bool sound(const std::string& svg) {
  return well_formed(svg) && test::is_for_pages(svg) && svg.find("href") == std::string::npos &&
         svg.find("nan") == std::string::npos && svg.find("inf") == std::string::npos;
}

constexpr const char* kWhisker = "stroke-width=\"1.4\"";

TEST(OverallSvg, DrawsABarADesignThePublishedValueAndIntervalsOnlyWithMoreSeeds) {
  const std::string one = overall_svg(rows(1));
  EXPECT_TRUE(sound(one));
  EXPECT_EQ(count(one, "aware (paper) flies 6.8 times as fast as static (paper)"), 2U) << "4.1 and 0.6 m/s";
  EXPECT_EQ(count(one, "[2.5]"), 1U);
  EXPECT_EQ(count(one, "[2093]"), 1U);
  EXPECT_EQ(count(one, kWhisker), 0U);
  const std::string three = overall_svg(rows(3));
  EXPECT_TRUE(sound(three));
  // Velocity, time, energy, latency and CPU time of two designs.
  EXPECT_EQ(count(three, kWhisker), 10U);
}

TEST(SensitivitySvg, WritesTheRatioOfTheHighestKnobToTheLowestBesideThePublishedOne) {
  std::vector<SweepRow> sut = rows(1);
  for (SweepRow& row : sut) {
    if (row.result.design == "aware") row.result.mission_time_s = row.density_ratio > 0.5 ? 300.0 : 200.0;
  }
  const std::string svg = sensitivity_svg(sut, "paper");
  EXPECT_TRUE(sound(svg));
  EXPECT_EQ(count(svg, "What costs most is density: aware takes 1.50 times as long at its highest"), 2U);
  EXPECT_EQ(count(svg, "1.50x [1.5x]"), 1U);
  EXPECT_EQ(count(sensitivity_svg(rows(3), "paper"), kWhisker), 3U * 2U * 3U)
      << "metrics, designs, densities";
  EXPECT_EQ(count(svg, "static: beside 5: 4, 6 missing"), 3U) << "the distance of no two rows differs";
}

TEST(SensitivitySvg, DrawsNothingFromEnvironmentsInWhichAllKnobsChange) {
  std::vector<SweepRow> sut = rows(1);
  for (SweepRow& row : sut) {
    row.spread_m = row.density_ratio < 0.4 ? 40.0 : row.density_ratio > 0.5 ? 120.0 : 80.0;
    row.distance_m = 7.5 * row.spread_m + 300.0;
  }
  const std::string svg = sensitivity_svg(sut, "paper");
  EXPECT_TRUE(sound(svg));
  EXPECT_EQ(count(svg, "<polyline"), 0U);
  EXPECT_EQ(count(svg, "[1.5x]"), 0U);
  EXPECT_EQ(count(svg, "aware: beside 1: 10, 19 missing"), 3U);
}

TEST(BreakdownSvg, DrawsEveryStageAndTheMeanOfEachZone) {
  MissionReport flight = test::sample_mission("aware", 4.0);  // 20 decisions, 45 m apart
  for (DecisionRecord& d : flight.decisions) {
    d.deadline_s = 1.0;
    d.stage_s = {0.1, 0.1, d.p_WB.x() < 200.0 ? 2.0 : 0.25, 0.1, 0.1, 0.1};
    d.latency_s = d.stage_s[2] + 0.5;
  }
  const std::string svg = breakdown_svg(std::vector<MissionReport>{flight}, {200.0, 700.0});
  EXPECT_TRUE(sound(svg));
  EXPECT_EQ(count(svg, "aware spends most of its time in the stage map: 58 %"), 2U);
  EXPECT_EQ(count(svg, "A: 2.50"), 1U);
  EXPECT_EQ(count(svg, "B: 0.75"), 1U);
  EXPECT_EQ(count(svg, "C: 0.75"), 1U);
}

TEST(SweepPictures, SurviveASweepInWhichNothingArrived) {
  std::vector<SweepRow> none = rows(2);
  for (SweepRow& row : none) row.result.reached_goal = false;
  EXPECT_TRUE(sound(overall_svg(none)));
  EXPECT_TRUE(sound(overall_svg({})));
  EXPECT_TRUE(sound(sensitivity_svg(none, "paper")));
  EXPECT_TRUE(sound(sensitivity_svg({}, "paper")));
  EXPECT_TRUE(sound(breakdown_svg(std::vector<MissionReport>{MissionReport{}}, {})));
}

}  // namespace
}  // namespace roborun::report
