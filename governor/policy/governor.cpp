#include "governor/policy/governor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace roborun::governor {
namespace {

// RoboRun Table "Knob values": static column and upper ends of the dynamic one.
constexpr double kStaticV0_m3 = 46e3;
constexpr double kStaticV1_m3 = 150e3;
constexpr double kStaticV2_m3 = 150e3;
constexpr double kAwareV0_m3 = 60e3;
constexpr double kAwareV1_m3 = 1e6;
constexpr double kStaticSpeed_mps = 0.5;

constexpr std::array<core::StageId, 3> kKnobStage{core::StageId::kMap, core::StageId::kExport,
                                                  core::StageId::kPlanner};

constexpr std::size_t index(core::StageId id) noexcept { return static_cast<std::size_t>(id); }

}  // namespace

const char* to_string(Design design) noexcept {
  switch (design) {
    case Design::kAware:
      return "aware";
    case Design::kStatic:
      return "static";
    case Design::kStaticFair:
      return "static-fair";
  }
  return "unknown";
}

const char* to_string(BudgetSource source) noexcept {
  switch (source) {
    case BudgetSource::kTrajectory:
      return "trajectory";
    case BudgetSource::kVisibility:
      return "visibility";
    case BudgetSource::kShortest:
      return "shortest";
    case BudgetSource::kLongest:
      return "longest";
    case BudgetSource::kFailures:
      return "failures";
    case BudgetSource::kFixed:
      return "fixed";
  }
  return "unknown";
}

Governor::Governor(const GovernorConfig& config) noexcept : config_(config) {
  switch (config.design) {
    case Design::kAware:
      v_max_mps_ = config.v_max_mps;
      break;
    case Design::kStatic:
      v_max_mps_ = kStaticSpeed_mps;
      break;
    case Design::kStaticFair: {
      const double reach_m3 = config.sensor_volume_max_m3;
      const double latency_s =
          config.point_cloud_s + config.smoother_s + predicted_s(0, 0, std::min(kStaticV0_m3, reach_m3)) +
          predicted_s(1, 0, kStaticV1_m3) + predicted_s(2, 0, std::min(kStaticV2_m3, reach_m3));
      v_max_mps_ = std::min(config.v_max_mps, safe_speed_mps(config.design_visibility_m, latency_s));
      break;
    }
  }
}

double Governor::predicted_s(std::size_t stage, int level, double volume_m3) const noexcept {
  return scale(kKnobStage[stage]) * config_.model[stage].latency_s(level, volume_m3);
}

double Governor::overhead_s() const noexcept {
  return scale(core::StageId::kPointCloud) * config_.point_cloud_s +
         scale(core::StageId::kGovernor) * config_.governor_s +
         scale(core::StageId::kSmoother) * config_.smoother_s;
}

void Governor::observe(core::StageId id, double predicted_s, double spent_s) noexcept {
  scale_[index(id)].observe(predicted_s / scale(id), spent_s);
}

double Governor::safe_speed_mps(double visible_m, double latency_s) const noexcept {
  const StoppingModel& m = config_.stopping;
  const double b = m.linear_s + config_.policy.decisions_per_budget * latency_s;
  const double c = m.constant_m - visible_m;
  if (!(c < 0.0)) return 0.0;  // NaN included
  if (!(m.quadratic_s2pm > 0.0)) return -c / b;
  return (std::sqrt(b * b - 4.0 * m.quadratic_s2pm * c) - b) / (2.0 * m.quadratic_s2pm);
}

Nanos Governor::whole_frames(double time_s) const noexcept {
  const Nanos time = from_seconds(time_s);
  return std::max(config_.minor_frame * (time / config_.minor_frame), config_.minor_frame);
}

