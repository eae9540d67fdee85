#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>

#include "platform/input/input_error.hpp"
#include "platform/mission/scenario_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

const std::string kHead = "[scenario]\nabout = \"x\"\nworld = \"w.toml\"\n";
const std::string kTail = "[expect]\noutcome = \"landed\"\n";

TEST(ScenarioFile, ReadsEveryTable) {
  const Scenario s = load_scenario(test::scratch_file(
      "all.toml", kHead + "seed = 7\nanswers = false\n[camera]\npixels = 48\n[fog]\nvisibility_m = 9\n" +
                      "[fence]\naltitude_m = [1, 9]\nkeep_out = [{ circle = [5, 5, 2] }]\n" +
                      "[[fault]]\ncomponent = \"esc\"\nkind = \"off\"\ninstance = 3\nphase = \"return\"\n" +
                      "at_s = 1.5\nfor_s = 2\n[[body]]\nradius = 1\nspeed = 3\npath = [[1, 2, 3], [4, 5, "
                      "6]]\n[[fault]]\ncomponent = \"wind\"\nkind = \"on\"\n" +
                      kTail +
                      "action = \"land\"\ncondition = \"gnss\"\nwithin_s = 2\nlanding_site_known = true\n"));
  EXPECT_EQ(s.name, "all");
  EXPECT_EQ(s.config.seed, 7U);
  EXPECT_FALSE(s.config.flight.answers);
  EXPECT_EQ(s.config.simulator.camera.pixels, 48);
  EXPECT_EQ(s.config.simulator.camera.range_m, 9.0);
  EXPECT_FALSE(s.config.flight.fence.allows(Vector3(5, 5, 5)));
  EXPECT_TRUE(s.config.flight.fence.allows(Vector3(9, 9, 5)));
  ASSERT_EQ(s.config.faults.size(), 2U);
  EXPECT_EQ(s.config.faults[0].fault.component, sitl::Component::kEsc);
  EXPECT_EQ(s.config.faults[0].fault.kind, sitl::FaultKind::kOff);
  EXPECT_EQ(s.config.faults[0].fault.instance, 3);
  EXPECT_EQ(s.config.faults[0].phase, governor::Phase::kReturn);
  EXPECT_EQ(s.config.faults[0].at_s, 1.5);
  EXPECT_EQ(s.config.faults[0].for_s, 2.0);
  EXPECT_FALSE(s.config.faults[1].phase.has_value());
  ASSERT_EQ(s.bodies.size(), 1U);
  EXPECT_EQ(s.bodies[0].speed_mps, 3.0);
  EXPECT_EQ(s.expect.action, "land");
  EXPECT_EQ(s.expect.condition, "gnss");
  EXPECT_EQ(s.expect.landing_site_known, true);
}

