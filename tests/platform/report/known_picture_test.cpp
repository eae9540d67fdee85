#include "platform/report/known_picture.hpp"

#include <gtest/gtest.h>

#include "tests/platform/report/sample.hpp"
#include "tests/platform/report/xml.hpp"

namespace roborun::report {
namespace {

using Cell = KnownSlice::Cell;

/// 2 x 2 cells of 10 m: free, free / occupied, unknown.
MissionReport flown() {
  MissionReport mission = test::sample_mission("aware", 4.0);
  mission.known = {3.0, 10.0, 0.0, 0.0, 2, 2, {Cell::kFree, Cell::kFree, Cell::kOccupied, Cell::kUnknown}};
  return mission;
}

Scene scene() {
  Scene s;
  s.title = "maze & more";
  s.bounds_W = {{0.0, 0.0, 1.0}, {20.0, 20.0, 5.0}};
  s.goal_W = Vector3(15.0, 15.0, 3.0);
  return s;
}

TEST(KnownSvg, DrawsRunsOfKnownCellsOnceAndLeavesTheRestUnknown) {
  const std::vector<MissionReport> missions{flown()};
  const std::string svg = known_svg(scene(), missions);
  EXPECT_TRUE(test::well_formed(svg));
  EXPECT_EQ(test::count(svg, R"(fill="#e8f3ff"/>)"), 1U) << "two free cells in a row are one rectangle";
  EXPECT_EQ(test::count(svg, R"(fill="#d55e00"/>)"), 1U);
  EXPECT_NE(svg.find("width=\"830\""), std::string::npos);
  EXPECT_NE(svg.find("<title>aware reached the goal in "), std::string::npos) << "what it shows";
  EXPECT_EQ(test::count(svg, "maze &amp; more"), 2U)
      << "what it is of: below the title, and in the description";
  EXPECT_NE(svg.find("<desc>"), std::string::npos);
}

TEST(KnownSvg, FliesADotAlongThePathTrueToTime) {
  MissionReport mission = flown();
  mission.path.clear();
  for (int i = 0; i <= 100;
       ++i)  // 10 s at 10 Hz, 1 m/s along x: 21 points, half a second apart, 10 times as fast
    mission.path.push_back({0.1 * i, Vector3(0.1 * i, 0.0, 3.0), 1.0});
  const std::string svg = known_svg(scene(), std::vector<MissionReport>{mission});
  EXPECT_TRUE(test::well_formed(svg));
  ASSERT_EQ(test::count(svg, "<animate "), 2U);
  const std::size_t begin = svg.find("attributeName=\"cx\" values=\"");
  const std::string values = svg.substr(begin, svg.find("\" dur=\"", begin) - begin);
  EXPECT_EQ(test::count(values, ";"), 20U);
  EXPECT_EQ(test::count(svg, "dur=\"1.0s\""), 2U);
}

TEST(KnownSvg, DrawsNothingOutsideOfTheBounds) {
  std::vector<MissionReport> missions{flown()};
  missions.front().known.x_m = 100.0;
  EXPECT_EQ(test::count(known_svg(scene(), missions), R"(fill="#e8f3ff"/>)"), 0U);
}

}  // namespace
}  // namespace roborun::report
