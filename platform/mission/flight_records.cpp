#include "platform/mission/flight_records.hpp"

#include <algorithm>
#include <cmath>

#include "platform/log/why.hpp"
#include "stages/planning/ways.hpp"

namespace roborun::mission {
namespace {

static_assert(log::kUnseenWeight == stages::kUnknownWeight);

constexpr int kMostCells = static_cast<int>(log::MapSlice::kMostCells);
// Merged cells are free if all of them are, occupied if one is. A slice is as wide as that or as wide as kMostMerged allow: at 6 m/s
// and one slice per second what lies ahead is in it.
constexpr double kSliceSpan_m = 25.0;
constexpr int kMostMerged = 4;

std::int64_t since(MonotonicTime start, MonotonicTime now) noexcept { return (now - start).count(); }

const char* name_of(flight::DecisionKind kind) noexcept {
  if (kind == flight::DecisionKind::kNew) return "new";
  return kind == flight::DecisionKind::kBrake ? "brake" : "keep";
}

/// From its start to its end, as many points as there is room for, at most four a second.
void add_points(const Trajectory& trajectory, log::DecisionEntry& entry) noexcept {
  constexpr double kStep_s = 0.25;
  const double whole_s = trajectory.duration_s();
  const auto most = static_cast<double>(log::DecisionEntry::kMostPoints - 1);
  const double steps = std::clamp(std::ceil(whole_s / kStep_s), 1.0, most);
  entry.points = static_cast<std::size_t>(steps) + 1;
  for (std::size_t i = 0; i < entry.points; ++i)
    entry.point_W[i] = log::numbers_of(trajectory.at_s(whole_s * static_cast<double>(i) / steps).p_W);
}

/// "camera 1", "lidar 2" and " " behind it.
template <std::size_t N>
void append_sensor(log::FixedText<N>& text, std::size_t sensor) noexcept {
  const bool is_camera = sensor < kMostCameras;
  const char digit = static_cast<char>('1' + sensor - (is_camera ? 0 : kMostCameras));
  text.append(is_camera ? "camera " : "lidar ");
  text.append({&digit, 1});
}

void add_refused(flight::FlightSystem& system, log::DecisionEntry& entry) noexcept {
  for (const flight::RefusedImage& image : system.decision_program().refused_now()) {
    log::FixedText<32> one;
    append_sensor(one, image.sensor);
    one.append(" ");
    one.append(to_string(image.fault));
    // Each once, though a LiDAR has six images.
    if (entry.refused.view().find(one.view()) == std::string_view::npos) entry.refused.add(one.view());
  }
}

void add_active(const governor::SolverSolution& solution, log::DecisionEntry& entry) noexcept {
  for (std::size_t i = 0; i < governor::kConstraintCount; ++i)
    if (((solution.active >> i) & 1U) != 0)
      entry.active.add(governor::to_string(static_cast<governor::Constraint>(i)));
  for (const governor::Reason reason : governor::kReasons)
    if ((solution.active & reason) != 0) entry.active.add(governor::to_string(reason));
}

}  // namespace

log::StateRecord state_record(flight::FlightSystem& system, MonotonicTime now, MonotonicTime start,
                              bool has_motors) noexcept {
  const flight::FlightControl& control = system.control();
  log::StateRecord r;
  r.time_ns = since(start, now);
  stages::EstimatedState state;
  if (control.estimator().state(state) == Status::kOk) {
    r.p_WB = log::numbers_of(state.p_WB);
    r.v_WB = log::numbers_of(state.v_WB);
    r.w_WB_B = log::numbers_of(state.w_WB_B);
    const Quaternion& q = state.q_WB;
    r.q_WB = {q.w(), q.x(), q.y(), q.z()};
    r.yaw_rad =
        std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()), 1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
    r.position_sigma_m = state.position_sigma_m;
  }
  const TrajectoryPoint& reference = control.reference();
  r.reference_p_W = log::numbers_of(reference.p_W);
  r.reference_v_W = log::numbers_of(reference.v_W);
  r.reference_a_W = log::numbers_of(reference.a_W);
  r.has_motors = has_motors;
  if (has_motors) r.motors = control.command().thrust_ratio;
  r.battery_ratio = system.pilot().battery_ratio();
  r.phase = governor::to_string(system.pilot().phase());
  r.action = governor::to_string(system.pilot().action());
  return r;
}