TEST(ScenarioFile, RefusesWithFileLineKeyAndWhatWouldBeRight) {
  const std::string fault = kHead + "[[fault]]\n";
  const std::pair<std::string, const char*> cases[] = {
      {"[expect]\noutcome = \"landed\"\n", "scenario: missing in the file"},
      {kHead, "expect: missing in the file"},
      {"[scenario]\nabout = \"x\"\n" + kTail, ":1: world: must be there, or environment"},
      {kHead + "wrold = 3\n" + kTail, ":4: wrold: unknown key in [scenario]: must be one of"},
      {kHead + "[expect]\noutcome = \"crash\"\n", ":5: outcome: 'crash' must be one of reached_goal, landed"},
      {kHead + "[expect]\noutcome = 3\n", ":5: outcome: must be a text in quotes"},
      {fault + "component = \"radar\"\nkind = \"off\"\n" + kTail,
       ":5: component: 'radar' must be one of imu, gnss, odometry, barometer"},
      {fault + "component = \"gnss\"\nkind = \"on\"\n" + kTail,
       ":6: kind: 'on' must be one of off, stuck, garbage, wrong, slow, delayed, intermittent"},
      {fault + "component = \"esc\"\nkind = \"off\"\ninstance = 4\n" + kTail,
       ":7: instance: must be a whole number from 0 to 3"},
      {fault + "component = \"esc\"\nkind = \"off\"\ninstance = 0.5\n" + kTail,
       ":7: instance: must be a whole number from 0 to 3"},
      {kHead + "[expect]\noutcome = \"landed\"\nwithin_s = 1\n", ":6: within_s: goes with a [[fault]]"},
      {kHead + "seed = 1.5\n" + kTail, ":4: seed: must be a whole number"},
      {fault + "component = \"esc\"\nkind = \"off\"\nphase = \"cruise\"\n" + kTail,
       ":7: phase: 'cruise' must be one of ground, take_off, mission"},
      {fault + "component = \"esc\"\nkind = \"off\"\nat_s = -1\n" + kTail,
       ":7: at_s: must be a number from 0"},
      {fault + "kind = \"off\"\n" + kTail, ":4: component: missing in [[fault]]"},
      {kHead + "[[body]]\nradius = -1\npath = [[0, 0, 0]]\n" + kTail, ":5: radius: must be a number from 0"},
      {kHead + "[fence]\nkeep_in = [{ polygon = [] }]\n" + kTail,
       ":5: polygon: must have at least three points"},
      {kHead + "[fence]\nkeep_in = [{ polygon = [[1, 1]] }]\n" + kTail,
       ":5: polygon: must have at least three"},
      {kHead + "[fence]\nkeep_in = [{ polygon = [[1, 1], [2, 2]] }]\n" + kTail,
       ":5: polygon: must have at least three"},
      {kHead + "[fence]\nkeep_in = [{ polygon = [[0, 0], [2, 2], [2, 0], [0, 2]] }]\n" + kTail,
       ":5: polygon: must not touch or cross itself"},
      {kHead + "[fence]\nkeep_in = [{ polygon = [[0, 0], [2, 2], [nan, 0]] }]\n" + kTail,
       ":5: polygon: must be finite numbers"},
      {kHead + "[fence]\nkeep_in = [{ circle = [0, 0] }]\n" + kTail, ":5: circle: must be [x, y, radius]"},
      {kHead + "[fence]\nkeep_in = [{ circle = [0, 0, -1] }]\n" + kTail, ":5: circle: must be above 0"},
      {kHead + "[fence]\naltitude_m = [9, 1]\n" + kTail, ":5: altitude_m: the upper limit must be above"},
  };
  for (const auto& [text, says] : cases) {
    try {
      (void)load_scenario(test::scratch_file("bad.toml", text));
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("bad.toml"), std::string::npos);
    }
  }
}

TEST(ScenarioFile, RefusesAFenceThatStartOrGoalIsOutside) {
  test::scratch_file("w.toml",
                     "[world]\nbounds = [[-8, -8, 1], [30, 8, 8]]\nstart = [0, 0, 4]\ngoal = [20, 0, 4]\n");
  const Scenario s = load_scenario(
      test::scratch_file("outside.toml", kHead + "[fence]\nkeep_in = [{ circle = [0, 0, 10] }]\n" + kTail));
  EXPECT_THROW((void)fly_scenario(s), InputError);
}

std::vector<Scenario> library() {
  std::vector<Scenario> all;
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(ROBORUN_SCENARIOS)) {
    if (entry.path().extension() == ".toml") files.insert(entry.path());
  }
  for (const auto& file : files) all.push_back(load_scenario(file.string()));
  return all;
}

// That all of them pass is the test Scenario.TheLibraryPasses. Here: a fault that matters is one without
// whose answer a scenario fails.
TEST(ScenarioLibrary, FailsWithoutTheAnswersOnceForEachComponentThatHasOne) {
  std::map<sitl::Component, bool> shown;
  for (Scenario s : library()) {
    if (s.config.faults.empty() || s.expect.action == "go_on" || !s.expect.action) continue;
    const sitl::Component component = s.config.faults.back().fault.component;
    if (shown[component]) continue;
    s.config.flight.answers = false;
    s.config.judge.time_limit_s = 25.0;
    shown[component] = !complaints_of(s, fly_scenario(s)).empty();
  }
  EXPECT_GE(shown.size(), 11U);
  for (const auto& [component, fails] : shown)
    EXPECT_TRUE(fails) << sitl::kComponents[static_cast<std::size_t>(component)].name
                       << ": every scenario passes without the answer";
}

TEST(ScenarioLibrary, HasFortyScenariosAndAKillInEveryPhaseOfFlight) {
  const std::vector<Scenario> all = library();
  EXPECT_GE(all.size(), 40U);
  std::set<governor::Phase> killed;
  std::set<sitl::Component> failed;
  for (const Scenario& s : all) {
    for (const TimedFault& f : s.config.faults) {
      failed.insert(f.fault.component);
      if (f.fault.component == sitl::Component::kKillSwitch && f.phase) killed.insert(*f.phase);
    }
  }
  EXPECT_EQ(killed.size(), 6U) << "ground, take-off, mission, hold, return, land";
  EXPECT_EQ(failed.size(), sitl::kComponentCount);
}

}  // namespace
}  // namespace roborun::mission
