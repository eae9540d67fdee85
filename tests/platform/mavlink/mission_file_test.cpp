#include "platform/mavlink/mission_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "platform/input/input_error.hpp"

namespace roborun::mavlink {
namespace {

using Kind = MissionItem::Kind;

const std::string kData = std::string(ROBORUN_TEST_DATA) + "/missions/";

std::string refusal(const std::string& text) {
  const std::string path = ::testing::TempDir() + "mission_file_test.txt";
  std::ofstream(path) << text;
  try {
    (void)load_mission(path);
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.rfind(path + ": ", 0), 0U) << what;
    return what.substr(path.size() + 2);
  }
  return {};
}

std::string wpl(const std::string& rows) {
  return "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.4\t8.5\t488\t1\n" + rows;
}

std::string plan(const std::string& items, const std::string& more = "") {
  return R"({"fileType":"Plan","mission":{"plannedHomePosition":[47.4,8.5,488],"items":[)" + items + "]}" +
         more + "}";
}

TEST(MissionFileTest, ReadsAPlanWithItsFence) {
  const MissionFile file = load_mission(kData + "two_pillars.plan");
  ASSERT_EQ(file.items.size(), 7U);
  constexpr std::array<Kind, 7> kWanted{Kind::kTakeOff, Kind::kWaypoint, Kind::kSpeed, Kind::kWaypoint,
                                        Kind::kRelease, Kind::kHold,     Kind::kReturn};
  for (std::size_t i = 0; i < kWanted.size(); ++i) EXPECT_EQ(file.items[i].kind, kWanted.at(i)) << i;
  EXPECT_DOUBLE_EQ(file.items[0].height_m, 4.0);
  EXPECT_DOUBLE_EQ(file.items[1].hold_s, 2.0);
  EXPECT_DOUBLE_EQ(file.items[2].speed_mps, 2.0);
  EXPECT_EQ(file.items[3].where, "item 4");
  EXPECT_DOUBLE_EQ(file.home_height_m, 488.0);
  ASSERT_EQ(file.fence.size(), 2U);
  EXPECT_TRUE(file.fence[0].keep_in);
  EXPECT_EQ(file.fence[0].points.size(), 4U);
  EXPECT_FALSE(file.fence[1].keep_in);
  EXPECT_DOUBLE_EQ(file.fence[1].radius_m, 2.0);
}

TEST(MissionFileTest, ReadsWaypointsWithHeightsOverTheSea) {
  const MissionFile file = load_mission(kData + "two_pillars.waypoints");
  ASSERT_EQ(file.items.size(), 5U);
  EXPECT_EQ(file.items[1].kind, Kind::kWaypoint);
  EXPECT_DOUBLE_EQ(file.items[1].height_m, 4.0);
  EXPECT_EQ(file.items[1].where, "line 4");
  EXPECT_EQ(file.items[4].kind, Kind::kLand);
  EXPECT_TRUE(file.fence.empty());
}

TEST(MissionFileTest, RefusesLinesOfWaypointsByTheirNumber) {
  EXPECT_EQ(
      refusal(wpl("1\t0\t3\t82\t0\t0\t0\t0\t47.4\t8.5\t10\t1\n")).rfind("line 3: command 82 is not known", 0),
      0U);
  EXPECT_EQ(
      refusal(wpl("1\t0\t10\t16\t0\t0\t0\t0\t47.4\t8.5\t10\t1\n")).rfind("line 3: frame 10: must be", 0), 0U);
  EXPECT_EQ(refusal(wpl("1\t0\t3\t16\t0\t0\t0\t0\t97.4\t8.5\t10\t1\n")).rfind("line 3: (97.4, 8.5) is no", 0),
            0U);
  EXPECT_EQ(refusal(wpl("1\t0\t3\t16\t0\t0\t0\t0\t47.4\t8.5\t10\n")),
            "line 3: must be 12 numbers with tabs between");
  EXPECT_EQ(refusal(wpl("1\t0\t3\t16\tx\t0\t0\t0\t47.4\t8.5\t10\t1\n")),
            "line 3: must be 12 numbers with tabs between");
  EXPECT_EQ(refusal(wpl("1\t0\t3\t16\t-1\t0\t0\t0\t47.4\t8.5\t10\t1\n")),
            "line 3: hold, s: -1: must be from 0 to 3600");
  EXPECT_EQ(refusal(wpl("1\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1\n2\t0\t3\t16\t0\t0\t0\t0\t47.4\t8.5\t10\t1\n")),
            "line 3: land, return: must be the last item");
  EXPECT_EQ(refusal(wpl("")), "goes nowhere: must have a way-point");
  EXPECT_EQ(refusal("QGC WPL 120\n"), "line 1: must be QGC WPL 110");
  EXPECT_EQ(refusal("nonsense").rfind("must be a mission", 0), 0U);
}

TEST(MissionFileTest, RefusesItemsOfPlansByTheirNumber) {
  const std::string good =
      R"({"type":"SimpleItem","command":16,"frame":3,"params":[0,0,0,null,47.4,8.5,10]})";
  EXPECT_EQ(refusal(plan(good)), "");
  EXPECT_EQ(refusal(plan(good + R"(,{"type":"ComplexItem"})")).rfind("item 2: type \"ComplexItem\"", 0), 0U);
  EXPECT_EQ(refusal(plan(good + R"(,{"type":"SimpleItem","command":177,"frame":2,"params":[1,1,0,0,0,0,0]})"))
                .rfind("item 2: command 177 is not known", 0),
            0U);
  EXPECT_EQ(
      refusal(plan(good + R"(,{"type":"SimpleItem","command":1e99,"frame":2,"params":[1,1,0,0,0,0,0]})"))
          .rfind("item 2: command -1 is not known", 0),
      0U);
  EXPECT_EQ(
      refusal(plan(good + R"(,{"type":"SimpleItem","command":211,"frame":2,"params":[1,1,0,0,0,0,0]})")),
      "item 2: gripper action 1: must be 0 (release)");
  EXPECT_EQ(refusal(plan(good + R"(,{"type":"SimpleItem","command":16,"frame":3,"params":[0]})")),
            "item 2: params: must be 7 numbers or nulls");
  EXPECT_EQ(
      refusal(
          plan(good, R"(,"geoFence":{"circles":[{"inclusion":true,"circle":{"center":[1,2],"radius":0}}]})")),
      "fence circle 1: radius: must be above 0 m");
  EXPECT_EQ(refusal(plan(good, R"(,"geoFence":{"polygons":[7]})")), "fence polygon 1: has no inclusion");
  EXPECT_EQ(
      refusal(plan(good, R"(,"rallyPoints":{"points":[[1,2,3]]})")).rfind("rallyPoints: are not known", 0),
      0U);
  EXPECT_EQ(refusal("{").rfind("not JSON: ", 0), 0U);
  EXPECT_EQ(refusal("{}"), "fileType: must be Plan");
}

}  // namespace
}  // namespace roborun::mavlink
