#include "platform/report/map_picture.hpp"

#include <gtest/gtest.h>

#include <array>

#include "tests/platform/report/xml.hpp"

namespace roborun::report {
namespace {

MapPanel panel() {
  constexpr auto U = CellColour::kUnknown, F = CellColour::kFree, O = CellColour::kOccupied;
  MapPanel p;
  p.title = "a <cut> & more";
  p.right_axis = "x [m]";
  p.up_axis = "z [m]";
  p.right_m = -1.0;
  p.up_m = 2.0;
  p.cell_m = 0.5;
  p.columns = 4;
  p.rows = 2;
  p.cell = {O, O, F, U,  // the lowest row
            U, F, F, F};
  return p;
}

TEST(MapPicture, RunsOfEqualCellsAreOneRectangleAndUnknownIsTheGround) {
  const std::array<MapPanel, 1> panels{panel()};
  const std::string svg = map_svg("map & file", panels);
  EXPECT_TRUE(test::well_formed(svg)) << svg;
  EXPECT_EQ(test::count(svg, R"(fill="#222"/>)"), 1U + 1U) << "one run, one in the legend";
  EXPECT_EQ(test::count(svg, R"(fill="#cfe8ff"/>)"), 2U + 1U);
  EXPECT_NE(svg.find("-1.0 .. 1.0 x [m]"), std::string::npos);
  EXPECT_NE(svg.find("2.0 .. 3.0 z [m]"), std::string::npos);
}

TEST(MapPicture, TheLowestRowIsAtTheBottom) {
  MapPanel p = panel();
  p.cell.assign(8, CellColour::kUnknown);
  p.cell[0] = CellColour::kOccupied;
  const std::string low = map_svg("t", {&p, 1});
  std::swap(p.cell[0], p.cell[4]);
  const std::string high = map_svg("t", {&p, 1});
  const auto y_px = [](const std::string& svg) {
    const std::size_t end = svg.rfind(R"(fill="#222"/>)"), at = svg.rfind(R"(y=")", end) + 3;
    return std::stod(svg.substr(at, svg.find('"', at) - at));
  };
  EXPECT_GT(y_px(low), y_px(high)) << "y grows downwards in a picture";
}

TEST(MapPicture, EveryPanelIsDrawnBelowTheOneBefore) {
  const std::array<MapPanel, 3> panels{panel(), panel(), panel()};
  const std::string svg = map_svg("t", panels);
  EXPECT_TRUE(test::well_formed(svg));
  EXPECT_EQ(test::count(svg, "a &lt;cut&gt; &amp; more"), 3U);
}

}  // namespace
}  // namespace roborun::report
