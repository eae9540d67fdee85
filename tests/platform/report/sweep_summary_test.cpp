#include "platform/report/sweep_summary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "platform/report/flight_record.hpp"
#include "platform/report/result_line.hpp"
#include "tests/platform/report/sample.hpp"

namespace roborun::report {
namespace {

SweepRow row(const char* env, const char* design, std::uint64_t seed, double speed_mps) {
  SweepRow r;
  r.result = test::sample_mission(design, speed_mps).result;
  r.result.env = env;
  r.result.map = r.result.planner = "own";
  r.result.seed = seed;
  r.result.decisions = 100;
  r.result.cpu_s = 50.0;
  r.result.latency_s = {0.5, 1.0, 2.0};
  r.density_ratio = 0.45;
  r.spread_m = 80.0;
  r.distance_m = 900.0;
  return r;
}

TEST(ResultLine, ReadsBackWhatItWroteWithoutTheWallTime) {
  MissionResult result = row("3", "aware", 18446744073709551615ULL, 4.0).result;
  result.energy_kJ = 0.1 + 0.2;
  result.cpu_s = std::nan("");
  result.real_time_factor = 35.0;
  const std::string line = to_line(result);
  EXPECT_EQ(line.find("real_time_factor"), std::string::npos);
  EXPECT_EQ(line.find("believed"), std::string::npos);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto back = from_line(line);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(to_line(*back), line);
  EXPECT_EQ(back->seed, result.seed);
  EXPECT_EQ(back->energy_kJ, result.energy_kJ);
  EXPECT_EQ(back->flight_Jpm, result.flight_Jpm);
  EXPECT_EQ(back->computing_Jpm, result.computing_Jpm);
  EXPECT_TRUE(std::isnan(back->cpu_s));
  for (std::size_t cut = 0; cut < line.size(); ++cut) EXPECT_FALSE(from_line(line.substr(0, cut)));
}

TEST(FlightRecord, ReadsBackWhatThePicturesNeed) {
  MissionReport mission = test::sample_mission("aware", 4.0);
  mission.decisions[3].stage_s = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  mission.decisions[3].missed = true;
  mission.decisions[4].visible_m = INFINITY;
  const std::string text = to_flight_record(mission);
  MissionReport back;
  ASSERT_TRUE(from_flight_record(text, back));
  ASSERT_EQ(back.decisions.size(), mission.decisions.size());
  EXPECT_EQ(back.decisions[3].stage_s, mission.decisions[3].stage_s);
  EXPECT_TRUE(back.decisions[3].missed);
  EXPECT_EQ(back.decisions[4].visible_m, 0.0);
  EXPECT_EQ(back.path.size(), mission.path.size() / 5);
  EXPECT_EQ(to_flight_record(mission), text);
  EXPECT_FALSE(from_flight_record(text.substr(0, text.size() / 2), back));
  EXPECT_FALSE(from_flight_record(R"({"path":[[1,2]],"decisions":[]})", back));
}

TEST(SweepSummary, TakesMeansOverWhatReachedAndIntervalsOverSeeds) {
  // Means of the seeds: (2 + 4) / 2 = 3 and (4 + 6) / 2 = 5; s = sqrt(2), t(1) = 12.706: 12.706 * 1 = 12.706.
  std::vector<SweepRow> rows{row("1", "aware", 1, 2.0), row("2", "aware", 1, 4.0), row("1", "aware", 2, 4.0),
                             row("2", "aware", 2, 6.0)};
  rows.push_back(row("3", "aware", 1, 100.0));
  rows.back().result.reached_goal = false;
  rows.back().result.collided = true;
  const std::vector<DesignSummary> sut = summarise(rows);
  ASSERT_EQ(sut.size(), 1U);
  EXPECT_EQ(sut[0].missions, 5);
  EXPECT_EQ(sut[0].reached, 4);
  EXPECT_EQ(sut[0].collided, 1);
  EXPECT_NEAR(sut[0].velocity_mps.mean, 4.0, 1e-12);
  EXPECT_NEAR(sut[0].velocity_mps.half_95, 12.706, 1e-3);
  EXPECT_NEAR(sut[0].cpu_s_per_decision.mean, 0.5, 1e-12);
  EXPECT_NEAR(sut[0].latency_s.mean, 0.5, 1e-12);
}

TEST(SweepSummary, HasNoIntervalForOneSeedAndNoMeanForNoMission) {
  std::vector<SweepRow> rows{row("1", "aware", 1, 2.0)};
  EXPECT_TRUE(std::isnan(summarise(rows)[0].velocity_mps.half_95));
  rows[0].result.reached_goal = false;
  EXPECT_TRUE(std::isnan(summarise(rows)[0].velocity_mps.mean));
  EXPECT_TRUE(summarise({}).empty());
}

TEST(SweepSummary, ComparesOnlyMissionsThatBothReached) {
  std::vector<SweepRow> rows{row("1", "aware", 1, 4.0), row("2", "aware", 1, 8.0), row("1", "static", 1, 0.5),
                             row("2", "static", 1, 0.5)};
  EXPECT_EQ(gain(rows, "paper", "aware", "static").pairs, 2);
  EXPECT_NEAR(gain(rows, "paper", "aware", "static").velocity.mean, 12.0, 1e-12);
  rows[3].result.reached_goal = false;
  const Gain sut = gain(rows, "paper", "aware", "static");
  EXPECT_EQ(sut.pairs, 1);
  EXPECT_NEAR(sut.velocity.mean, 8.0, 1e-12);
  EXPECT_NEAR(sut.mission_time.mean, 8.0, 1e-12);
  EXPECT_TRUE(std::isnan(sut.velocity.half_95));
  EXPECT_EQ(gain(rows, "other", "aware", "static").pairs, 0);
}

TEST(SweepSummary, GivesTheIntervalOfAGainFromTheRatiosOfTheSeeds) {
  // Ratios 8 and 12: mean 10, s = sqrt(8), 12.706 sqrt(8 / 2) = 25.412.
  const std::vector<SweepRow> rows{row("1", "aware", 1, 4.0), row("1", "static", 1, 0.5),
                                   row("1", "aware", 2, 6.0), row("1", "static", 2, 0.5)};
  const Gain sut = gain(rows, "paper", "aware", "static");
  EXPECT_NEAR(sut.velocity.mean, 10.0, 1e-12);
  EXPECT_NEAR(sut.velocity.half_95, 25.412, 1e-3);
}

TEST(SweepSummary, TheTableNamesEachMissionThatFailedAndTheJsonHasTheAgreedFields) {
  std::vector<SweepRow> rows{row("1", "aware", 1, 4.0), row("2", "aware", 1, 8.0),
                             row("1", "static", 1, 0.5)};
  rows[1].result.reached_goal = false;
  rows[1].result.reason = "gave_up";
  const std::string table = sweep_table(rows);
  EXPECT_NE(table.find("environment 2, paper, aware, seed 1: gave_up"), std::string::npos) << table;
  EXPECT_NE(table.find("aware against static                        1        8.00"), std::string::npos)
      << table;
  const auto json = nlohmann::json::parse(sweep_json("paper27", rows, true));
  const auto& aware = json.at("designs").at("aware");
  EXPECT_EQ(aware.at("missions"), 2);
  EXPECT_EQ(aware.at("reached"), 1);
  EXPECT_EQ(aware.at("collided"), 0);
  EXPECT_EQ(aware.at("mean_velocity_mps"), 4.0);
  EXPECT_EQ(aware.at("mean_mission_time_s"), 225.0);
  EXPECT_EQ(aware.at("mean_energy_kJ"), 112.5);
  EXPECT_EQ(aware.at("mean_flight_Jpm"), 121.25);
  EXPECT_EQ(aware.at("mean_computing_Jpm"), 3.75);
  EXPECT_NE(table.find("        121.2       3.8"), std::string::npos) << table;
  EXPECT_EQ(aware.at("median_latency_s"), 0.5);
  EXPECT_EQ(aware.at("cpu_s_per_decision"), 0.5);
  EXPECT_EQ(json.at("profiles").at("paper"), json.at("designs"));
}

}  // namespace
}  // namespace roborun::report
