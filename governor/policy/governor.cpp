#include "governor/policy/governor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/range.hpp"
#include "firmware_if/assert.hpp"

namespace roborun::governor {
namespace {

// RoboRun Table "Knob values": static column and upper ends of the dynamic one.
constexpr double kStaticV0_m3 = 46e3;
constexpr double kStaticV1_m3 = 150e3;
constexpr double kStaticV2_m3 = 150e3;
constexpr double kAwareV0_m3 = 60e3;
constexpr double kAwareV1_m3 = 1e6;
constexpr double kRemembered_m3 = 6e3;
constexpr double kAll_m3 = std::numeric_limits<double>::infinity();
constexpr double kStaticSpeed_mps = 0.5;
constexpr double kTight =
    3.0;  // published cells: where the space asks for less than that, a narrow way is one

double sum(const core::StageArray<double>& stage_s) noexcept {
  double total_s = 0.0;
  for (const double s : stage_s) total_s += s;
  return total_s;
}

}  // namespace

/// What one call of decide() works on.
struct Governor::Task {
  const SpaceProfile& profile;
  const Situation& situation;
  double overhead_s;
  double see_m3;     ///< What the images of this decision see.
  double around_m3;  ///< What plans are checked in: that, or as much of the map around the vehicle.
};

/// The levels of p0 that the solver may choose from, and what there is time for.
struct Governor::Precision {
  int finest, coarsest;
  double share;  ///< Of what is in view, what can be perceived before the deadline. [0, 1]
};

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

const char* to_string(SpeedSource source) noexcept {
  switch (source) {
    case SpeedSource::kFile:
      return "file";
    case SpeedSource::kEnergy:
      return "energy";
    case SpeedSource::kGoal:
      return "goal";
    case SpeedSource::kMotion:
      return "motion";
    case SpeedSource::kThin:
      return "thin";
    case SpeedSource::kFixed:
      return "fixed";
    case SpeedSource::kPolicy:
      return "policy";
  }
  return "unknown";
}

const char* to_string(Aim aim) noexcept { return aim == Aim::kEnergy ? "energy" : "time"; }

Status Policy::validate() const noexcept {
  const bool times_ok = shortest > Nanos{0} && longest >= shortest && longest_budget >= longest &&
                        shortest_in_motion > Nanos{0} && fine_within > Nanos{0};
  const bool precision_ok = core::within(failures_until_finer, 1, 100) &&
                            core::within(narrow_tries, 0, 100) &&
                            core::within(coarser_levels_per_decision, 1, kPrecisionLevels) &&
                            core::within(cells_to_obstacle, 1.0, 100.0);
  const bool volume_ok = core::above(planner_share, 0.0, 1.0) && core::above(fine_volume_m3, 0.0, 1e9);
  const bool speed_ok = core::within(near_goal_m, 0.0, 1000.0) &&
                        core::above(near_goal_speed_mps, 0.0, 30.0) &&
                        core::above(motion_speed_mps, 0.0, 30.0) && core::above(thin_speed_mps, 0.0, 30.0);
  const bool ok = times_ok && precision_ok && volume_ok && speed_ok &&
                  core::within(decisions_per_budget, 1.0, 10.0) && core::within(reserve_ratio, 0.0, 0.5);
  return ok ? Status::kOk : Status::kInvalidArgument;
}

Status GovernorConfig::validate() const noexcept {
  bool ok = policy.validate() == Status::kOk && stopping.validate() == Status::kOk;
  for (const LatencyModel& m : model) ok = ok && m.validate() == Status::kOk;
  for (const double fixed_s : {point_cloud_s, governor_s, smoother_s})
    ok = ok && core::within(fixed_s, 0.0, 1e6);
  ok = ok && core::above(v_max_mps, 0.0, 30.0) && core::above(vehicle_width_m, 0.0, 20.0) &&
       cheapest_mps > 0.0 && core::above(thin_step_m, 0.0, 1e3) &&
       core::above(sensor_volume_max_m3, 0.0, 1e9) && core::within(lattice.finest_m, 0.05, 0.3) &&
       core::within(coarsest_level, 0, kPrecisionLevels - 1) &&
       core::above(design_visibility_m, 0.0, 1000.0) && minor_frame > Nanos{0};
  return ok ? Status::kOk : Status::kInvalidArgument;
}

void Governor::configure(const GovernorConfig& config) noexcept {
  ROBORUN_ASSERT(config.validate() == Status::kOk);
  config_ = config;
  switch (config.design) {
    case Design::kAware:
      v_max_mps_ = std::min(config.v_max_mps, config.cheapest_mps);
      break;
    case Design::kStatic:
      v_max_mps_ = kStaticSpeed_mps;
      break;
    case Design::kStaticFair: {
      const double reach_m3 = config.sensor_volume_max_m3;
      const double latency_s = config.point_cloud_s + config.smoother_s +
                               predicted_s(Knob::kPerceive, 0, std::min(kStaticV0_m3, reach_m3)) +
                               predicted_s(Knob::kExport, 0, kStaticV1_m3) +
                               predicted_s(Knob::kPlan, 0, std::min(kStaticV2_m3, reach_m3));
      v_max_mps_ = std::min(config.v_max_mps, safe_speed_mps(config.design_visibility_m, latency_s));
      break;
    }
  }
}

double Governor::predicted_s(Knob knob, int level, double volume_m3) const noexcept {
  return scale(stage_of(knob)) * config_.model[knob].latency_s(level, volume_m3);
}

double Governor::overhead_s() const noexcept {
  return scale(core::StageId::kPointCloud) * config_.point_cloud_s +
         scale(core::StageId::kGovernor) * config_.governor_s +
         scale(core::StageId::kSmoother) * config_.smoother_s;
}

void Governor::observe(core::StageId id, double predicted_s, double spent_s) noexcept {
  scale_[id].observe(predicted_s / scale(id), spent_s);
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
  d.predicted_s[core::StageId::kPointCloud] = scale(core::StageId::kPointCloud) * config_.point_cloud_s;
  d.predicted_s[core::StageId::kGovernor] = scale(core::StageId::kGovernor) * config_.governor_s;
  d.predicted_s[core::StageId::kMap] = predicted_s(Knob::kPerceive, d.solution.p0_level, d.solution.v0_m3);
  d.predicted_s[core::StageId::kExport] = predicted_s(Knob::kExport, d.solution.p1_level, d.solution.v1_m3);
  d.predicted_s[core::StageId::kPlanner] = predicted_s(Knob::kPlan, d.solution.p1_level, d.solution.v2_m3);
  d.predicted_s[core::StageId::kSmoother] = scale(core::StageId::kSmoother) * config_.smoother_s;
}

Decision Governor::decide_static(const SpaceProfile& profile) const noexcept {
  Decision d;
  d.source = BudgetSource::kFixed;
  d.speed_source = SpeedSource::kFixed;
  d.solution.status = Status::kOk;
  // The knobs are fixed; the time that they take is bounded by what there is to process.
  d.solution.v0_m3 = std::min(kStaticV0_m3, profile.sensor_volume_m3);
  d.solution.v1_m3 = std::min(kStaticV1_m3, profile.map_volume_m3);
  d.solution.v2_m3 = std::min(kStaticV2_m3, config_.sensor_volume_max_m3);
  fill_prediction(d);
  const double total_s = sum(d.predicted_s);
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

int Governor::finer_levels(const Situation& situation) const noexcept {
  return std::max(situation.failures - config_.policy.failures_until_finer + 1, 0);
}

bool Governor::near_goal(const Situation& situation) const noexcept {
  return situation.distance_to_goal_m < config_.policy.near_goal_m;
}

/// Eq. 4 summed over the stages, with no more of each volume than this (the planner explores only its own share), and the reserve
/// on top. What is exported lies around the vehicle, on all sides: of one camera's view that alone would end halfway to what it sees.
double Governor::needed_s(const Task& task, int level, double most_m3) const noexcept {
  const double see_m3 = std::fmin(task.see_m3, most_m3);
  return (task.overhead_s + predicted_s(Knob::kPerceive, level, see_m3) +
          predicted_s(Knob::kExport, level, std::fmin(task.around_m3, most_m3)) +
          predicted_s(Knob::kPlan, level, config_.policy.planner_share * see_m3)) *
         (1.0 + config_.policy.reserve_ratio);
}

/// All that is in view; of cells finer than the published ones, what is nearest.
double Governor::least_s(const Task& task, int level) const noexcept {
  return needed_s(task, level, level < published_level() ? config_.policy.fine_volume_m3 : kAll_m3);
}

/// Step 1: how precisely must we look? An obstacle grows by up to a cell, and so does the vehicle's box, on
/// either side of a gap: a gap of width g loses up to four cells, so it is passable for certain on cells of
///   (g - width) / 4
/// and `cells_to_obstacle` cells must fit between the vehicle and the nearest obstacle. Then the policy:
/// coarser only step by step, finer than 0.3 m only after failures, on narrow ways, and one level where `longest` has time for
/// it, or `fine_within` and the space asks for less than 0.6 m; at most 0.6 m near the goal and on the climb. Failures ask for one level finer
/// each. Where the finest cells take more than twice `fine_within`, they are for ways that are narrow for what stands
/// there, not for holes of the cameras, and failures begin anew after two at the finest, one with each radius of the planner: where
/// precision was not what lacked, quick looks fill holes sooner.
int Governor::asked_level(const Task& task, Decision& d) const noexcept {
  const Policy& policy = config_.policy;
  const double gap_cell_m = 0.25 * (task.profile.gap_average_m - config_.vehicle_width_m);
  d.demand_m = std::fmin(gap_cell_m, task.profile.closest_obstacle_m / policy.cells_to_obstacle);
  int level = std::min(config_.lattice.coarsest_level_within(d.demand_m), config_.coarsest_level);
  level = std::min(level, last_level_ + policy.coarser_levels_per_decision);
  const int fine = std::max(published_level() - 1, 0);
  const Nanos within = d.demand_m < 2.0 * kPublishedCell_m ? policy.fine_within : policy.longest;
  const bool costs_nothing = least_s(task, fine) <= seconds(within);
  level = costs_nothing ? fine : std::max(level, published_level());
  const int finer = finer_levels(task.situation);
  const bool cheap = least_s(task, 0) <= 2.0 * seconds(policy.fine_within);
  const bool tight = d.demand_m < kTight * kPublishedCell_m && task.situation.failures < policy.narrow_tries;
  if (task.situation.narrow && (cheap || tight))
    level = 0;
  else
    level -= std::min(cheap ? finer : finer % (level + 2), level);
  if (near_goal(task.situation) || task.situation.surveying)
    level = std::min(level, config_.lattice.coarsest_level_within(2.0 * kPublishedCell_m));
  return level;
}

/// Step 2: how long may we think? As long as is safe, but no longer than is useful:
///   safe     the time budget of the trajectory (Algorithm 1; Eq. 1 without one) / decisions_per_budget
///   useful   `longest`, or what the precision that the space asks for takes, if that is more
/// and never shorter than `shortest`, nor than what that precision takes if it is at most `fine_within`: in coarser cells nothing may be
/// found, and each trajectory ends in a stop that is known to be free.
double Governor::deadline_s(const Task& task, int asked_level, Decision& d) const noexcept {
  const Policy& policy = config_.policy;
  const SpaceProfile& profile = task.profile;
  const BudgetLimits limits{policy.shortest, policy.longest_budget};
  if (profile.outlook_count > 0) {
    d.time_budget =
        trajectory_budget({profile.outlook.data(), profile.outlook_count}, config_.stopping, limits);
    d.source = BudgetSource::kTrajectory;
  } else {
    d.time_budget = time_budget(profile.closest_unknown_m, profile.speed_mps, config_.stopping, limits);
    d.source = BudgetSource::kVisibility;
  }
  if (task.situation.surveying) d.time_budget = policy.longest_budget;
  double deadline_s = seconds(d.time_budget) / policy.decisions_per_budget;
  const Nanos shortest =
      task.situation.motion ? std::max(policy.shortest, policy.shortest_in_motion) : policy.shortest;
  const Nanos longest = task.situation.motion ? shortest : policy.longest;
  const double enough_s = least_s(task, asked_level);
  const double useful_s = std::max(seconds(longest), enough_s);
  if (deadline_s >= useful_s) {
    deadline_s = useful_s;
    d.source = finer_levels(task.situation) > 0 ? BudgetSource::kFailures : BudgetSource::kLongest;
  }
  const double shortest_s =
      std::max(seconds(shortest), enough_s <= seconds(policy.fine_within) ? enough_s : 0.0);
  if (deadline_s < shortest_s) {
    deadline_s = shortest_s;
    d.source = BudgetSource::kShortest;
  }
  return deadline_s;
}

/// Step 3: time wins over precision, for the deadline belongs to physics.
///  a. Coarser than asked for, until all that is in view can be processed in time.
///  b. Finer than asked for only where perception leaves the planner its share.
///  c. If even the coarsest level is too slow, only a share x of the view is perceived. Latency is linear in
///     volume, so none + x (all - none) = deadline gives x = (deadline - none) / (all - none).
Governor::Precision Governor::in_time(const Task& task, int asked_level, double deadline_s) const noexcept {
  // Time alone is no reason for cells finer than the published ones.
  Precision result{0, asked_level, 1.0};
  while (result.coarsest < config_.coarsest_level && least_s(task, result.coarsest) > deadline_s)
    ++result.coarsest;
  result.finest = std::min(asked_level, published_level());
  while (result.finest < result.coarsest && needed_s(task, result.finest, kAll_m3) > deadline_s)
    ++result.finest;
  const double none_s = needed_s(task, result.coarsest, 0.0);
  const double all_s = needed_s(task, result.coarsest, kAll_m3);
  if (all_s > deadline_s) result.share = std::max(deadline_s - none_s, 0.0) / (all_s - none_s);
  return result;
}

/// Step 4: the instance of Eq. 3. The reserve and the stages without knobs come off the deadline; the models
/// are scaled by what the stages really took of late.
SolverProblem Governor::problem_of(const Task& task, const Precision& precision, double deadline_s,
                                   double plan_m3) const noexcept {
  const SpaceProfile& profile = task.profile;
  SolverProblem p;
  p.p_min_m = config_.lattice.finest_m;
  p.delta_d_s = deadline_s * (1.0 - config_.policy.reserve_ratio) - task.overhead_s;
  for (const Knob knob : kKnobs) p.model[knob] = slower(config_.model[knob], scale(stage_of(knob)));
  p.g_min_m = config_.lattice.cell_size_m(precision.finest);
  p.g_avg_m = config_.lattice.cell_size_m(precision.coarsest);
  p.d_obs_m = std::fmax(profile.closest_obstacle_m, config_.lattice.cell_size_m(precision.coarsest));
  p.p1_coarsest_level = precision.coarsest;
  // A way back leads through what no camera sees now: the planner gets so much of what the map holds all the same.
  p.v_sensor_m3 = std::fmax(task.see_m3, kRemembered_m3);
  p.v_map_m3 = profile.map_volume_m3 > 0.0 ? profile.map_volume_m3 : 0.0;
  p.v0_max_m3 = std::min(kAwareV0_m3, precision.share * task.see_m3);
  p.v1_max_m3 = kAwareV1_m3;
  p.v2_max_m3 = plan_m3;
  return p;
}

/// Step 6: how fast may the next trajectory be? As fast as it can still stop inside known free space, which
/// the smoother sees to. Among thin things no farther from one decision's images to the next one's than thin_step_m.
Governor::SpeedLimit Governor::speed_limit(const Situation& situation, double deadline_s) const noexcept {
  const Policy& policy = config_.policy;
  SpeedLimit limit{config_.v_max_mps, SpeedSource::kFile};
  const auto at_most = [&limit](double speed_mps, SpeedSource source) {
    if (speed_mps < limit.speed_mps) limit = {speed_mps, source};
  };
  at_most(config_.cheapest_mps, SpeedSource::kEnergy);
  if (near_goal(situation)) at_most(policy.near_goal_speed_mps, SpeedSource::kGoal);
  if (situation.motion) at_most(policy.motion_speed_mps, SpeedSource::kMotion);
  if (situation.thin)
    at_most(std::max(config_.thin_step_m / deadline_s, policy.thin_speed_mps), SpeedSource::kThin);
  return limit;
}

Decision Governor::decide(const SpaceProfile& profile, const Situation& situation) noexcept {
  if (config_.design != Design::kAware) return decide_static(profile);
  const Policy& policy = config_.policy;
  const double see_m3 = profile.sensor_volume_m3 > 0.0 ? profile.sensor_volume_m3 : 0.0;  // NaN: nothing
  const double map_m3 = profile.map_volume_m3 > 0.0 ? profile.map_volume_m3 : 0.0;
  const double around_m3 = std::fmax(see_m3, std::fmin(kRemembered_m3, map_m3));
  const Task task{profile, situation, overhead_s(), see_m3, around_m3};
  Decision d;
  const int asked = asked_level(task, d);                    // 1
  double time_s = deadline_s(task, asked, d);                // 2
  const Precision precision = in_time(task, asked, time_s);  // 3

  const double plan_m3 = policy.planner_share * see_m3;  // 4
  d.problem = problem_of(task, precision, time_s, plan_m3);
  d.solution = solve(d.problem);
  fill_prediction(d);
  last_level_ = d.solution.p0_level;

  // 5. Infeasible: the quickest decision there is; until it is there the vehicle lives on its braking tail.
  if (d.solution.status != Status::kOk) {
    d.solution.v0_m3 = see_m3;
    d.solution.v1_m3 = around_m3;
    d.solution.v2_m3 = plan_m3;
    fill_prediction(d);
    time_s =
        std::max(time_s, sum(d.predicted_s) * (1.0 + policy.reserve_ratio) + seconds(config_.minor_frame));
  }
  const SpeedLimit limit = speed_limit(situation, time_s);
  d.speed_source = limit.source;
  d.point = {d.solution.p0_level, d.solution.p1_level,  d.solution.v0_m3, d.solution.v1_m3,
             d.solution.v2_m3,    whole_frames(time_s), limit.speed_mps};
  return d;
}

}  // namespace roborun::governor
