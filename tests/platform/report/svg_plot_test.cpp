#include "platform/report/svg_plot.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/platform/report/sample.hpp"
#include "tests/platform/report/xml.hpp"

namespace roborun::report {
namespace {

using test::count;
using test::well_formed;

Scene scene() {
  Scene s;
  s.title = "a <title> & more";
  s.bounds_W = {{-50.0, -50.0, 0.0}, {950.0, 50.0, 10.0}};
  s.goal_W = Vector3(900.0, 0.0, 5.0);
  s.circles = {{100.0, 0.0, 2.0}, {200.0, 5.0, 2.0}};
  s.rects = {{300.0, 0.0, 10.0, 5.0}};
  s.zone_borders_m = {120.0, 780.0};
  s.heat_cell_m = 100.0;
  s.heat_columns = 10;
  s.heat_rows = 1;
  s.heat_ratio = {0.0, 0.5, 0.9, 0.1, 0.0, 0.0, 0.0, 0.0, 0.3, 0.6};
  return s;
}

TEST(MissionSvg, IsWellFormedSelfContainedAndDrawsWhatItIsGiven) {
  const std::vector<MissionReport> missions = {test::sample_mission("aware", 4.0),
                                               test::sample_mission("static", 0.5)};
  for (const PathColour colour : {PathColour::kSpeed, PathColour::kPrecision}) {
    const std::string svg = mission_svg(scene(), missions, colour);
    EXPECT_TRUE(well_formed(svg));
    EXPECT_TRUE(test::is_for_pages(svg));
    EXPECT_EQ(svg.find("href"), std::string::npos) << "no external resources";
    EXPECT_GE(count(svg, "<circle"), 2U * 2U) << "pillars in each panel";
    EXPECT_NE(svg.find("static"), std::string::npos);
    EXPECT_NE(svg.find("a &lt;title&gt; &amp; more"), std::string::npos);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
  }
}

TEST(MapsSvg, ShowsEveryQuantityOfEveryMission) {
  std::vector<MissionReport> missions = {test::sample_mission("static", 0.5),
                                         test::sample_mission("aware", 4.0)};
  for (std::size_t i = 0; i < missions[1].decisions.size(); ++i)
    missions[1].decisions[i].v0_m3 = 1e3 * static_cast<double>(i);
  const std::string svg = maps_svg(scene(), missions);
  EXPECT_TRUE(well_formed(svg));
  EXPECT_TRUE(test::is_for_pages(svg));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  EXPECT_EQ(count(svg, "path: "), kPathColourName.size());
  EXPECT_EQ(count(svg, "#e12d39"), 2U * kPathColourName.size()) << "a flag a map";
  EXPECT_TRUE(well_formed(maps_svg(scene(), {})));
  // The volume of the aware mission goes through the colours; that of the static one stays at the lowest.
  const std::string by_volume =
      mission_svg(scene(), std::vector<MissionReport>{missions[1]}, PathColour::kVolume);
  const std::string flat = mission_svg(scene(), std::vector<MissionReport>{missions[0]}, PathColour::kVolume);
  EXPECT_GT(count(by_volume, "stroke-width=\"2.6\""), 15U);
  constexpr std::size_t kPlaces = 3;  // the world and its two ends
  EXPECT_LE(count(flat, "stroke-width=\"2.6\""), 2U * kPlaces);
  EXPECT_NE(flat.find(">zone A with static: "), std::string::npos);
  EXPECT_NE(flat.find(">zone C with static: "), std::string::npos);
}

TEST(MissionSvg, SurvivesAMissionWithoutDecisionsAndAWorldWithoutAnything) {
  Scene bare;
  bare.bounds_W = {{0.0, 0.0, 0.0}, {10.0, 10.0, 10.0}};
  const std::vector<MissionReport> missions = {MissionReport{}};
  const std::string svg = mission_svg(bare, missions, PathColour::kSpeed);
  EXPECT_TRUE(well_formed(svg));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

}  // namespace
}  // namespace roborun::report