void Governor::fill_prediction(Decision& d) const noexcept {
  d.predicted_s[index(core::StageId::kPointCloud)] =
      scale(core::StageId::kPointCloud) * config_.point_cloud_s;
  d.predicted_s[index(core::StageId::kGovernor)] = scale(core::StageId::kGovernor) * config_.governor_s;
  d.predicted_s[index(core::StageId::kMap)] = predicted_s(0, d.solution.p0_level, d.solution.v0_m3);
  d.predicted_s[index(core::StageId::kExport)] = predicted_s(1, d.solution.p1_level, d.solution.v1_m3);
  d.predicted_s[index(core::StageId::kPlanner)] = predicted_s(2, d.solution.p1_level, d.solution.v2_m3);
  d.predicted_s[index(core::StageId::kSmoother)] = scale(core::StageId::kSmoother) * config_.smoother_s;
}

Decision Governor::decide_static(const SpaceProfile& profile) const noexcept {
  Decision d;
  d.source = BudgetSource::kFixed;
  d.solution.status = Status::kOk;
  // The knobs are fixed; the time that they take is bounded by what there is to process.
  d.solution.v0_m3 = std::min(kStaticV0_m3, profile.sensor_volume_m3);
  d.solution.v1_m3 = std::min(kStaticV1_m3, profile.map_volume_m3);
  d.solution.v2_m3 = std::min(kStaticV2_m3, config_.sensor_volume_max_m3);
  fill_prediction(d);
  double total_s = 0.0;
  for (const double s : d.predicted_s) total_s += s;
  d.point = {0,
             0,
             kStaticV0_m3,
             kStaticV1_m3,
             kStaticV2_m3,
             whole_frames(total_s * (1.0 + config_.policy.reserve_ratio) + seconds(config_.minor_frame)),
             v_max_mps_};
  d.solution.latency_s = total_s;
  d.time_budget = d.point.deadline;
  return d;
}