log::DecisionEntry decision_entry(flight::FlightSystem& system, const flight::DecisionOutput& out,
                                  const PrecisionLattice& lattice, std::uint64_t number, MonotonicTime now,
                                  MonotonicTime start) noexcept {
  const OperatingPoint& point = out.decision.point;
  log::DecisionEntry e;
  e.time_ns = since(start, now);
  e.number = number;
  e.speed_limit_mps = point.speed_limit_mps;
  e.p0_m = lattice.cell_size_m(point.p0_level);
  e.p1_m = lattice.cell_size_m(point.p1_level);
  e.v0_m3 = out.work[core::StageId::kMap].volume_m3;
  e.v1_m3 = out.work[core::StageId::kExport].volume_m3;
  e.v2_m3 = out.work[core::StageId::kPlanner].volume_m3;
  e.time_budget_s = seconds(out.decision.time_budget);
  e.deadline_s = seconds(point.deadline);
  e.latency_s = seconds(out.latency);
  e.kind = name_of(out.kind);
  e.budget_source = governor::to_string(out.decision.source);
  e.speed_source = governor::to_string(out.decision.speed_source);
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    e.stage_s[i] = seconds(out.cost[i]);
    e.predicted_s[i] = out.decision.predicted_s[i];
  }
  e.visible_m = out.profile.closest_unknown_m;
  e.closest_obstacle_m = out.profile.closest_obstacle_m;
  e.gap_average_m = out.profile.gap_average_m;
  e.sensor_volume_m3 = out.profile.sensor_volume_m3;
  e.map_volume_m3 = out.profile.map_volume_m3;
  e.demand_m = out.decision.demand_m;
  e.way_m = out.way_m;
  e.solver = to_string(out.decision.solution.status);
  e.ways = to_string(out.ways_status);
  e.planner = to_string(out.planner_status);
  e.smoother = to_string(out.smoother_status);
  e.missed = out.latency > point.deadline;
  e.goal_W = log::numbers_of(system.decision_program().goals().now_W());
  add_active(out.decision.solution, e);
  add_refused(system, e);
  if (out.kind != flight::DecisionKind::kKeep) add_points(out.trajectory, e);
  return e;
}

log::FailsafeEntry failsafe_entry(const flight::FailsafeEvent& event, MonotonicTime start) noexcept {
  log::FailsafeEntry e;
  e.time_ns = since(start, event.time);
  e.action = governor::to_string(event.action);
  e.phase = governor::to_string(event.phase);
  for (const governor::FailsafeRow& row : governor::kFailsafeTable)
    if ((event.conditions & governor::bit(row.condition)) != 0)
      e.conditions.add(governor::to_string(row.condition));
  if ((event.conditions & governor::bit(governor::Condition::kDepth)) != 0) {
    append_sensor(e.sensor, event.depth_sensor);
    e.sensor.append(": ");
    e.sensor.append(event.depth_fault == stages::FrameFault::kNone ? "silent" : to_string(event.depth_fault));
  }
  return e;
}

void fill_slice(const stages::MapView& view, const Vector3& p_W, log::MapSlice& slice) noexcept {
  const double finest_m = view.finest_m();
  int merged = 1;
  while (merged < kMostMerged && kMostCells * merged * finest_m < kSliceSpan_m) merged *= 2;
  const double block_m = stages::block_m(finest_m);
  const int blocks = merged * kMostCells / stages::kBlockCells;
  const int cells_per_block = stages::kBlockCells / merged;
  const auto block = [block_m](double at_m) { return static_cast<int>(std::floor(at_m / block_m)); };
  const int x0 = block(p_W.x()) - blocks / 2;
  const int y0 = block(p_W.y()) - blocks / 2;
  const double bottom_m = block(p_W.z()) * block_m;
  const int z =
      std::clamp(static_cast<int>(std::floor((p_W.z() - bottom_m) / finest_m)), 0, stages::kBlockCells - 1);
  slice.cell_m = merged * finest_m;
  slice.x_m = x0 * block_m;
  slice.y_m = y0 * block_m;
  slice.z_m = p_W.z();
  slice.columns = slice.rows = static_cast<std::uint16_t>(kMostCells);
  stages::CellBlock cells;
  std::uint64_t lookups = 0;
  for (int i = 0; i < blocks * blocks; ++i) {
    const int column = i % blocks;
    const int row = i / blocks;
    const stages::BlockContent content =
        view.read({(x0 + column) * block_m, (y0 + row) * block_m, bottom_m}, finest_m, cells, lookups);
    const bool mixed = content == stages::BlockContent::kMixed;
    const std::uint8_t all =
        content == stages::BlockContent::kFree ? log::MapSlice::kFree : log::MapSlice::kUnknown;
    for (int y = 0; y < cells_per_block; ++y) {
      std::uint32_t free = ~0U;
      std::uint32_t occupied = 0;
      for (int k = 0; mixed && k < merged; ++k) {
        const auto line = static_cast<std::size_t>(stages::kBlockCells * z + y * merged + k);
        free &= cells.free[line];
        occupied |= cells.occupied[line];
      }
      for (int x = 0; x < cells_per_block; ++x) {
        const std::uint32_t bits = ((1U << merged) - 1U) << (x * merged);
        std::uint8_t cell = all;
        if (mixed && (free & bits) == bits) cell = log::MapSlice::kFree;
        if (mixed && (occupied & bits) != 0) cell = log::MapSlice::kOccupied;
        const int at = (row * cells_per_block + y) * slice.columns + column * cells_per_block + x;
        slice.cell[static_cast<std::size_t>(at)] = cell;
      }
    }
  }
}

}  // namespace roborun::mission
