#include "platform/sitl/world/world_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "platform/input/input_error.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::sitl {
namespace {

class WorldFile : public testing::Test {
 protected:
  std::string write(const std::string& text, const std::string& name = "world.toml") {
    return test::scratch_file(name, text);
  }
  /// What the reader says about a text; empty if it takes it.
  std::string complaint(const std::string& text) {
    try {
      (void)load_world(write(text), {});
      return {};
    } catch (const InputError& error) {
      return error.what();
    }
  }
  const std::string good_ =
      "[world]\nbounds = [[0, -20, 1], [80, 20, 10]]\nstart = [5, 0, 5]\ngoal = [75, 0, 5]\n"
      "[[pillar]]\nx = 40\ny = 0.5\nradius = 2\n[[box]]\nmin = [20, 5, 0]\nmax = [22, 9, 6]\n";
};

TEST_F(WorldFile, ReadsPillarsBoxesBoundsAndEnds) {
  const World world = load_world(write(good_), {});
  ASSERT_EQ(world.pillars().size(), 1U);
  EXPECT_EQ(world.pillars()[0].y_m, 0.5);
  EXPECT_EQ(world.pillars()[0].top_m, 20.0);
  ASSERT_EQ(world.boxes().size(), 1U);
  EXPECT_EQ(world.goal_W(), Vector3(75.0, 0.0, 5.0));
  EXPECT_EQ(world.bounds_W().max_W, Vector3(80.0, 20.0, 10.0));
}

TEST_F(WorldFile, ReadsMovingBodies) {
  const World world = load_world(
      write(good_ +
            "[[body]]\nradius = 0.5\nheight = 3\nspeed = 2\nat_s = 4\npath = [[9, 9, 2], [9, -9, 2]]\n"
            "[[body]]\nradius = 1\npath = [[50, 0, 5]]\n"),
      {});
  ASSERT_EQ(world.bodies().size(), 2U);
  EXPECT_EQ(world.bodies()[0].height_m, 3.0);
  EXPECT_EQ(world.bodies()[0].start_s, 4.0);
  EXPECT_EQ(world.bodies()[0].path_W[1], Vector3(9, -9, 2));
  EXPECT_EQ(world.bodies()[1].speed_mps, 0.0);
}

/// A world with these keys of the reference, in a value of each one's form.
std::string text_of(const std::vector<WorldKey>& keys) {
  std::string text;
  std::string_view table;
  for (const WorldKey& k : keys) {
    if (k.table != table) text += k.table == "world" ? "[world]\n" : "[[" + std::string(k.table) + "]]\n";
    table = k.table;
    const double number = k.key == "top" ? 9.0 : k.fallback.value_or(1.5);
    std::string value = std::to_string(number);
    if (k.key == "bounds") value = "[[-30, -30, 1], [30, 30, 9]]";
    if (k.key == "path") value = "[[9, 9, 2], [9, -9, 2]]";
    if (k.key == "start" || k.key == "min") value = "[-20, -20, 3]";
    if (k.key == "max") value = "[-19, -10, 4]";
    if (k.key == "goal") value = "[20, 20, 3]";
    if (k.key == "min") value = "[-19.5, -11, 3]";
    text += std::string(k.key) + " = " + value + "\n";
  }
  return text;
}

TEST_F(WorldFile, TakesTheKeysOfItsReferenceAndNeedsThoseThatItSays) {
  const std::vector<WorldKey> keys = world_keys();
  ASSERT_GE(keys.size(), 15U);
  EXPECT_EQ(complaint(text_of(keys)), "");
  for (std::size_t i = 0; i < keys.size(); ++i) {
    std::vector<WorldKey> fewer = keys;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    const std::string missing = std::string(keys[i].key) + ": missing in [";
    EXPECT_EQ(complaint(text_of(fewer)).find(missing) == std::string::npos, keys[i].fallback.has_value())
        << keys[i].table << " " << keys[i].key << ": " << complaint(text_of(fewer));
  }
}

TEST_F(WorldFile, TheExampleOfTheReadmeFlies) {
  std::ifstream file(std::string(ROBORUN_TEST_DATA) + "/../../platform/sitl/README.md");
  const std::string readme(std::istreambuf_iterator<char>(file), {});
  const std::size_t begin = readme.find("```toml\n[world]");
  ASSERT_NE(begin, std::string::npos);
  const World world =
      load_world(write(readme.substr(begin + 8, readme.find("```\n", begin + 8) - begin - 8)), {});
  EXPECT_EQ(world.pillars().size(), 1U);
  EXPECT_EQ(world.bodies().size(), 1U);
}

TEST_F(WorldFile, OtherEndsMayBeAskedFor) {
  const World world = load_world(write(good_), {Vector3(6.0, 1.0, 4.0), std::nullopt});
  EXPECT_EQ(world.start_W(), Vector3(6.0, 1.0, 4.0));
  EXPECT_EQ(world.goal_W(), Vector3(75.0, 0.0, 5.0));
}

TEST_F(WorldFile, RefusesInOneLineThatNamesFileLineAndKey) {
  const auto replaced = [this](const std::string& from, const std::string& to) {
    std::string text = good_;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  struct Case {
    std::string text;
    std::string says;
  };
  const Case cases[] = {
      {replaced("radius = 2", "radius = -2"), "radius: must be above 0"},
      {replaced("radius = 2", "radius = nan"), ":8: radius: must be a finite number"},
      {replaced("radius = 2", "radius = 1e300"), ":8: radius: must be a finite number"},
      {replaced("radius = 2", "radius = 'big'"), ":8: radius: must be a finite number"},
      {replaced("radius = 2", "raduis = 2"), "raduis: unknown key in [[pillar]]: must be one of"},
      {replaced("x = 40\n", ""), "x: missing in [[pillar]]"},
      {replaced("goal = [75, 0, 5]\n", ""), "goal: missing in [world]"},
      {replaced("goal = [75, 0, 5]", "goal = [75, 0]"), ":4: goal: must be three numbers"},
      {replaced("goal = [75, 0, 5]", "goal = [175, 0, 5]"), "goal"},
      {replaced("goal = [75, 0, 5]", "goal = [40, 0, 5]"), "closer than 0.6 m to an obstacle"},
      {replaced("max = [22", "max = [12"), "max: must be above min on every axis"},
      {good_ + "[[body]]\npath = [[0, 0, 1]]\n", ":12: radius: missing in [[body]]"},
      {good_ + "[[body]]\nradius = 0\npath = [[0, 0, 1]]\n", ":13: radius: must be above 0"},
      {good_ + "[[body]]\nradius = 1\nspeed = -1\npath = [[0, 0, 1]]\n",
       ":14: speed: must be a number from 0"},
      {good_ + "[[body]]\nradius = 1\npath = []\n", ":14: path: must be one to 1000 points"},
      {good_ + "[[body]]\nradius = 1\npath = [[0, 0]]\n", ":14: path: must be three numbers"},
      {good_ + "[[body]]\nradius = 1\nspeeed = 2\n", ":14: speeed: unknown key in [[body]]"},
      {good_ + "[body]\nradius = 1\n", "body: must be written as [[body]]"},
      {replaced("[world]", "[word]"), "word: unknown key in the file"},
      {replaced("[world]", "[world"), "world.toml"},
      {"", "world: missing in the file"},
      {std::string(100, '\0'), "world.toml"},
      {std::string(200000, '['), "world.toml"},
  };
  for (const Case& c : cases) {
    const std::string line = complaint(c.text);
    EXPECT_NE(line.find(c.says), std::string::npos) << "'" << line << "' does not say '" << c.says << "'";
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

TEST_F(WorldFile, RefusesAFileThatIsNotThereAFolderAndAnUnknownKind) {
  EXPECT_THROW((void)load_world("/nonexistent/world.toml", {}), InputError);
  EXPECT_THROW((void)load_world(write(good_, "world.yaml"), {}), InputError);
  const auto folder = test::scratch_folder() / "folder.toml";
  std::filesystem::create_directories(folder);
  EXPECT_THROW((void)load_world(folder.string(), {}), InputError);
}

}  // namespace
}  // namespace roborun::sitl