Decision Governor::decide(const SpaceProfile& profile, const Situation& situation) noexcept {
  if (config_.design != Design::kAware) return decide_static(profile);
  const Policy& policy = config_.policy;
  Decision d;

  // 1. How precisely must we look? An obstacle grows by up to a cell, and so does the vehicle's box, on
  // either side of a gap: of width g it is passable for certain on cells of (g - width) / 4.
  const double gap_cell_m = 0.25 * (profile.gap_average_m - config_.vehicle_width_m);
  d.demand_m = std::fmin(gap_cell_m, profile.closest_obstacle_m / policy.cells_to_obstacle);
  int coarsest = std::min(coarsest_level_within(d.demand_m), config_.coarsest_level);
  coarsest = std::min(coarsest, last_level_ + policy.coarser_levels_per_decision);
  const int extra = std::max(situation.failures - policy.failures_until_finer + 1, 0);
  coarsest = std::max(coarsest - extra, 0);
  const bool near_goal = situation.distance_to_goal_m < policy.near_goal_m;
  if (near_goal || situation.surveying) coarsest = std::min(coarsest, 1);
  const double overhead = overhead_s();
  const double see_m3 = profile.sensor_volume_m3 > 0.0 ? profile.sensor_volume_m3 : 0.0;  // NaN: nothing
  const auto needed_s = [&](int level, double share) {
    return (overhead + predicted_s(0, level, share * see_m3) + predicted_s(1, level, share * see_m3) +
            predicted_s(2, level, share * policy.planner_share * see_m3)) *
           (1.0 + policy.reserve_ratio);
  };

  // 2. How long may we think? As long as is safe, but no longer than is useful.
  const BudgetLimits limits{policy.shortest, policy.longest_budget};
  const bool has_outlook = profile.outlook_count > 0;
  d.time_budget =
      has_outlook
          ? trajectory_budget({profile.outlook.data(), profile.outlook_count}, config_.stopping, limits)
          : time_budget(profile.closest_unknown_m, profile.speed_mps, config_.stopping, limits);
  d.source = has_outlook ? BudgetSource::kTrajectory : BudgetSource::kVisibility;
  if (situation.surveying) d.time_budget = policy.longest_budget;
  double deadline_s = seconds(d.time_budget) / policy.decisions_per_budget;
  const Nanos longest = situation.motion ? policy.shortest : policy.longest;
  const double useful_s = std::max(seconds(longest), needed_s(coarsest, 1.0));
  if (deadline_s >= useful_s) {
    deadline_s = useful_s;
    d.source = extra > 0 ? BudgetSource::kFailures : BudgetSource::kLongest;
  }
  if (deadline_s < seconds(policy.shortest)) {
    deadline_s = seconds(policy.shortest);
    d.source = BudgetSource::kShortest;
  }

  // Time wins over precision: the deadline belongs to physics. Coarser until all that is in view can be
  // processed in time.
  while (coarsest < config_.coarsest_level && needed_s(coarsest, 1.0) > deadline_s) ++coarsest;
  // Finer than asked for only where perception leaves the planner its share; otherwise perception is cut to
  // it.
  int finest = 0;
  while (finest < coarsest && needed_s(finest, 1.0) > deadline_s) ++finest;
  const double none_s = needed_s(coarsest, 0.0);
  const double all_s = needed_s(coarsest, 1.0);
  const double share = all_s > deadline_s ? std::max(deadline_s - none_s, 0.0) / (all_s - none_s) : 1.0;

  // 3. The operating point. In the open there is nothing to search for.
  d.open = situation.straight && situation.failures == 0 && !situation.motion &&
           profile.obstacle_ahead_m == std::numeric_limits<double>::infinity();
  const double share_m3 = policy.planner_share * see_m3;
  const double plan_m3 = d.open ? std::min(policy.open_planner_m3, share_m3) : share_m3;
  SolverProblem& p = d.problem;
  p.delta_d_s = deadline_s * (1.0 - policy.reserve_ratio) - overhead;
  p.model = config_.model;
  for (std::size_t i = 0; i < 3; ++i) {
    for (double& s : p.model[i].fixed_s) s *= scale(kKnobStage[i]);
    for (double& s : p.model[i].slope_s_per_m3) s *= scale(kKnobStage[i]);
  }
  p.g_min_m = cell_size_m(finest);
  p.g_avg_m = cell_size_m(coarsest);
  p.d_obs_m = std::fmax(profile.closest_obstacle_m, cell_size_m(coarsest));
  p.p1_coarsest_level = coarsest;
  p.v_sensor_m3 = see_m3;
  p.v_map_m3 = profile.map_volume_m3 > 0.0 ? profile.map_volume_m3 : 0.0;
  p.v0_max_m3 = std::min(kAwareV0_m3, share * see_m3);
  p.v1_max_m3 = kAwareV1_m3;
  p.v2_max_m3 = plan_m3;
  d.solution = solve(p);
  fill_prediction(d);
  last_level_ = d.solution.p0_level;

  // Infeasible: the quickest decision there is; until it is there the vehicle lives on its braking tail.
  if (d.solution.status != Status::kOk) {
    d.solution.v0_m3 = see_m3;
    d.solution.v1_m3 = d.solution.v0_m3;
    d.solution.v2_m3 = plan_m3;
    fill_prediction(d);
    double total_s = 0.0;
    for (const double stage_s : d.predicted_s) total_s += stage_s;
    deadline_s = std::max(deadline_s, total_s * (1.0 + policy.reserve_ratio) + seconds(config_.minor_frame));
  }

  // 4. How fast may the next trajectory be? As fast as it can still stop inside known free space, which the
  // smoother sees to.
  double speed_mps = v_max_mps_;
  if (near_goal) speed_mps = std::min(speed_mps, policy.near_goal_speed_mps);
  if (situation.motion) speed_mps = std::min(speed_mps, policy.motion_speed_mps);

  d.point = {d.solution.p0_level, d.solution.p1_level,      d.solution.v0_m3, d.solution.v1_m3,
             d.solution.v2_m3,    whole_frames(deadline_s), speed_mps};
  return d;
}

}  // namespace roborun::governor
