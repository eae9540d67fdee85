#include "platform/mission/flight_story.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "tests/platform/mission/sample_flight_log.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

using nlohmann::json;

std::string sample(double length_s) {
  std::string path = test::scratch("sample.mcap");
  test::write_sample_log(path, length_s);
  return path;
}

json story_in(const std::string& path) { return json::parse(story_of(path).page.story); }

TEST(FlightStory, HoldsWhatTheLogHolds) {
  const FlightStory told = story_of(sample(20.0));
  EXPECT_TRUE(told.end.damage.empty()) << told.end.damage;
  EXPECT_EQ(told.page.title, "Flight log sample.mcap");
  EXPECT_EQ(told.page.footer, "From sample.mcap. Flown by roborun, commit 0123abc, GNU.");
  const json s = json::parse(told.page.story);
  EXPECT_EQ(s["facts"][0], (json{"outcome", "landed"}));
  EXPECT_EQ(s["bounds"], (json{{-20, -30, 0}, {1300, 30, 12}}));
  EXPECT_EQ(s["start"], (json{0, 0, 4}));
  EXPECT_EQ(s["goal"], (json{40, 0, 4}));
  ASSERT_EQ(s["fence"].size(), 2U);
  EXPECT_EQ(s["fence"][0].size(), 3U);
  EXPECT_EQ(s["fence"][1].size(), 48U) << "a circle";
  EXPECT_TRUE(s["notes"].empty());

  // 40 Hz thinned to 10 Hz, the first and the last moment included.
  const json& state = s["state"];
  ASSERT_EQ(state["time_s"].size(), 201U);
  for (const auto& [key, values] : state.items()) EXPECT_EQ(values.size(), 201U) << key;
  EXPECT_EQ(state["x_m"][100], 20.0);
  EXPECT_EQ(state["ref_speed_mps"][0], 2.419) << "hypot(2.1, 1.2)";
  EXPECT_EQ(state["phase"][200], "land");

  const json& decision = s["decision"];
  ASSERT_EQ(decision["time_s"].size(), 39U) << "from 1 s on, every half second";
  for (const auto& [key, values] : decision.items()) EXPECT_EQ(values.size(), 39U) << key;
  EXPECT_EQ(decision["deadline_s"][3], 0.4);
  EXPECT_NE(decision["why"][3].get<std::string>().find("How long"), std::string::npos);
  ASSERT_EQ(s["plan"].size(), 39U);
  EXPECT_EQ(s["plan"][0]["points_m"].size(), 3 * log::DecisionEntry::kMostPoints);
  ASSERT_EQ(s["failsafe"].size(), 1U);
  EXPECT_EQ(s["failsafe"][0], (json{{"time_s", 18.0},
                                    {"action", "land"},
                                    {"phase", "mission"},
                                    {"conditions", {"gnss"}},
                                    {"sensor", ""}}));
  ASSERT_EQ(s["events"].size(), 2U) << "the failsafe's own is told above";
  EXPECT_EQ(s["events"][1]["text"], "the flight ended: landed <at> the end");
}

TEST(FlightStory, SaysWhetherTheScenarioPassed) {
  const FlightStory told = story_of(sample(3.0));
  EXPECT_TRUE(told.end.has_verdict);
  EXPECT_FALSE(told.end.passed);
  EXPECT_EQ(json::parse(told.page.story)["verdict"],
            (json{{"passed", false},
                  {"complaints", {"outcome: landed, must be <reached_goal>"}},
                  {"moment_s", 2.5}}));
}

TEST(FlightStory, HoldsEveryCellOfTheMap) {
  const json s = story_in(sample(3.0));
  ASSERT_EQ(s["map"].size(), 4U);
  const log::MapSlice slice = test::sample_slice(2.0);
  const json& told = s["map"][2];
  EXPECT_EQ(told["columns"], 128);
  EXPECT_EQ(told["rows"], 128);
  EXPECT_EQ(told["z_m"], 4.0);
  std::size_t at = 0;
  std::size_t wrong = 0;
  std::size_t occupied = 0;
  for (std::size_t k = 0; k < told["runs"].size(); k += 2) {
    for (std::size_t n = told["runs"][k + 1]; n > 0; --n, ++at) {
      const int cell = slice.cell[at];
      const int wanted = cell == log::MapSlice::kFree ? 1 : cell == log::MapSlice::kOccupied ? 2 : 0;
      wrong += told["runs"][k] == wanted ? 0U : 1U;
      occupied += wanted == 2 ? 1U : 0U;
    }
  }
  EXPECT_EQ(at, slice.cell.size());
  EXPECT_EQ(wrong, 0U);
  EXPECT_GT(occupied, 50U);
}

