#include "platform/app/solve_command.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "platform/input/input_error.hpp"

namespace roborun::app {
namespace {

using Json = nlohmann::json;

Json problem() {
  return {
      {"delta_d_s", 0.5},       {"q", {{2e-6, 0.0, 0.0, 1.0}, {1e-7, 0.0, 0.0, 1.0}, {1e-6, 0.0, 0.0, 1.0}}},
      {"g_avg_m", 1.3},         {"d_obs_m", 5.0},
      {"v_sensor_m3", 3e4},     {"v_map_m3", 9e4},
      {"v_planner_max_m3", 1e4}};
}

TEST(Solve, AnswersAProblemAndSaysWhatTheCheckerThinks) {
  const Json answer = Json::parse(solve_json(problem().dump()));
  EXPECT_EQ(answer["status"], "ok");
  EXPECT_EQ(answer["certificate"], "accepted");
  ASSERT_EQ(answer["p_m"].size(), 3U);
  EXPECT_EQ(answer["p_m"][1], answer["p_m"][2]);
  // Eq. 4 by hand.
  const double p0 = answer["p_m"][0];
  const double p1 = answer["p_m"][1];
  const double latency_s = 2e-6 / (p0 * p0 * p0) * answer["v_m3"][0].get<double>() +
                           1e-7 / (p1 * p1 * p1) * answer["v_m3"][1].get<double>() +
                           1e-6 / (p1 * p1 * p1) * answer["v_m3"][2].get<double>();
  EXPECT_NEAR(answer["latency_s"].get<double>(), latency_s, 1e-12);
  EXPECT_LE(latency_s, 0.5 + 1e-12);
  EXPECT_LE(p0, 1.3);
  EXPECT_EQ(answer["multipliers"].size(), 9U);
}

TEST(Solve, AListGivesAListAndEveryOddNumberHasAnAnswer) {
  const std::string text = "[" + problem().dump() +
                           R"(, {"delta_d_s": NaN, "profile": "paper", "v_sensor_m3": 1, "v_map_m3": 1,
                               "v_planner_max_m3": 1},
                              {"delta_d_s": 1.0, "profile": "paper", "v_sensor_m3": Infinity, "v_map_m3": 3e4,
                               "v_planner_max_m3": 1, "g_avg_m": -Infinity},
                              {"delta_d_s": 1.0, "q": [[0,0,0,1],[0,0,0,1],[0,0,0,1]], "v_sensor_m3": 10,
                               "v_map_m3": 5, "v_planner_max_m3": 2, "levels": 1}])";
  const Json answers = Json::parse(solve_json(text));
  ASSERT_EQ(answers.size(), 4U);
  EXPECT_EQ(answers[1]["status"], "invalid");
  EXPECT_EQ(answers[2]["status"], "infeasible");
  EXPECT_EQ(answers[2]["active"][0], "empty_precision");
  EXPECT_EQ(answers[3]["status"], "ok") << "nothing costs anything";
  EXPECT_EQ(answers[3]["v_m3"][0], 5.0);
  EXPECT_EQ(answers[3]["p_m"][0], 0.3);
}

TEST(Solve, RefusesWithTheNumberOfTheProblemTheKeyAndWhatWouldBeRight) {
  const auto complaint = [](const std::string& text) -> std::string {
    try {
      return "took it: " + solve_json(text);
    } catch (const InputError& error) {
      return error.what();
    }
  };
  Json bad = problem();
  bad["q"][1] = {1, 2, 3};
  EXPECT_EQ(complaint(bad.dump()), "problem 1: q: must be 3 rows of 4 numbers");
  bad = problem();
  bad["levels"] = 7;
  EXPECT_EQ(complaint("[" + problem().dump() + "," + bad.dump() + "]"),
            "problem 2: levels: must be a whole number from 1 to 6");
  bad = problem();
  bad.erase("delta_d_s");
  EXPECT_EQ(complaint(bad.dump()), "problem 1: delta_d_s: missing");
  bad = problem();
  bad["d_obs_m"] = "near";
  EXPECT_EQ(complaint(bad.dump()), "problem 1: d_obs_m: must be a number");
  bad = problem();
  bad["v_sensor"] = 3;
  EXPECT_NE(complaint(bad.dump()).find("v_sensor: unknown key: must be one of"), std::string::npos);
  EXPECT_NE(complaint("{\"delta_d_s\": ").find("not JSON"), std::string::npos);
  EXPECT_NE(complaint("3").find("must be an object"), std::string::npos);
}

}  // namespace
}  // namespace roborun::app
