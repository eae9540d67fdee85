/// A flight log as a flight of any length writes it, without a flight: for tests of what reads logs.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "core/random/counter_rng.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/mission/inputs_format.hpp"

namespace roborun::test {

inline constexpr double kSampleState_s = 0.025, kSampleDecision_s = 0.5,
                        kSampleLand_s = 0.9;  // land: of the whole

/// Where the sample is at a moment: along x, swinging in y.
inline log::Numbers3 sample_place(double time_s) { return {2.0 * time_s, 6.0 * std::sin(0.2 * time_s), 4.0}; }

/// Pillars on a grid of 9 m, seen as far as 15 m.
inline log::MapSlice sample_slice(double time_s) {
  log::MapSlice s;
  const log::Numbers3 p_W = sample_place(time_s);
  s.time_ns = static_cast<std::int64_t>(1e9 * time_s);
  s.cell_m = 0.3;
  s.columns = s.rows = log::MapSlice::kMostCells;
  const double half_m = 0.5 * s.cell_m * s.columns;
  s.x_m = s.cell_m * std::floor((p_W[0] - half_m) / s.cell_m);
  s.y_m = s.cell_m * std::floor((p_W[1] - half_m) / s.cell_m);
  s.z_m = p_W[2];
  for (int row = 0; row < s.rows; ++row) {
    for (int column = 0; column < s.columns; ++column) {
      const double x_m = s.x_m + s.cell_m * (column + 0.5);
      const double y_m = s.y_m + s.cell_m * (row + 0.5);
      const bool pillar = std::hypot(std::remainder(x_m, 9.0), std::remainder(y_m + 3.0, 9.0)) < 1.0;
      const bool seen =
          std::hypot(x_m - p_W[0], y_m - p_W[1]) < 15.0 + 2.0 * std::sin(7.0 * std::atan2(y_m, x_m));
      s.cell[static_cast<std::size_t>(row) * s.columns + static_cast<std::size_t>(column)] =
          !seen    ? log::MapSlice::kUnknown
          : pillar ? log::MapSlice::kOccupied
                   : log::MapSlice::kFree;
    }
  }
  return s;
}

inline log::DecisionEntry sample_decision(std::uint64_t number, double time_s, double length_s) {
  const double wave = 0.5 + 0.5 * std::sin(0.7 * time_s);
  log::DecisionEntry e;
  e.time_ns = static_cast<std::int64_t>(1e9 * time_s);
  e.number = number;
  e.p_WB = sample_place(time_s);
  e.goal_W = sample_place(length_s);
  e.speed_mps = 2.0 + wave;
  e.speed_limit_mps = 3.0 + wave;
  e.p0_m = wave > 0.5 ? 0.3 : 0.6;
  e.p1_m = 0.6;
  e.v0_m3 = 9000.0 + 5000.0 * wave;
  e.v1_m3 = 14000.0;
  e.v2_m3 = 3000.0 * wave;
  e.time_budget_s = 0.6 + wave;
  e.deadline_s = 0.4;
  e.latency_s = 0.2 + 0.15 * wave;
  e.kind = "new";
  e.budget_source = "trajectory";
  e.speed_source = "file";
  for (double& s : e.stage_s) s = e.latency_s / static_cast<double>(e.stage_s.size());
  e.predicted_s = e.stage_s;
  e.visible_m = 12.0 + wave;
  e.closest_obstacle_m = 3.0 + wave;
  e.gap_average_m = 8.0;
  e.sensor_volume_m3 = 20000.0;
  e.map_volume_m3 = 100.0 * time_s;
  e.demand_m = 0.5 + wave;
  e.way_m = 2.0 * (length_s - time_s);
  e.solver = e.ways = e.planner = e.smoother = "ok";
  e.active.add("deadline");
  e.points = log::DecisionEntry::kMostPoints;
  for (std::size_t i = 0; i < e.points; ++i)
    e.point_W[i] = sample_place(time_s + 0.05 * static_cast<double>(i));
  return e;
}

inline log::StateRecord sample_state(double time_s, double length_s) {
  log::StateRecord r;
  r.time_ns = static_cast<std::int64_t>(1e9 * time_s);
  r.p_WB = sample_place(time_s);
  r.v_WB = {2.0, 1.2 * std::cos(0.2 * time_s), 0.0};
  r.reference_v_W = {2.1, 1.2 * std::cos(0.2 * time_s), 0.0};
  r.battery_ratio = 1.0 - 0.5 * time_s / length_s;
  r.phase = time_s < 2.0 ? "take_off" : time_s < kSampleLand_s * length_s ? "mission" : "land";
  r.action = "go_on";
  return r;
}

/// One image of 96 x 96 noisy pixels as an input: a wall that comes nearer on the left, open sky above, a lost pixel in its lowest row.
inline std::string sample_image(std::uint32_t camera, double time_s) {
  constexpr std::uint16_t kPixels = 96;
  firmware_if::DepthFrame frame{};
  frame.stamp = MonotonicTime{Nanos{static_cast<std::int64_t>(1e9 * time_s)}};
  frame.width = frame.height = kPixels;
  frame.range_m = 25.0F;
  core::CounterRng rng(7, static_cast<std::uint64_t>(1e3 * time_s) + camera);
  std::string payload;
  mission::PutField put(payload);
  put(camera);
  mission::each_field(put, frame);
  for (int i = 0; i < kPixels * kPixels; ++i) {
    const double depth_m = i % kPixels < 48 ? 4.0 + 3.0 * std::cos(0.2 * time_s) : 20.0;
    float seen_m = static_cast<float>(depth_m + 0.001 * depth_m * depth_m * rng.normal());
    if (i < kPixels * 20) seen_m = std::numeric_limits<float>::infinity();
    if (i / kPixels == kPixels - 1) seen_m = std::numeric_limits<float>::quiet_NaN();
    put(seen_m);
  }
  mission::InputBatch batch;
  batch.add(mission::RecordKind::kDepth, payload);
  return batch.take();
}

/// A flight of `length_s` seconds, whose failsafe lands at kSampleLand_s of it.
inline void write_sample_log(const std::string& path, double length_s) {
  log::FlightLog log(path, false);
  log.configure(
      R"({"build":{"commit":"0123abc","compiler":"GNU"},"start_m":[0,0,4],"flight":{"design":"aware","seed":7,)"
      R"("mounts":[{"R_BC":[1,0,0,0,1,0,0,0,1]},{"R_BC":[0,1,0,-1,0,0,0,0,1]}],"min_W":[-20,-30,0],"max_W":[1300,30,12],"goal_W":[40,0,4],"fence":{"areas":[)"
      R"({"keep_in":true,"radius_m":0,"points":[[-18,-28],[900,-28],[900,28]]},)"
      R"({"keep_in":false,"radius_m":3,"points":[[30,20]]}]}}})",
      {{"commit", "0123abc"}});
  log.world(R"({"height_m":4.0,"circles":[[9.0,-3.0,1.0]],"rings":[[[20.0,5.0],[22.0,5.0],[22.0,8.0]]]})");
  log.event(0, log::Level::kInfo, "goal", "goal (40.0, 0.0, 4.0) m");
  std::uint64_t decisions = 0;
  std::uint64_t slices = 0;
  bool landing = false;
  for (std::uint64_t i = 0; static_cast<double>(i) * kSampleState_s <= length_s; ++i) {
    const double time_s = static_cast<double>(i) * kSampleState_s;
    log.write(sample_state(time_s, length_s));
    if (!landing && time_s >= kSampleLand_s * length_s) {
      log::FailsafeEntry entry;
      entry.time_ns = static_cast<std::int64_t>(1e9 * time_s);
      entry.action = "land";
      entry.phase = "mission";
      entry.conditions.add("gnss");
      log.write(entry);
      landing = true;
    }
    if (time_s >= 1.0 + static_cast<double>(decisions) * kSampleDecision_s) {
      ++decisions;
      log.write(sample_decision(decisions, time_s, length_s));
    }
    if (time_s >= static_cast<double>(slices)) {
      ++slices;
      log.write(sample_slice(time_s));
      for (const std::uint32_t camera : {0U, 1U})
        log.inputs(static_cast<std::int64_t>(1e9 * time_s), sample_image(camera, time_s + 0.2 * camera));
    }
  }
  const auto end_ns = static_cast<std::int64_t>(1e9 * length_s);
  log.event(end_ns, log::Level::kInfo, "end", "the flight ended: landed <at> the end");
  log.result(end_ns, R"({"reached_goal":false,"collided":false,"reason":"landed","mission_time_s":)" +
                         std::to_string(length_s) + R"(,"decisions":)" + std::to_string(decisions) + "}");
  log.verdict(end_ns, R"({"scenario":"sample","passed":false,"complaints":["outcome: landed, must be )"
                      R"(<reached_goal>"],"checks":[],"moment_s":2.5})");
  log.finish();
}

}  // namespace roborun::test
