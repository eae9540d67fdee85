#include "platform/flight/decision_pipeline.hpp"

#include <algorithm>
#include <cmath>

#include "core/memory/static_vector.hpp"
#include "stages/perception/polled_view.hpp"
#include "stages/planning/fenced_view.hpp"

namespace roborun::flight {
namespace {

constexpr std::size_t index(core::StageId id) noexcept { return static_cast<std::size_t>(id); }
constexpr double kTrajectoryStep_s = 0.5;  // of the points that order the space by distance
constexpr std::size_t kTrajectoryPoints = 32;
constexpr double kCornerRoom_m = 0.25;
constexpr double kAtRest_mps = 0.05;
constexpr double kMotionReach_m = 15.0;  // farther away depth noise looks like motion
constexpr int kMotionPoints = 3;
constexpr double kStanding_mps = 0.5;
constexpr double kTooFast = 1.5;
constexpr double kStraightShare = 2.0 / 3.0;  // of the horizon
constexpr double kCollinear = 1.0 - 1e-6;     // cosine
constexpr Nanos kMotionMemory{3'000'000'000};
constexpr Nanos kTraceMemory{10'000'000'000};  // as long as the map may remember what has gone
constexpr double kTraceSpacing_m = 0.6;
/// What the way beyond a trajectory's end is flown at, on the average, when arrivals are compared.
constexpr double kBeyond_mps = 2.0;

/// When the vehicle would be at the goal, counted from in.now.
double arrival_s(const Trajectory& trajectory, const DecisionInput& in) noexcept {
  return seconds(trajectory.start_time - in.now) + trajectory.duration_s() +
         (in.goal_W - trajectory.end_W()).norm() / kBeyond_mps;
}

}  // namespace

DecisionPipeline::DecisionPipeline(const PipelineConfig& config, core::StageMeter& meter,
                                   governor::Governor& governor, stages::PointCloud& cloud,
                                   stages::OccupancyMap& map, stages::Planner& planner,
                                   stages::Smoother& smoother) noexcept
    : config_(config),
      meter_(meter),
      governor_(governor),
      cloud_(cloud),
      map_(map),
      planner_(planner),
      smoother_(smoother) {
  cloud_.set_height_limits(config.map_bounds_W.min_W.z(), config.map_bounds_W.max_W.z());
}

void DecisionPipeline::charge(core::StageId id, const core::Work& work, DecisionOutput& out) noexcept {
  meter_.charge_to(id);
  out.work[index(id)] = work;
  out.cost[index(id)] = meter_.settle(id, work);
  out.latency += out.cost[index(id)];
}

core::MeteredBudget DecisionPipeline::budget_of(core::StageId id, const DecisionOutput& out) noexcept {
  Nanos rest = out.decision.point.deadline - out.latency;
  for (std::size_t later = index(id) + 1; later < core::kStageCount; ++later)
    rest -= from_seconds(out.decision.predicted_s[later]);
  return {meter_, id, meter_.grant(id, rest)};
}

core::MeteredBudget DecisionPipeline::table_budget_of(core::StageId id) noexcept {
  return {meter_, id, meter_.grant(id, core::slot(core::slot_of(id)).budget)};
}

void DecisionPipeline::sense_motion(const DecisionInput& in, const Aabb& relevant_W,
                                    core::StageBudget& budget, core::Work& work) noexcept {
  const stages::PolledView known(map_.view(), budget, work);
  core::StaticVector<Vector3, kTraces / 4> appeared_W;
  int appeared = 0;
  for (const stages::CloudPoint& point : cloud_.points()) {
    const Vector3 offset = point.p_W - in.p_WB;
    const bool behind = offset.dot(in.v_WB) < 0.0 && in.v_WB.norm() > kStanding_mps;
    if (offset.norm() > kMotionReach_m || behind || !relevant_W.contains(point.p_W)) continue;
    if (!known.is_free_at_finest(Aabb::around(point.p_W, 0.5 * kFinestCell_m), work.units)) continue;
    ++appeared;
    const bool noted = std::any_of(appeared_W.begin(), appeared_W.end(), [&point](const Vector3& other_W) {
      return (other_W - point.p_W).squaredNorm() < kTraceSpacing_m * kTraceSpacing_m;
    });
    if (!noted && !appeared_W.push_back(point.p_W)) break;
  }
  if (appeared < kMotionPoints) return;
  motion_until_ = in.now + kMotionMemory;
  for (const Vector3& p_W : appeared_W) {
    trace_[next_trace_] = {p_W, in.now + kTraceMemory};
    next_trace_ = (next_trace_ + 1) % kTraces;
  }
}

void DecisionPipeline::perceive(const DecisionInput& in, DecisionOutput& out) noexcept {
  core::MeteredBudget budget = table_budget_of(core::StageId::kPointCloud);
  core::Work work;
  const std::uint64_t refused = cloud_.counters().frames_refused;
  const bool sees_all = cloud_.step(in.frames, 0, budget, work) == Status::kOk &&
                        cloud_.counters().frames_refused == refused && in.frames.size() >= config_.cameras;
  const double r_m = radius_m();
  const Aabb relevant_W{config_.flight_bounds_W.min_W - Vector3::Constant(r_m),
                        config_.flight_bounds_W.max_W + Vector3::Constant(r_m)};
  sense_motion(in, relevant_W, budget, work);
  out.motion = in.now < motion_until_;
  (void)profile_space({}, cloud_.points(), map_.view(), *in.committed, in.now, in.p_WB, in.v_WB, in.goal_W,
                      relevant_W, r_m, out.profile, budget, work);
  if (!sees_all) out.profile.obstacle_ahead_m = 0.0;
  out.profile.sensor_volume_m3 = cloud_.seen_volume_m3();
  // What the map will hold once this decision's images are in it.
  out.profile.map_volume_m3 = map_.known_volume_m3() + cloud_.seen_volume_m3();
  charge(core::StageId::kPointCloud, work, out);
}

bool DecisionPipeline::went_straight(const DecisionInput& in) const noexcept {
  if (kept_W_.size() != 2) return false;
  const Vector3 way = kept_W_[1] - kept_W_[0], to_goal = in.goal_W - kept_W_[0];
  return way.norm() >= kStraightShare * config_.horizon_m &&
         way.dot(to_goal) >= kCollinear * way.norm() * to_goal.norm();
}

void DecisionPipeline::govern(const DecisionInput& in, DecisionOutput& out) noexcept {
  out.decision = governor_.decide(
      out.profile, {failures_, (in.goal_W - in.p_WB).norm(), in.climbing, out.motion, went_straight(in)});
  if (out.decision.predicted_s[index(core::StageId::kGovernor)] > 0.0)
    charge(core::StageId::kGovernor, {}, out);
}

void DecisionPipeline::integrate(const DecisionInput& in, DecisionOutput& out) noexcept {
  core::StaticVector<Vector3, kTrajectoryPoints> trajectory_W;
  (void)trajectory_W.push_back(in.p_WB);
  const double begin_s = seconds(in.now - in.committed->start_time);
  for (double ahead_s = kTrajectoryStep_s; ahead_s < in.committed->duration_s() - begin_s;
       ahead_s += kTrajectoryStep_s) {
    if (!trajectory_W.push_back(in.committed->at_s(begin_s + ahead_s).p_W)) break;
  }
  const OperatingPoint& point = out.decision.point;
  core::MeteredBudget budget = budget_of(core::StageId::kMap, out);
  stages::IntegrationResult integrated;
  core::StaticVector<Vector3, kTraces> moved_W;
  for (const Trace& trace : trace_) {
    if (in.now < trace.until) (void)moved_W.push_back(trace.p_W);
  }
  (void)map_.integrate({in.frames,
                        point.p0_level,
                        point.v0_m3,
                        {trajectory_W.begin(), trajectory_W.size()},
                        {moved_W.begin(), moved_W.size()}},
                       budget, integrated);
  charge(core::StageId::kMap, integrated.work, out);
}

void DecisionPipeline::check_committed(const DecisionInput& in, DecisionOutput& out) noexcept {
  if (in.climbing) return;  // through space that is not known yet
  const stages::FencedView fenced(map_.view(), config_.fence);
  const stages::FinestView known(config_.fence.empty() ? map_.view() : fenced);
  meter_.charge_to(core::StageId::kPlanner);
  core::MeteredBudget budget = budget_of(core::StageId::kPlanner, out);
  core::Work& work = out.work[index(core::StageId::kPlanner)];
  const stages::PolledView polled(known, budget, work);
  const double from_s = seconds(in.now - in.committed->start_time);
  const double until_s = free_until_s(polled, *in.committed, from_s, config_.vehicle_radius_m, work.units);
  // Where something moves, what is fast now is not flown on until a slower plan is there.
  const bool too_fast = out.motion && in.v_WB.norm() > kTooFast * out.decision.point.speed_limit_mps;
  if (until_s > 1e300 && !too_fast) return;
  const MonotonicTime free_until =
      until_s > 1e300 ? MonotonicTime::max() : in.committed->start_time + from_seconds(until_s);
  offer_stop(in, free_until, known, work, out);
}

void DecisionPipeline::offer_stop(const DecisionInput& in, MonotonicTime free_until,
                                  const stages::MapView& known, core::Work& work,
                                  DecisionOutput& out) noexcept {
  const MonotonicTime soonest = in.now + out.latency + config_.minor_frame;
  const TrajectoryPoint then = in.committed->at(soonest);
  Trajectory stop;
  if (then.v_W.norm() <= kAtRest_mps ||
      smoother_.brake(then, soonest, {config_.acceleration_mps2, config_.acceleration_mps2}, stop) !=
          Status::kOk)
    return;
  const double stop_free_s = free_until_s(known, stop, 0.0, config_.vehicle_radius_m, work.units);
  if (stop_free_s < 1e300 && soonest + from_seconds(stop_free_s) < free_until) return;
  out.kind = DecisionKind::kBrake;
  out.trajectory = stop;
}

void DecisionPipeline::export_map(const DecisionInput& in, DecisionOutput& out) noexcept {
  const OperatingPoint& point = out.decision.point;
  core::MeteredBudget budget = budget_of(core::StageId::kExport, out);
  core::Work exported;
  (void)map_.export_view({point.p1_level, point.v1_m3, in.p_WB}, budget, exported);
  charge(core::StageId::kExport, exported, out);
}

void DecisionPipeline::plan(const DecisionInput& in, DecisionOutput& out) noexcept {
  const stages::FencedView fenced(map_.view(), config_.fence);
  const stages::MapView& view = config_.fence.empty() ? map_.view() : fenced;
  const OperatingPoint& point = out.decision.point;
  const MonotonicTime takes_over = in.now + point.deadline;
  if (in.climbing && takes_over < in.committed->start_time + from_seconds(in.committed->duration_s())) return;
  const TrajectoryPoint start = in.committed->at(takes_over);
  const double r_m = radius_m();

  const stages::FinestView known(view);
  core::Work planner_work = out.work[index(core::StageId::kPlanner)];
  const double from_s = seconds(in.now - in.committed->start_time);
  const double committed_until_s =
      free_until_s(known, *in.committed, from_s, config_.vehicle_radius_m, planner_work.units);

  // First with room for the smoother to cut corners, then as tight as the vehicle can fly.
  stages::SmoothResult smoothed;
  core::Work smoother_work;
  planner_work.level = point.p1_level;
  core::MeteredBudget planner_budget = budget_of(core::StageId::kPlanner, out);
  core::MeteredBudget smoother_budget = table_budget_of(core::StageId::kSmoother);
  for (const double room_m : {kCornerRoom_m, 0.0}) {
    stages::PlanRequest request;
    request.start_W = start.p_W;
    request.goal_W = in.goal_W;
    request.bounds_W = config_.flight_bounds_W;
    request.radius_m = r_m + room_m;
    request.volume_m3 = std::max(point.v2_m3 - planner_work.volume_m3, 0.0);
    request.horizon_m = config_.horizon_m;
    request.kept_W = kept_W_;
    request.seed = in.seed;
    stages::PlanResult planned;
    meter_.charge_to(core::StageId::kPlanner);
    out.planner_status = planner_.plan(request, view, planner_budget, planned);
    out.planned_to_goal = planned.reaches_goal;
    planner_work.units += planned.work.units;
    planner_work.volume_m3 += planned.work.volume_m3;
    kept_W_ = planned.path_W;
    // Too tight for extra room is no reason to flee.
    if (room_m > 0.0 && out.planner_status == Status::kStartBlocked) continue;
    if (planned.path_W.size() >= 2) {
      stages::SmoothRequest smooth;
      smooth.path_W = {planned.path_W.begin(), planned.path_W.size()};
      smooth.start = start;
      smooth.start_time = takes_over;
      smooth.limits = {point.speed_limit_mps, config_.acceleration_mps2};
      smooth.radius_m = out.planner_status == Status::kStartBlocked ? config_.vehicle_radius_m : r_m;
      meter_.charge_to(core::StageId::kSmoother);
      out.smoother_status = smoother_.smooth(smooth, view, smoother_budget, smoothed);
      smoother_work.units += smoothed.work.units;
    }
    if (out.smoother_status == Status::kOk) break;
  }
  charge(core::StageId::kPlanner, planner_work, out);
  charge(core::StageId::kSmoother, smoother_work, out);

  // A new trajectory begins slowly and another one may be there next time: what is flown now is kept as long
  // as it is free, has not begun to brake and arrives no later.
  const MonotonicTime brakes = in.committed->start_time + from_seconds(in.committed->brake_begin_s);
  const bool keeps = committed_until_s > 1e300 && start.v_W.norm() < 1.1 * point.speed_limit_mps &&
                     takes_over < brakes &&
                     arrival_s(*in.committed, in) <= arrival_s(smoothed.trajectory, in);
  if (out.smoother_status == Status::kOk && !keeps) {
    out.kind = DecisionKind::kNew;
    out.trajectory = smoothed.trajectory;
  } else if (committed_until_s < 1e300 && !in.climbing) {
    const MonotonicTime free_until = in.committed->start_time + from_seconds(committed_until_s);
    offer_stop(in, free_until, known, smoother_work, out);
  }
}

void DecisionPipeline::run(core::StageId id, const DecisionInput& in, DecisionOutput& out) noexcept {
  switch (id) {
    case core::StageId::kPointCloud:
      out = {};
      return perceive(in, out);
    case core::StageId::kGovernor:
      return govern(in, out);
    case core::StageId::kMap:
      integrate(in, out);
      return check_committed(in, out);
    case core::StageId::kExport:
      return export_map(in, out);
    case core::StageId::kPlanner:
      plan(in, out);
      for (std::size_t i = 0; i < core::kStageCount; ++i) {
        const auto stage = static_cast<core::StageId>(i);
        // The straight way alone is a few cells: too little to tell how fast the processor is.
        if (stage == core::StageId::kPlanner && out.decision.open) continue;
        governor_.observe(stage, out.decision.predicted_s[i], seconds(out.cost[i]));
      }
      failures_ = out.smoother_status == Status::kOk || in.climbing ? 0 : failures_ + 1;
      return;
    case core::StageId::kSmoother:
      return;
  }
}

}  // namespace roborun::flight
