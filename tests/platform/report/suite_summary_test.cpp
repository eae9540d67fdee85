#include "platform/report/suite_summary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "platform/report/result_line.hpp"

namespace roborun::report {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

MissionResult flight(const std::string& env, std::uint64_t seed, const std::string& reason, double shortest_m,
                     double distance_m) {
  MissionResult r;
  r.design = "aware";
  r.profile = "host";
  r.env = env;
  r.seed = seed;
  r.reason = reason;
  r.reached_goal = reason == "reached_goal";
  r.collided = reason == "collision";
  r.distance_m = distance_m;
  r.mean_velocity_mps = 0.1 * distance_m;
  r.suite = SuiteFlight{std::isfinite(shortest_m), shortest_m, "roborun fly --seed " + std::to_string(seed)};
  return r;
}

std::vector<MissionResult> flights() {
  return {flight("maze/paper", 1, "reached_goal", 20.0, 20.0),
          flight("maze/paper", 2, "reached_goal", 20.0, 30.0),
          flight("maze/paper", 3, "reached_goal", 20.0, 80.0),
          flight("maze/paper", 5, "collision", 20.0, 10.0),
          flight("maze/paper", 6, "no_way", 20.0, 10.0),
          flight("maze/a/b.toml", 1, "reached_goal", kNone, 10.0),
          flight("closed/paper", 1, "no_way", kNone, 10.0),
          flight("closed/paper", 2, "holding", kNone, 10.0)};
}

TEST(SuiteSummary, CountsWhatIsPossibleReachedCollidedAndProven) {
  const std::vector<SuiteSummary> all = summarise(flights());
  ASSERT_EQ(all.size(), 3U);
  const SuiteSummary& maze = all[0];
  EXPECT_EQ(maze.world, "maze");
  EXPECT_EQ(maze.vehicle, "paper");
  EXPECT_EQ(maze.flights, 5);
  EXPECT_EQ(maze.possible, 5);
  EXPECT_EQ(maze.reached, 3);
  EXPECT_EQ(maze.collided, 1);
  EXPECT_EQ(maze.no_way, 0) << "there is a way: what it says is no proof";
  EXPECT_DOUBLE_EQ(maze.way_ratio, 1.5);
  EXPECT_DOUBLE_EQ(maze.way_ratio_max, 4.0);
  EXPECT_NEAR(maze.mean_velocity_mps, 13.0 / 3.0, 1e-12);
  EXPECT_EQ(all[1].vehicle, "a/b.toml");
  EXPECT_EQ(all[1].reached, 0) << "only possible problems count";
  EXPECT_TRUE(std::isnan(all[1].way_ratio));
  EXPECT_EQ(all[2].possible, 0);
  EXPECT_EQ(all[2].no_way, 1);
}

TEST(SuiteSummary, ALineOfASuiteReadsBack) {
  const MissionResult wrote = flights()[4];
  const auto back = from_line(to_line(wrote));
  ASSERT_TRUE(back && back->suite);
  EXPECT_EQ(back->env, wrote.env);
  EXPECT_EQ(back->suite->shortest_m, 20.0);
  EXPECT_EQ(back->suite->command, wrote.suite->command);
  EXPECT_FALSE(from_line(to_line(flights().back()))->suite->possible);
}

TEST(SuiteSummary, TableAndJsonNameTheSeedsAndTheCommandOfEveryFailure) {
  const std::string table = suite_table(flights());
  EXPECT_NE(table.find("  1-3,5-6\n"), std::string::npos) << table;
  EXPECT_NE(table.find("failed: maze, paper, host, aware, seed 5: collision"), std::string::npos);
  EXPECT_NE(table.find("failed: maze, paper, host, aware, seed 6: no_way"), std::string::npos);
  EXPECT_NE(table.find("impossible, and not proven: closed, paper, host, aware, seed 2: holding"),
            std::string::npos);
  EXPECT_EQ(table.find("seed 3:"), std::string::npos);
  const std::string json = suite_json("hard", flights(), false);
  for (const char* wanted : {R"("suite":"hard","complete":false)",
                             R"("seeds":[1,2,3,5,6],"flights":5,"possible":5,"reached":3,"collided":1)",
                             R"("way_ratio":null)", R"("command":"roborun fly --seed 6")"})
    EXPECT_NE(json.find(wanted), std::string::npos) << wanted << " is not in " << json;
  EXPECT_EQ(json.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace roborun::report
