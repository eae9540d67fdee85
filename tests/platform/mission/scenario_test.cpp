#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "platform/input/input_error.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/mission/logged_end.hpp"
#include "platform/mission/scenario_file.hpp"
#include "platform/mission/scenario_matrix.hpp"
#include "platform/mission/verdict.hpp"
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

TEST(ScenarioFile, AFaultSaysHowMuchAndHowOften) {
  const Scenario s = load_scenario(test::scratch_file(
      "bursts.toml", kHead +
                         "[[fault]]\ncomponent = \"can\"\nkind = \"intermittent\"\nsize = 0.1\nfor_s = 0.05\n"
                         "every_s = 1\n[[fault]]\ncomponent = \"gnss\"\nkind = \"drift\"\n" +
                         kTail));
  ASSERT_EQ(s.config.faults.size(), 2U);
  EXPECT_EQ(s.config.faults[0].fault.size, 0.1);
  EXPECT_EQ(s.config.faults[0].for_s, 0.05);
  EXPECT_EQ(s.config.faults[0].every_s, 1.0);
  EXPECT_FALSE(s.config.faults[1].fault.size.has_value());
  EXPECT_EQ(s.config.faults[1].every_s, 0.0);
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
      {fault + "component = \"can\"\nkind = \"off\"\nsize = 0.1\n" + kTail,
       ":7: size: must be left out: kind 'off' of can has none"},
      {fault + "component = \"can\"\nkind = \"intermittent\"\nsize = 10\n" + kTail,
       ":7: size: must be a number from 0.001 to 1: share of frames lost"},
      {fault + "component = \"gnss\"\nkind = \"drift\"\nsize = nan\n" + kTail, ":7: size: must be a finite"},
      {fault + "component = \"gnss\"\nkind = \"slow\"\nsize = 2.5\n" + kTail,
       ":7: size: must be a whole number from 2 to 1000"},
      {fault + "component = \"can\"\nkind = \"off\"\nevery_s = 1\n" + kTail,
       ":7: every_s: must be more than for_s"},
      {fault + "component = \"can\"\nkind = \"off\"\nfor_s = 1\nevery_s = 1\n" + kTail,
       ":8: every_s: must be more than for_s"},
      {fault + "component = \"can\"\nkind = \"off\"\nfor_s = 0\n" + kTail,
       ":7: for_s: must be a number from 0.001 to 7200"},
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

TEST(ScenarioFile, FliesWithAnAutopilot) {
  const std::string head = "[scenario]\nabout = \"x\"\nenvironment = \"14\"\nautopilot = ";
  const std::string tail = "\n[expect]\noutcome = \"reached_goal\"\n";
  const Scenario s = load_scenario(test::scratch_file("pilot.toml", head + "\"arducopter\"" + tail));
  ASSERT_TRUE(s.config.autopilot);
  EXPECT_EQ(s.config.autopilot->kind, AutopilotKind::kArduCopter);
  EXPECT_THROW((void)load_scenario(test::scratch_file("pilot.toml", head + "\"betaflight\"" + tail)),
               InputError);
}

TEST(ScenarioFile, RefusesAFenceThatStartOrGoalIsOutside) {
  test::scratch_file("w.toml",
                     "[world]\nbounds = [[-8, -8, 1], [30, 8, 8]]\nstart = [0, 0, 4]\ngoal = [20, 0, 4]\n");
  const Scenario s = load_scenario(
      test::scratch_file("outside.toml", kHead + "[fence]\nkeep_in = [{ circle = [0, 0, 10] }]\n" + kTail));
  EXPECT_THROW((void)fly_scenario(s), InputError);
}

// ---- verdicts

Check check_named(const std::vector<Check>& checks, const std::string& condition) {
  const auto at = std::find_if(checks.begin(), checks.end(),
                               [&condition](const Check& c) { return c.condition == condition; });
  EXPECT_NE(at, checks.end()) << condition;
  return at == checks.end() ? Check{} : *at;
}

/// A landing because of gnss, 0.8 s after the fault; nothing was flown.
report::MissionReport landing() {
  report::MissionReport r;
  r.result.reason = "landed";
  r.result.mission_time_s = 11.5;
  r.safety.first_fault_s = 7.0;
  r.safety.actions.push_back({7.8, "land", "mission", {"gnss"}, {}});
  r.safety.touchdown_mps = 0.4;
  r.safety.touchdown_s = 11.0;
  r.safety.last_thrust_s = 11.2;
  r.path.push_back({0.0, Vector3(0, 0, 0), 0.0});
  r.safety.end_W = Vector3(3, 4, 0);
  r.decisions.resize(2);
  r.decisions[0].time_s = 1.0;
  r.decisions[1].time_s = 7.5;
  return r;
}

Scenario asks_for(const std::string& outcome) {
  Scenario s;
  s.expect.outcome = outcome;
  s.config.faults.push_back({});
  return s;
}

TEST(Verdict, GivesValueLimitMomentAndWhy) {
  Scenario s = asks_for("reached_goal");
  s.expect.action = "hold";
  s.expect.condition = "depth";
  s.expect.sensor = "camera 1: covered";
  s.expect.within_s = 0.5;
  s.expect.motors_stop_within_s = 1.0;
  s.expect.touchdown_mps = 0.3;
  s.expect.home_within_m = 4.0;
  s.expect.landing_site_known = true;
  report::MissionReport r = landing();
  r.safety.left_fence_s = 5.25;
  r.safety.left_fence_W = Vector3(1, 2, 3);
  const std::vector<std::string> complaints = complaints_of(s, r);
  const std::string why = "the failsafe chose land at 7.80 s (mission; gnss)";
  const std::vector<std::string> wanted{
      "outcome: landed at 11.50 s, must be reached_goal: " + why,
      "fence: outside at 5.25 s, must be inside: at (1.0, 2.0, 3.0) m",
      "action: land at 7.80 s, must be hold: " + why,
      "condition: never held when an action was chosen, must be depth: " + why,
      "sensor: none was named, must be \"camera 1: covered\": " + why,
      "within_s: first action 0.800 s after the fault at 7.80 s, must be within 0.5 s: the fault began at "
      "7.00 s; " +
          why,
      "motors_stop_within_s: motors turned until 4.2000 s after the fault at 11.20 s, must be within 1 s: " +
          std::string("the fault began at 7.00 s"),
      "touchdown_mps: 0.40 m/s at 11.00 s, must be at most 0.3 m/s",
      "home_within_m: 5.0 m from home at 11.50 s, must be within 4 m: it ended at (3.0, 4.0, 0.0) m",
      "landing_site_known: not known to be free, must be known to be free"};
  EXPECT_EQ(complaints, wanted);
  EXPECT_EQ(moment_of(checks_of(s, r), r), 5.25) << "what failed first";
}

TEST(Verdict, PassesWhatIsAsAskedFor) {
  Scenario s = asks_for("landed");
  s.expect.action = "land";
  s.expect.condition = "gnss";
  s.expect.within_s = 0.9;
  s.expect.motors_stop_within_s = 5.0;
  s.expect.touchdown_mps = 0.5;
  s.expect.home_within_m = 5.5;
  s.expect.landing_site_known = false;
  const std::vector<Check> checks = checks_of(s, landing());
  EXPECT_EQ(checks.size(), 10U);
  for (const Check& c : checks) EXPECT_TRUE(c.passed) << to_text(c);
}

TEST(Verdict, ComplainsOfAFaultThatNeverCameAndOfNoAction) {
  Scenario s = asks_for("landed");
  report::MissionReport r = landing();
  r.safety.first_fault_s = -1.0;
  EXPECT_FALSE(check_named(checks_of(s, r), "fault").passed);
  s.expect.within_s = 1.0;
  r.safety.first_fault_s = 9.0;
  EXPECT_EQ(check_named(checks_of(s, r), "within_s").value, "no action after the fault");
}

TEST(Verdict, TakesAnySafeEndWhereNoneIsNamed) {
  const Scenario s = asks_for("");
  report::MissionReport r = landing();
  EXPECT_TRUE(check_named(checks_of(s, r), "outcome").passed);
  r.result.reason = "collision";
  r.safety.end = "it flew into the ground";
  const Check c = check_named(checks_of(s, r), "outcome");
  EXPECT_FALSE(c.passed);
  EXPECT_EQ(c.why, "it flew into the ground; the failsafe chose land at 7.80 s (mission; gnss)");
}

TEST(Verdict, LooksAtAMomentThatHasADecision) {
  report::MissionReport r = landing();
  EXPECT_EQ(moment_of({}, r), 7.5);
  r.decisions.clear();
  EXPECT_EQ(moment_of({}, r), 0.0);
}

TEST(Verdict, OfACollisionSaysWhatWasHit) {
  const std::string world = test::scratch_file(
      "w.toml", "[world]\nbounds = [[-8, -8, 1], [60, 8, 8]]\nstart = [0, 0, 4]\ngoal = [50, 0, 4]\n");
  MatrixPlan plan;
  plan.faults = {"esc:off"};
  plan.environments = {world};
  plan.seeds = {1};
  Scenario s = cells_of(plan).front();
  s.config.log = test::scratch("failed.mcap");
  const report::MissionReport r = fly_scenario(s);
  ASSERT_EQ(r.result.reason, "collision") << "four motors, no spare";
  EXPECT_TRUE(r.safety.end.starts_with("it flew into the ground; at (")) << r.safety.end;

  // Its log says the same to who opens it, and to every viewer of events.
  const std::vector<std::string> complaints = complaints_of(s, r);
  const LoggedEnd end = end_of(s.config.log);
  ASSERT_TRUE(end.has_verdict);
  EXPECT_FALSE(end.passed);
  EXPECT_EQ(end.complaints, complaints);
  EXPECT_EQ(end.moment_s, moment_of(checks_of(s, r), r));
  std::string last_event;
  log::McapReader reader(s.config.log);
  for (log::Message m; reader.next(m);)
    if (m.channel->topic == "/events") last_event = m.data;
  const nlohmann::json event = nlohmann::json::parse(last_event);
  EXPECT_EQ(event["level"], static_cast<int>(log::Level::kError));
  EXPECT_EQ(event["message"], "scenario " + s.name + " FAILED: " + complaints.front());
}

TEST(Verdict, OfAFlightThatPassedIsInItsLogToo) {
  Scenario s = asks_for("landed");
  s.name = "quiet";
  const LogVerdict verdict = log_verdict(s.name, checks_of(s, landing()), landing());
  EXPECT_TRUE(verdict.passed);
  EXPECT_EQ(verdict.text, "scenario quiet passed");
  const nlohmann::json j = nlohmann::json::parse(verdict.json);
  EXPECT_EQ(j["scenario"], "quiet");
  EXPECT_EQ(j["passed"], true);
  EXPECT_TRUE(j["complaints"].empty());
  EXPECT_EQ(j["checks"].size(), checks_of(s, landing()).size());
  EXPECT_FALSE(j.contains("moment_s"));
}

TEST(ScenarioFile, IsToldFromOtherToml) {
  EXPECT_TRUE(is_scenario(test::scratch_file("s.toml", kHead + kTail)));
  EXPECT_TRUE(is_scenario(test::scratch_file("s.toml", kTail))) << "one with a mistake in it";
  EXPECT_FALSE(is_scenario(test::scratch_file("s.toml", "[camera]\npixels = 48\n")));
  EXPECT_THROW((void)is_scenario(test::scratch_file("s.toml", "no toml")), InputError);
}

TEST(ScenarioMatrix, IsFaultsByEnvironmentsBySeeds) {
  const MatrixPlan plan{
      {"none", "depth:covered:2"}, {"1", "yard.toml"}, {3, 4}, governor::Phase::kReturn, 1.5, 2.0, 60.0};
  const std::vector<Scenario> cells = cells_of(plan);
  ASSERT_EQ(cells.size(), 8U);
  EXPECT_TRUE(cells[0].config.faults.empty());
  EXPECT_EQ(cells[0].expect.outcome, "reached_goal");
  EXPECT_EQ(cells[1].config.seed, 4U);
  EXPECT_EQ(cells[2].world, "yard.toml");
  EXPECT_EQ(cells[7].name, "depth:covered:2 yard seed 4");
  ASSERT_EQ(cells[7].config.faults.size(), 1U);
  const TimedFault& f = cells[7].config.faults.front();
  EXPECT_EQ(f.fault.component, sitl::Component::kDepth);
  EXPECT_EQ(f.fault.kind, sitl::FaultKind::kCovered);
  EXPECT_EQ(f.fault.instance, 2);
  EXPECT_EQ(f.phase, governor::Phase::kReturn);
  EXPECT_EQ(f.at_s, 1.5);
  EXPECT_EQ(f.for_s, 2.0);
  EXPECT_TRUE(cells[7].expect.outcome.empty());
}

TEST(ScenarioMatrix, UsesEveryComponentIfNothingElseIsSaid) {
  const std::vector<std::string> names = usual_faults();
  EXPECT_EQ(names.size(), sitl::kComponentCount + 1);
  for (const std::string& name : names) EXPECT_NO_THROW((void)fault_named("--faults", name));
  EXPECT_EQ(names.front(), "none");
  EXPECT_EQ(names.back(), "wind:on");
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
