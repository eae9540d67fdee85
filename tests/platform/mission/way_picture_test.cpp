#include "platform/mission/way_picture.hpp"

#include <gtest/gtest.h>

#include "platform/sitl/world/world_maker.hpp"

namespace roborun::mission {
namespace {

TEST(WayPicture, SaysAndDrawsWhatTheJudgeFound) {
  const sitl::World maze{sitl::make_world(sitl::WorldKind::kMaze, 4, {})};
  sitl::WayQuestion question;
  question.radius_m = 0.8;
  const std::string svg = way_svg(maze, 0.8, sitl::judge_way(maze, question), "a <maze>");
  EXPECT_TRUE(svg.starts_with("<svg"));
  EXPECT_NE(svg.find("<title>a &lt;maze&gt;: a way of "), std::string::npos);
  EXPECT_NE(svg.find("<polyline"), std::string::npos);
}

TEST(WayPicture, WithoutAWayItSaysHowWideTheWidestIs) {
  sitl::WorldDescription d;
  d.bounds_W = {{-5, -5, 0.5}, {15, 5, 3}};
  d.start_W = {0, 0, 1.5};
  d.goal_W = {10, 0, 2.8};
  const sitl::World world(d);
  sitl::WayVerdict verdict;
  verdict.narrowest_m = 0.4;
  const std::string svg = way_svg(world, 0.5, verdict, "wall.toml");
  EXPECT_NE(svg.find("<title>wall.toml: no way for a radius of 0.50 m; the widest is 0.40 m wide"),
            std::string::npos);
  EXPECT_EQ(svg.find("<polyline"), std::string::npos);
  EXPECT_NE(svg.find("z = 1.50 m"), std::string::npos);
  EXPECT_NE(svg.find("z = 2.80 m"), std::string::npos) << "a cut at the height of the goal, too";
}

}  // namespace
}  // namespace roborun::mission
