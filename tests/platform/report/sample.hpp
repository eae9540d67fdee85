/// A small mission for tests of reports.
#pragma once

#include <string>

#include "platform/report/mission_result.hpp"

namespace roborun::test {

inline report::MissionReport sample_mission(const std::string& design, double speed_mps) {
  report::MissionReport m;
  m.result.design = design;
  m.result.profile = "paper";
  m.result.env = "14";
  m.result.seed = 3;
  m.result.reached_goal = true;
  m.result.reason = "reached_goal";
  m.result.mission_time_s = 900.0 / speed_mps;
  m.result.distance_m = 900.0;
  m.result.mean_velocity_mps = speed_mps;
  m.result.energy_kJ = 0.5 * m.result.mission_time_s;
  m.result.flight_Jpm = 485.0 / speed_mps;
  m.result.computing_Jpm = 15.0 / speed_mps;
  for (int i = 0; i < 20; ++i) {
    report::DecisionRecord d;
    d.time_s = i;
    d.p_WB = Vector3(45.0 * i, 0.0, 5.0);
    d.speed_mps = speed_mps;
    d.p0_m = 0.3;
    d.budget_source = "trajectory";
    d.speed_source = "file";
    d.ways_status = "ok";
    d.way_m = 45.0 * (20 - i);
    d.planner_status = "ok";
    d.smoother_status = "ok";
    m.decisions.push_back(d);
    m.path.push_back({d.time_s, d.p_WB, speed_mps});
  }
  m.result.decisions = m.decisions.size();
  return m;
}

}  // namespace roborun::test