TEST(FlightStory, HoldsTheWorldAndWhatTheCamerasSaw) {
  const json s = story_in(sample(5.0));
  EXPECT_EQ(s["world"], (json{{"height_m", 4.0},
                              {"circles", {{9.0, -3.0, 1.0}}},
                              {"rings", {{{20.0, 5.0}, {22.0, 5.0}, {22.0, 8.0}}}}}));
  ASSERT_EQ(s["camera"].size(), 12U) << "two cameras, at 0 to 5 s";
  for (std::size_t i = 0; i < 12; ++i) {
    const json& image = s["camera"][i];
    EXPECT_EQ(image["camera"], i / 6);
    EXPECT_EQ(image["name"], i < 6 ? "front" : "right");
    EXPECT_EQ(image["time_s"], static_cast<double>(i % 6) + (i < 6 ? 0.0 : 0.2));
    ASSERT_EQ(image["wide"], 48);
    ASSERT_EQ(image["high"], 48);
    const std::string pixels = image["pixels"];
    ASSERT_EQ(pixels.size(), 48U * 48U);
    EXPECT_EQ(pixels[5 * 48 + 20], ' ') << "the sky";
    // The nearest of four: 7 m (or less, the wall comes nearer) of 25 is level 22 of 31, 20 m is level 29.
    EXPECT_NEAR(pixels[20 * 48 + 40] - '@', 29, 1);
    EXPECT_LE(pixels[20 * 48 + 10] - '@', 22);
    EXPECT_GE(pixels[20 * 48 + 10] - '@', 18);
    EXPECT_NE(pixels[47 * 48 + 10], '!') << "of two rows one has values";
  }
}

TEST(FlightStory, OfALongFlightIsThinned) {
  const json s = story_in(sample(1500.0));
  EXPECT_LE(s["state"]["time_s"].size(), kMostStates);
  EXPECT_GT(s["state"]["time_s"].size(), kMostStates / 3);
  EXPECT_LE(s["map"].size(), kMostSlices);
  EXPECT_GT(s["map"].size(), kMostSlices / 3);
  EXPECT_LE(s["camera"].size(), kMostImages);
  EXPECT_GT(s["camera"].size(), kMostImages / 3);
  EXPECT_EQ(s["decision"]["time_s"].size(), 2999U) << "every decision is kept";
}

TEST(FlightStory, OfACutLogGoesToTheCut) {
  const std::string path = sample(20.0);
  const std::string whole = input::read_text(path, "the sample");
  input::write_file(path, whole.substr(0, whole.size() / 2));
  const FlightStory told = story_of(path);
  EXPECT_NE(told.end.damage.find("sample.mcap: byte"), std::string::npos) << told.end.damage;
  const json s = json::parse(told.page.story);
  EXPECT_GT(s["state"]["time_s"].size(), 20U);
  EXPECT_LT(s["state"]["time_s"].size(), 190U);
  ASSERT_EQ(s["notes"].size(), 1U);
  EXPECT_TRUE(s["notes"][0].get<std::string>().starts_with("The log ends early: "));
}

TEST(FlightStory, TakesTheWorldOfTheFlightAlone) {
  const std::string path = sample(3.0);
  report::Scene scene;
  scene.bounds_W = {Vector3(-20, -30, 0), Vector3(1300, 30, 12)};
  scene.start_W = Vector3(0, 0, 4);
  scene.goal_W = Vector3(40, 0, 4);
  scene.circles.push_back({9.0, -3.0, 1.0});
  scene.rects.push_back({1.0, 2.0, 3.0, 4.0});
  scene.outlines.push_back({{0, 0}, {1, 0}, {0, 1}});
  EXPECT_NE(story_in(path)["world"].dump().find("22.0,8.0"), std::string::npos)
      << "its own, if no other is given";
  const WorldOf world = [&scene](std::optional<std::uint64_t> seed) {
    EXPECT_EQ(seed, 7U);
    return scene;
  };
  EXPECT_EQ(
      json::parse(story_of(path, world).page.story)["world"],
      (json{{"height_m", 4.0},
            {"circles", {{9.0, -3.0, 1.0}}},
            {"rings",
             {{{1.0, 2.0}, {4.0, 2.0}, {4.0, 6.0}, {1.0, 6.0}}, {{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}}}}));
  scene.goal_W.x() = 41.0;
  try {
    (void)story_of(path, world);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "goal: (41, 0, 4) in the world, (40, 0, 4) in the log: must be the world of the flight");
  }
}

