#include "platform/report/mission_result.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "platform/report/result_line.hpp"
#include "tests/platform/report/sample.hpp"

namespace roborun::report {
namespace {

TEST(MissionResult, JsonHasTheFixedKeysInTheirOrder) {
  const auto json = nlohmann::ordered_json::parse(to_json(test::sample_mission("aware", 4.0).result));
  const std::vector<std::string> wanted = {"design",
                                           "profile",
                                           "env",
                                           "seed",
                                           "reached_goal",
                                           "collided",
                                           "mission_time_s",
                                           "distance_m",
                                           "mean_velocity_mps",
                                           "max_velocity_mps",
                                           "energy_kJ",
                                           "decisions",
                                           "deadline_misses",
                                           "latency_s",
                                           "cpu_s",
                                           "cpu_utilization_ratio",
                                           "precision_m",
                                           "real_time_factor",
                                           "map_bytes",
                                           "state_hash"};
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  ASSERT_GE(keys.size(), wanted.size());
  keys.resize(wanted.size());
  EXPECT_EQ(keys, wanted);
  EXPECT_EQ(json["mean_velocity_mps"], 4.0);
  for (const char* key : {"median", "p99", "max"}) EXPECT_TRUE(json["latency_s"].contains(key));
  for (const char* key : {"min", "median", "max"}) EXPECT_TRUE(json["precision_m"].contains(key));
}

TEST(MissionResult, CountsRefusedImagesBySensorAndReasonAndReadsThemBack) {
  MissionResult r = test::sample_mission("aware", 4.0).result;
  EXPECT_EQ(nlohmann::json::parse(to_json(r))["refused"], nlohmann::json::object()) << "none";
  r.refused = {{"camera 1", "fog", 3}, {"camera 1", "turned", 1}, {"lidar 1", "stamp", 2}};
  r.near_brakes = 3;
  r.map_drops = 4;
  const auto json = nlohmann::json::parse(to_json(r));
  EXPECT_EQ(json["refused"]["camera 1"]["fog"], 3);
  EXPECT_EQ(json["refused"]["lidar 1"]["stamp"], 2);
  EXPECT_EQ(json["near_brakes"], 3);
  EXPECT_EQ(json["map_drops"], 4);
  r.map = r.planner = "own";
  const auto back = from_line(to_line(r));
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(to_line(*back), to_line(r));
  ASSERT_EQ(back->refused.size(), 3U);
}

TEST(MissionResult, WhatIsNotFiniteIsNullAndTextIsAlwaysValid) {
  MissionResult r;
  r.mission_time_s = std::numeric_limits<double>::quiet_NaN();
  r.energy_kJ = std::numeric_limits<double>::infinity();
  r.env = "bad \xff utf-8 \"quoted\"\n";
  const auto json = nlohmann::json::parse(to_json(r));
  EXPECT_TRUE(json["mission_time_s"].is_null());
  EXPECT_TRUE(json["energy_kJ"].is_null());
  EXPECT_EQ(to_json(r).find('\n'), std::string::npos) << "one line";
}

}  // namespace
}  // namespace roborun::report
