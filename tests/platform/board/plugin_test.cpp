#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "platform/board/backends.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/board/plugin_abi.hpp"
#include "platform/board/plugin_loader.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::board {
namespace {

const PartRequest kRequest{{Vector3(-10, -10, 0), Vector3(10, 10, 10)}, {64, 64, 25.0}};

std::string plugin(const char* name) { return std::string("plugin:") + ROBORUN_PLUGINS + "/" + name; }

/// What the refusal says.
std::string refusal(const std::string& name) {
  try {
    (void)load_planner(name, kRequest);
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "one line";
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << "by name";
    return error.what();
  }
  return "none";
}

TEST(Plugin, GivesPartsThatAreDeletedByTheCaller) {
  for (int i = 0; i < 2; ++i) {
    const auto planner = load_planner(plugin("good_plugin.so"), kRequest);
    ASSERT_NE(planner, nullptr);
    stages::PlanResult result;
    core::UnlimitedBudget unlimited;
    const auto map = load_map(plugin("good_plugin.so"), kRequest);
    ASSERT_NE(map, nullptr);
    EXPECT_EQ(planner->plan({}, map->view(), unlimited, result), Status::kNoPath);
    EXPECT_EQ(map->bytes(), 64U) << "it got the request";
    const auto ways = load_ways(plugin("good_plugin.so"), kRequest);
    ASSERT_NE(ways, nullptr);
    EXPECT_EQ(ways->to_goal_m(Vector3::Zero()), kRequest.room_m) << "it got the request";
  }
}

TEST(Plugin, OfAnotherAbiIsRefusedWithBothVersions) {
  const std::string why = refusal(plugin("foreign_plugin.so"));
  EXPECT_NE(why.find(fmt::format("plugin ABI 77: must be {},", kPluginAbi)), std::string::npos) << why;
}

TEST(Plugin, OfAnotherLayoutIsRefusedWithBothBuilds) {
  const std::string why = refusal(plugin("strange_plugin.so"));
  EXPECT_NE(why.find("built with a strange compiler"), std::string::npos) << why;
  EXPECT_NE(why.find("Eigen 3."), std::string::npos) << why;
}

TEST(Plugin, ThatCannotMakeItsPartSaysSo) {
  EXPECT_NE(refusal(plugin("failing_plugin.so")).find("could not make its planner"), std::string::npos);
}

TEST(Plugin, WithoutThePartIsRefused) {
  EXPECT_THROW((void)load_map(plugin("failing_plugin.so"), kRequest), InputError);
  EXPECT_THROW((void)load_ways(plugin("failing_plugin.so"), kRequest), InputError);
}

TEST(Plugin, ThatIsNoneIsRefused) {
  EXPECT_NE(refusal("plugin:").find("must be plugin:FILE.so"), std::string::npos);
  EXPECT_NE(refusal("plugin:/nonexistent.so").find("cannot be loaded"), std::string::npos);
  EXPECT_NE(refusal("plugin:nonexistent.so").find("cannot be loaded"), std::string::npos);
  EXPECT_NE(refusal("plugin:/tmp").find("cannot be loaded"), std::string::npos);
  const std::string text = ::testing::TempDir() + "roborun_text_plugin.so";
  std::ofstream(text) << "hello";
  EXPECT_NE(refusal("plugin:" + text).find("cannot be loaded"), std::string::npos);
  std::remove(text.c_str());
  EXPECT_NE(refusal(plugin("no_plugin.so")).find("no plugin: has no roborun_plugin_abi()"),
            std::string::npos);
}

TEST(Plugin, IsNeitherMeasuredIntoTheCacheNorForgottenInNames) {
  EXPECT_TRUE(uses_plugin({"own", "plugin:x.so"}));
  EXPECT_TRUE(uses_plugin({"plugin:x.so", "own"}));
  EXPECT_TRUE(uses_plugin({"own", "own", "plugin:x.so"}));
  EXPECT_FALSE(uses_plugin({"octomap", "ompl:RRTstar"}));
  EXPECT_THROW((void)default_host_path({"own", "plugin:x.so"}), InputError);
}

}  // namespace
}  // namespace roborun::board