/// A log of one message.
std::string log_of(const std::string& topic, const std::string& text) {
  std::string path = test::scratch("one.mcap");
  log::LogFile file(path, false);
  log::McapWriter writer(file, "", "test");
  writer.message(writer.add_channel(0, topic, "json"), 1'500'000'000, text);
  writer.finish();
  return path;
}

TEST(FlightStory, RefusesWhatIsNotAsDocumented) {
  const std::pair<std::string, std::pair<const char*, const char*>> cases[] = {
      {"/other", {"{}", "no /state in it: must be a flight log of roborun"}},
      {"/state", {"{", "/state at 1.500 s: not JSON"}},
      {"/state", {"[]", "/state at 1.500 s: must be a JSON object"}},
      {"/state", {R"({"x_m":"a"})", "/state at 1.500 s: x_m: must be a number"}},
      {"/map",
       {R"({"pose":{"position":{"x":0,"y":0,"z":0}},"column_count":0})", "row_stride: must be a number"}},
      {"/map",
       {R"({"pose":{"position":{"x":0,"y":0,"z":0}},"column_count":2,"row_stride":2,"cell_size":{"x":1},"data":"AAA!"})",
        "data: must be base64"}},
      {"/map",
       {R"({"pose":{"position":{"x":0,"y":0,"z":0}},"column_count":2,"row_stride":2,"cell_size":{"x":1},"data":"AAAA"})",
        "data: 3 cells: must be whole rows of 2"}},
      {"/map",
       {R"({"pose":{"position":{"x":0,"y":0,"z":0}},"column_count":1e9,"row_stride":1e9,"cell_size":{"x":1}})",
        "must be those of a grid"}},
      {"/world", {R"({"height_m":1,"circles":[[1,2]],"rings":[]})", "circles: must be a list of shapes"}},
      {"/world", {R"({"height_m":1,"circles":[],"rings":[[[1,"a"]]]})", "rings: must be a list of shapes"}},
      {"/world", {R"({"circles":[],"rings":[]})", "/world at 1.500 s: height_m: must be a number"}},
      {"/verdict", {R"({"passed":1,"complaints":[]})", "/verdict: must be an object with passed"}},
      {"/verdict", {R"({"passed":true,"complaints":[1]})", "complaints (texts)"}},
      {"/trajectory", {R"({"poses":[{"position":{"x":0,"y":0}}]})", "z: must be a number"}}};
  for (const auto& [topic, one] : cases) {
    try {
      (void)story_of(log_of(topic, one.first));
      ADD_FAILURE() << topic << one.first;
    } catch (const InputError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find("one.mcap: "), std::string::npos) << what;
      EXPECT_NE(what.find(one.second), std::string::npos) << what;
      EXPECT_EQ(what.find('\n'), std::string::npos);
    }
  }
}

TEST(FlightPage, IsWholeAndOfTheTextThatWasGiven) {
  const std::string html = report::flight_page_html({"<a> @STYLE@", "b & c @SCRIPT@", R"({"x":1})"});
  EXPECT_NE(html.find("<title>&lt;a&gt; @STYLE@</title>"), std::string::npos)
      << "put in, and not looked at again";
  EXPECT_NE(html.find("<footer>b &amp; c @SCRIPT@</footer>"), std::string::npos);
  EXPECT_NE(html.find("default-src 'none'"), std::string::npos) << "no request";
  EXPECT_EQ(html.find("http"), html.find("http-equiv")) << "no address of anything";
  EXPECT_EQ(html.find("@STORY@"), std::string::npos);
  EXPECT_EQ(html.find("connect-src"), std::string::npos);
  report::FlightPage live{"a", "b", R"({"x":1})", true};
  EXPECT_NE(report::flight_page_html(live).find("script-src 'unsafe-inline'; connect-src 'self'\">"),
            std::string::npos);
  EXPECT_NE(html.find("class KnownMap"), std::string::npos);
  EXPECT_NE(html.find("prefers-color-scheme: dark"), std::string::npos);
  EXPECT_TRUE(html.ends_with("</html>\n"));
}

}  // namespace
}  // namespace roborun::mission
