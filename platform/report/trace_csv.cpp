#include "platform/report/trace_csv.hpp"

#include <fmt/format.h>

namespace roborun::report {

std::string trace_csv(std::span<const MissionReport> missions) {
  std::string text =
      "design,seed,time_s,x_m,y_m,z_m,speed_mps,speed_limit_mps,speed_source,p0_m,p1_m,v0_m3,v1_m3,v2_m3,"
      "time_budget_s,"
      "budget_source,"
      "deadline_s,latency_s";
  for (std::size_t i = 0; i < core::kStageCount; ++i)
    text += fmt::format(",{0}_s,{0}_predicted_s", core::to_string(static_cast<core::StageId>(i)));
  text +=
      ",visible_m,closest_obstacle_m,gap_average_m,sensor_volume_m3,map_volume_m3,demand_m,solver,active,"
      "ways,way_m,planner,smoother,refused,missed\n";
  for (const MissionReport& mission : missions) {
    for (const DecisionRecord& d : mission.decisions) {
      text += fmt::format(
          "{},{},{:.4f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{},{},{},{:.1f},{:.1f},{:.1f},{:.4f},{},{:.4f},{:."
          "6f}",
          mission.result.design, mission.result.seed, d.time_s, d.p_WB.x(), d.p_WB.y(), d.p_WB.z(),
          d.speed_mps, d.speed_limit_mps, d.speed_source, d.p0_m, d.p1_m, d.v0_m3, d.v1_m3, d.v2_m3,
          d.time_budget_s, d.budget_source, d.deadline_s, d.latency_s);
      for (std::size_t i = 0; i < core::kStageCount; ++i)
        text += fmt::format(",{:.6f},{:.6f}", d.stage_s[i], d.predicted_s[i]);
      text += fmt::format(",{:.2f},{:.2f},{:.2f},{:.0f},{:.0f},{:.3f},{},{},{},{:.1f},{},{},{},{}\n",
                          d.visible_m, d.closest_obstacle_m, d.gap_average_m, d.sensor_volume_m3,
                          d.map_volume_m3, d.demand_m, d.solver, d.active, d.ways_status, d.way_m,
                          d.planner_status, d.smoother_status, d.refused, d.missed ? 1 : 0);
    }
  }
  return text;
}

}  // namespace roborun::report
