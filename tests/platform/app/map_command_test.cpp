// roborun map on files that OctoMap's own library wrote.
#include "platform/app/map_command.hpp"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>

#include "platform/input/input_error.hpp"
#include "tests/platform/report/xml.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::app {
namespace {

struct Answer {
  int exit_code{};
  std::string text;
};

Answer map_command(const std::string& arguments) {
  CLI::App app;
  std::function<int()> run;
  add_map_command(app, run);
  app.parse("map " + arguments);
  testing::internal::CaptureStdout();
  Answer answer;
  try {
    answer.exit_code = run();
  } catch (...) {
    (void)testing::internal::GetCapturedStdout();
    throw;
  }
  answer.text = testing::internal::GetCapturedStdout();
  return answer;
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A floor of 8 x 8 x 1 occupied cells of 0.5 m, 8 x 8 x 4 free ones above it; `hole` leaves one of the floor
/// free.
std::string write_room(const std::string& name, bool hole) {
  octomap::OcTree tree(0.5);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 5; ++z)
        tree.updateNode(
            octomap::point3d(0.25F + 0.5F * static_cast<float>(x), 0.25F + 0.5F * static_cast<float>(y),
                             0.25F + 0.5F * static_cast<float>(z)),
            z == 0 && !(hole && x == 3 && y == 4));
  const std::string path = test::scratch(name);
  EXPECT_TRUE(tree.writeBinary(path));
  return path;
}

TEST(MapCommand, InfoCountsVolumes) {
  const Answer answer = map_command("info --json " + write_room("info.bt", false));
  EXPECT_EQ(answer.exit_code, 0);
  const auto json = nlohmann::json::parse(answer.text);
  EXPECT_EQ(json["resolution_m"], 0.5);
  EXPECT_NEAR(json["occupied_m3"].get<double>(), 64 * 0.125, 1e-9);
  EXPECT_NEAR(json["free_m3"].get<double>(), 256 * 0.125, 1e-9);
  EXPECT_EQ(json["max_W"], nlohmann::json({4.0, 4.0, 2.5}));
  EXPECT_NE(map_command("info " + test::scratch("info.bt")).text.find("free 32.0 m3, occupied 8.0 m3"),
            std::string::npos);
}

TEST(MapCommand, ConvertsThereAndBackWithoutADifference) {
  const std::string first = write_room("there.bt", true), full = test::scratch("there.ot"),
                    back = test::scratch("back.bt");
  EXPECT_EQ(map_command("convert " + first + " " + full).exit_code, 0);
  EXPECT_EQ(map_command("convert " + full + " " + back).exit_code, 0);
  EXPECT_EQ(map_command("diff " + first + " " + back).exit_code, 0);
  std::ifstream stream(full, std::ios::binary);
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(stream));
  EXPECT_NE(dynamic_cast<octomap::OcTree*>(read.get()), nullptr) << "OctoMap reads what we wrote";
}

TEST(MapCommand, DiffCountsEachKindAndExitsWithOne) {
  const std::string whole = write_room("whole.bt", false), holed = write_room("holed.bt", true);
  const Answer answer = map_command("diff --json " + whole + " " + holed);
  EXPECT_EQ(answer.exit_code, 1);
  const auto json = nlohmann::json::parse(answer.text);
  EXPECT_EQ(json["occupied_to_free_cells"], 1);
  EXPECT_EQ(json["free_to_occupied_cells"], 0);
  EXPECT_EQ(json["same_cells"], 319);
  EXPECT_EQ(map_command("diff " + whole + " " + whole).exit_code, 0);
}

TEST(MapCommand, ViewDrawsThreePanels) {
  const std::string file = write_room("view.bt", true), picture = test::scratch("view.svg");
  EXPECT_EQ(map_command("view " + file + " --height 0.2 -o " + picture).exit_code, 0);
  const std::string svg = content(picture);
  EXPECT_TRUE(test::well_formed(svg));
  EXPECT_EQ(test::count(svg, "from above"), 1U);
  EXPECT_EQ(test::count(svg, "cut at"), 2U);
  // The cut through the floor: eight rows of one run, the one with the hole of three.
  const std::size_t cut = svg.find("cut at z"), next = svg.find("cut at y");
  EXPECT_EQ(test::count(svg.substr(cut, next - cut), R"(fill="#222")"), 9U);
  EXPECT_EQ(test::count(svg.substr(cut, next - cut), R"(fill="#cfe8ff")"), 1U);
}

TEST(MapCommand, RefusesWhatIsNoMap) {
  const std::string file = write_room("good.bt", false), bad = test::scratch("bad.bt");
  std::ofstream(bad) << content(file).substr(0, content(file).size() / 2);
  EXPECT_THROW(map_command("info " + bad), InputError) << "truncated";
  EXPECT_THROW(map_command("info " + test::scratch("none.bt")), InputError);
  EXPECT_THROW(map_command("convert " + file + " " + test::scratch("map.txt")), InputError);
  EXPECT_THROW(map_command("convert " + file + " " + test::scratch("no/folder.bt")), InputError);
  EXPECT_THROW(map_command("view " + file + " --height 9"), InputError) << "above the map";
}

}  // namespace
}  // namespace roborun::app
