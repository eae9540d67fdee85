#include "platform/flight/decision_pipeline.hpp"

#include <algorithm>
#include <cmath>

#include "core/memory/static_vector.hpp"
#include "platform/flight/flight_config.hpp"
#include "platform/flight/rest_of_budget.hpp"
#include "stages/perception/polled_view.hpp"
#include "stages/planning/fenced_view.hpp"
#include "stages/planning/way_out.hpp"

namespace roborun::flight {
namespace {

constexpr double kTrajectoryStep_s = 0.5;  // of the points that order the space by distance
constexpr std::size_t kTrajectoryPoints = 32;
constexpr double kCornerRoom_m = 0.25;
constexpr double kAtGoal_m = 0.3;
constexpr double kTooFast = 1.5;
constexpr double kForgets = 0.9;  // what the planner took, from one decision to the next
/// Of the vehicle's speed: what known way beyond a trajectory's end is flown at, on the average, when arrivals are compared.
constexpr double kBeyond = 0.5;

}  // namespace

Vector3 assumed_free_half_m(const VehicleModel& vehicle, bool sees_all_around, double level_view_ratio,
                            double too_near_m) noexcept {
  constexpr double kMost_m = 5.0;
  if (sees_all_around && too_near_m == 0.0) return Vector3::Zero();
  // What has to be free around the start of a plan, and as far as the sensors see less of it than that while the
  // vehicle turns: at a distance of d they see d * ratio up and down.
  const double room_m = planned_radius_m(vehicle) + kCornerRoom_m + kPublishedCell_m;
  const double half_m = std::max(room_m, std::min(too_near_m + kPublishedCell_m, kMost_m));
  if (sees_all_around) return Vector3::Constant(half_m);
  const double reach_m = std::min((half_m + kPublishedCell_m) / level_view_ratio + kPublishedCell_m, kMost_m);
  return {std::max(reach_m, half_m), std::max(reach_m, half_m), half_m};
}

class DecisionPipeline::Permitted {
 public:
  explicit Permitted(const DecisionPipeline& p) noexcept
      : map_(p.map_.view()), fenced_(map_, p.config_.fence), is_fenced_(!p.config_.fence.empty()) {}
  [[nodiscard]] const stages::MapView& view() const noexcept {
    return is_fenced_ ? static_cast<const stages::MapView&>(fenced_) : map_;
  }

 private:
  const stages::MapView& map_;
  stages::FencedView fenced_;
  bool is_fenced_;
};

class DecisionPipeline::Known {
 public:
  Known(const DecisionPipeline& p, const DecisionInput& in) noexcept
      : permitted_(p),
        finest_(permitted_.view()),
        standing_(finest_, Aabb::around(in.committed->at(in.now).p_W, p.config_.vehicle.radius_m)),
        leaves_(in.committed->start_time == p.leaves_at_) {}
  [[nodiscard]] const stages::MapView& view() const noexcept {
    return leaves_ ? static_cast<const stages::MapView&>(standing_) : finest_;
  }

 private:
  Permitted permitted_;
  stages::FinestView finest_;
  stages::StandingView standing_;
  bool leaves_;
};

DecisionPipeline::DecisionPipeline(const PipelineConfig& config, core::StageMeter& meter,
                                   governor::DecisionPolicy& policy, stages::PointCloud& cloud,
                                   stages::OccupancyMap& map, stages::Planner& planner,
                                   stages::Smoother& smoother, stages::Ways* ways) noexcept
    : config_(config),
      meter_(meter),
      policy_(policy),
      cloud_(cloud),
      map_(map),
      planner_(planner),
      smoother_(smoother),
      ways_(ways) {
  cloud_.set_height_limits(config.map_bounds_W.min_W.z(), config.map_bounds_W.max_W.z());
}

stages::MotionLimits DecisionPipeline::limits(double speed_mps) const noexcept {
  // With half of its thrust a vehicle has half of the torque, and lags behind what turns it meanwhile: with 4.5 m/s2 mighty was 0.29 m
  // beside its reference, with 3 m/s2 0.10 m, with this 0.08 m (24 m/s3, its hard forest, 100 s).
  constexpr double kVertical_mps2 = 2.0;
  const VehicleModel& v = config_.vehicle;
  const auto [acceleration_mps2, jerk_mps3] = followed_limits(v);
  return {speed_mps,
          acceleration_mps2,
          jerk_mps3,
          v.climb_mps,
          v.descent_mps,
          kVertical_mps2,
          speeding_up_mps2(v, speed_mps)};
}

void DecisionPipeline::charge(core::StageId id, const core::Work& work, DecisionOutput& out) noexcept {
  meter_.charge_to(id);
  out.work[id] = work;
  out.cost[id] = meter_.settle(id, work);
  out.latency += out.cost[id];
}

core::MeteredBudget DecisionPipeline::budget_of(core::StageId id, const DecisionOutput& out) noexcept {
  Nanos rest = out.decision.point.deadline - out.latency;
  for (std::size_t later = static_cast<std::size_t>(id) + 1; later < core::kStageCount; ++later)
    rest -= from_seconds(out.decision.predicted_s[later]);
  // A search ends up to a poll after its budget, and fast smoothers are predicted to take nothing.
  if (id == core::StageId::kPlanner) rest -= config_.minor_frame;
  return {meter_, id, meter_.grant(id, rest)};
}

core::MeteredBudget DecisionPipeline::table_budget_of(core::StageId id) noexcept {
  return {meter_, id, meter_.grant(id, core::slot(core::slot_of(id)).budget)};
}

void DecisionPipeline::perceive(const DecisionInput& in, DecisionOutput& out) noexcept {
  core::MeteredBudget budget = table_budget_of(core::StageId::kPointCloud);
  core::Work work;
  const double r_m = radius_m();
  const Aabb relevant_W{config_.flight_bounds_W.min_W - Vector3::Constant(r_m),
                        config_.flight_bounds_W.max_W + Vector3::Constant(r_m)};
  const stages::SpaceProfilerConfig profiler{.vehicle_width_m = 2.0 * config_.vehicle.radius_m};
  stages::CloudNeed need = stages::needed_points(profiler, in.p_WB, relevant_W);
  need.reach_m = std::fmax(need.reach_m, MotionWatch::kReach_m);
  (void)cloud_.step(in.frames, config_.lattice.coarsest_level_within(kPublishedCell_m), need, budget, work);
  const DepthError error = point_error(in.frames);
  const double stop_m = stopping_model(config_.vehicle).distance_m(in.v_WB.norm());
  motion_.sense({in.now, in.p_WB, in.v_WB, stop_m, relevant_W, error}, cloud_.points(), map_, budget, work);
  bodies_.observe(in.now, in.p_WB, motion_.appeared_W(), error);
  bodies_.follow(in.now, in.p_WB, cloud_.points());
  out.motion = motion_.startled(in.now) || bodies_.near(in.now, in.p_WB, in.v_WB, MotionWatch::kReach_m);
  // Coarse cells are rarely seen whole, nor is the vehicle's own free among trunks: in such cells nothing were visible, the governor
  // would hurry, choose coarser ones, and see as little again.
  const stages::FinestView finest(map_.view());
  (void)profile_space(profiler, cloud_.points(), finest, *in.committed, in.now, in.p_WB, in.v_WB, in.goal_W,
                      relevant_W, is_narrow_ ? slow_radius_m(config_.vehicle) : r_m, out.profile, budget,
                      work);
  out.profile.sensor_volume_m3 = cloud_.seen_volume_m3();
  // What the map will hold once this decision's images are in it.
  out.profile.map_volume_m3 = map_.known_volume_m3() + cloud_.seen_volume_m3();
  charge(core::StageId::kPointCloud, work, out);
}

void DecisionPipeline::govern(const DecisionInput& in, DecisionOutput& out) noexcept {
  out.decision = policy_.decide(out.profile, {failures_, (in.goal_W - in.p_WB).norm(), in.climbing,
                                              out.motion, is_among_thin(in), is_narrow_});
  if (out.decision.predicted_s[core::StageId::kGovernor] > 0.0) charge(core::StageId::kGovernor, {}, out);
}

Vector3 DecisionPipeline::assumed_half_m(const DecisionInput& in) const noexcept {
  const MonotonicTime climbed = in.committed->ends();
  // Decisions that are long may all begin before or after the short hover of the climb: until there is a plan,
  // the vehicle hovers where the climb ended.
  const bool hovers = in.now >= climbed && (in.climbing || !has_planned_);
  if (!hovers) return Vector3::Zero();
  return assumed_free_half_m(config_.vehicle, config_.sees_all_around, config_.level_view_ratio,
                             config_.too_near_m);
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
  const MotionWatch::Places moved_W = motion_.places_W(in.now);
  stages::IntegrationRequest request{in.frames,
                                     point.p0_level,
                                     point.v0_m3,
                                     {trajectory_W.begin(), trajectory_W.size()},
                                     {moved_W.begin(), moved_W.size()}};
  request.assumed_half_m = assumed_half_m(in);
  core::Work work;
  std::size_t first = 0;
  std::uint32_t thin_pixels = 0;
  const std::size_t scans = std::max<std::size_t>(in.scans.size(), 1);
  for (std::size_t i = 0; i < scans; ++i) {
    const std::size_t count = in.scans.empty() ? in.frames.size() : in.scans[i];
    request.frames = in.frames.subspan(first, count);
    request.volume_m3 = point.v0_m3 - work.volume_m3;
    first += count;
    stages::IntegrationResult integrated;
    (void)map_.integrate(request, budget, integrated);
    work.units += integrated.work.units;
    work.volume_m3 += integrated.work.volume_m3;
    work.level = integrated.work.level;
    thin_pixels += integrated.thin_pixels;
  }
  note_thin(in, thin_pixels);
  charge(core::StageId::kMap, work, out);
}

void DecisionPipeline::check_committed(const DecisionInput& in, DecisionOutput& out) noexcept {
  if (in.climbing) return;  // through space that is not known yet
  const Known known(*this, in);
  meter_.charge_to(core::StageId::kPlanner);
  core::MeteredBudget budget = budget_of(core::StageId::kPlanner, out);
  core::Work& work = out.work[core::StageId::kPlanner];
  const stages::PolledView polled(known.view(), budget, work);
  const double from_s = seconds(in.now - in.committed->start_time);
  const double until_s = free_until_s(polled, *in.committed, from_s, config_.vehicle.radius_m, work.units);
  // Where something moves, what is fast now is not flown on until a slower plan is there.
  const bool too_fast = out.motion && in.v_WB.norm() > kTooFast * out.decision.point.speed_limit_mps;
  out.early_stop = std::isinf(until_s) ? stop_before_body(in, too_fast, known.view(), work, out.latency)
                                       : stop_before(in, in.committed->start_time + from_seconds(until_s),
                                                     known.view(), work, out.latency);
}

std::optional<Trajectory> DecisionPipeline::stop_before(const DecisionInput& in, MonotonicTime free_until,
                                                        const stages::MapView& known, core::Work& work,
                                                        Nanos latency) const noexcept {
  const MonotonicTime soonest = in.now + latency + config_.minor_frame;
  const TrajectoryPoint then = in.committed->at(soonest);
  Trajectory stop;
  if (then.v_W.norm() <= kAtRest_mps || brake(then, soonest, stop) != Status::kOk) return std::nullopt;
  const double stop_free_s = free_until_s(known, stop, 0.0, config_.vehicle.radius_m, work.units);
  if (!std::isinf(stop_free_s) && soonest + from_seconds(stop_free_s) < free_until) return std::nullopt;
  return stop;
}

void DecisionPipeline::export_map(const DecisionInput& in, DecisionOutput& out) noexcept {
  const OperatingPoint& point = out.decision.point;
  core::MeteredBudget budget = budget_of(core::StageId::kExport, out);
  core::Work exported;
  (void)map_.export_view({point.p1_level, point.v1_m3, in.p_WB}, budget, exported);
  charge(core::StageId::kExport, exported, out);
}

void DecisionPipeline::search(const DecisionInput& in, double radius_m, DecisionOutput& out) noexcept {
  search_to(in.goal_W, in, radius_m, out);
}

void DecisionPipeline::search_to(const Vector3& goal_W, const DecisionInput& in, double radius_m,
                                 DecisionOutput& out) noexcept {
  const Permitted permitted(*this);
  stages::PlanRequest request;
  request.start_W = draft_.start.p_W;
  request.goal_W = goal_W;
  request.bounds_W = config_.flight_bounds_W;
  request.radius_m = radius_m;
  request.volume_m3 = std::max(out.decision.point.v2_m3 - draft_.planner_work.volume_m3, 0.0);
  request.horizon_m = config_.horizon_m;
  request.kept_W = kept_W_;
  request.ways = ways_known_ && goal_W == in.goal_W ? ways_ : nullptr;
  request.seed = in.seed;
  meter_.charge_to(core::StageId::kPlanner);
  stages::PlanResult planned;
  RestOfBudget rest(*draft_.planner_budget, draft_.planner_work);
  out.planner_status = planner_.plan(request, permitted.view(), rest, planned);
  draft_.planner_work.units += planned.work.units;
  draft_.planner_work.volume_m3 += planned.work.volume_m3;
  kept_W_ = planned.path_W;
}

void DecisionPipeline::fit(core::StageBudget& budget, double radius_m, double speed_mps,
                           DecisionOutput& out) noexcept {
  if (kept_W_.size() < 2) return;
  const Permitted permitted(*this);
  stages::SmoothRequest request;
  request.path_W = {kept_W_.begin(), kept_W_.size()};
  request.start = draft_.start;
  request.start_time = draft_.takes_over;
  request.radius_m = radius_m;
  meter_.charge_to(core::StageId::kSmoother);
  // Of the speed: in small steps first, for in the open a little less is enough, and last at a crawl. The next plan tries a
  // little more than what went.
  constexpr std::array<double, 7> kShares{1.0, 0.95, 0.9, 0.85, 0.75, 0.55, 0.0};
  constexpr double kMore = 1.15, kMore_mps = 0.2;
  const double fastest_mps =
      config_.stops_straight ? std::min(speed_mps, kMore * stopped_mps_ + kMore_mps) : speed_mps;
  for (const double share : kShares) {
    const double tried_mps = std::max(share * fastest_mps, std::min(kCrawl_mps, fastest_mps));
    stages::SmoothResult smoothed;
    request.limits = limits(tried_mps);
    RestOfBudget rest(budget, draft_.smoother_work);
    out.smoother_status = smoother_.smooth(request, permitted.view(), rest, smoothed);
    draft_.smoother_work.units += smoothed.work.units;
    if (out.smoother_status != Status::kOk) return;
    draft_.trajectory = smoothed.trajectory;
    if (!config_.stops_straight) return;
    if (stops_free(draft_.trajectory, draft_.takes_over, out, stages::FinestView(permitted.view()),
                   draft_.smoother_work)) {
      stopped_mps_ = tried_mps;
      return;
    }
  }
  stopped_mps_ = kCrawl_mps;
  out.smoother_status = Status::kNoPath;
}

void DecisionPipeline::plan(const DecisionInput& in, DecisionOutput& out) noexcept {
  draft_.begun = false;
  hasten(in, out);
  draft_.takes_over = in.now + out.decision.point.deadline;
  const MonotonicTime ends = in.committed->ends();
  if (in.climbing && draft_.takes_over < ends) return;
  if (in.now < back_until_) {
    out.planner_status = out.smoother_status = Status::kOk;  // of what is flown
    return;
  }
  draft_.begun = true;
  trail_.note(in.p_WB);
  draft_.start = in.committed->at(draft_.takes_over);
  draft_.planner_work = out.work[core::StageId::kPlanner];
  draft_.smoother_work = {};
  draft_.leaves = draft_.is_narrow = draft_.replaces = draft_.dodges = false;
  draft_.stops = true;
  const Known known(*this, in);
  draft_.committed_until_s =
      free_until_s(known.view(), *in.committed, seconds(in.now - in.committed->start_time),
                   config_.vehicle.radius_m, draft_.planner_work.units);
  draft_.planner_work.level = out.decision.point.p1_level;
  draft_.planner_budget.emplace(budget_of(core::StageId::kPlanner, out));
  remember(in, out);
  // What comes to rest at the goal cannot be improved, and from there no path leads to it.
  const MonotonicTime brakes = in.committed->start_time + from_seconds(in.committed->brake_begin_s);
  draft_.keeps = std::isinf(draft_.committed_until_s) && draft_.takes_over >= brakes &&
                 (in.committed->end_W() - in.goal_W).norm() <= kAtGoal_m;
  if (draft_.keeps) {
    draft_.trajectory = *in.committed;
    kept_W_.clear();
    out.planner_status = out.smoother_status = Status::kOk;
    return;
  }
  // Searches that find nothing may take all time and volume that there are: every other one begins with the least room.
  const double least_m = std::min(slow_radius_m(config_.vehicle), radius_m());
  const bool has_narrower = least_m < radius_m();
  const bool tries_least = failures_ % 2 == 1 && (may_squeeze() || !has_narrower);
  draft_.is_narrow = tries_least && has_narrower;
  search(in, tries_least ? least_m : radius_m() + kCornerRoom_m, out);
}

void DecisionPipeline::remember(const DecisionInput& in, DecisionOutput& out) noexcept {
  ways_known_ = false;
  if (ways_ == nullptr) return;
  core::Work work;
  Status status =
      ways_->look(map_.view(), {in.now, in.p_WB, config_.horizon_m + 1.0}, *draft_.planner_budget, work);
  if (status == Status::kOk) status = ways_->solve(draft_.start.p_W, in.goal_W, *draft_.planner_budget, work);
  ways_known_ = status == Status::kOk;
  out.ways_status = status;
  if (ways_known_) out.way_m = ways_->to_goal_m(draft_.start.p_W);
  draft_.planner_work.units += work.units;
}

double DecisionPipeline::arrival_s(const Trajectory& trajectory, const DecisionInput& in) const noexcept {
  const double straight_m = (in.goal_W - trajectory.end_W()).norm();
  double rest_m = stages::kUnknownWeight * straight_m;
  // The memory may have no place at the goal itself.
  if (ways_known_ && straight_m > kAtGoal_m) rest_m = std::fmin(ways_->to_goal_m(trajectory.end_W()), 1e6);
  return seconds(trajectory.start_time - in.now) + trajectory.duration_s() +
         rest_m / (kBeyond * config_.vehicle.speed_mps);
}

void DecisionPipeline::smooth(const DecisionInput& in, DecisionOutput& out) noexcept {
  if (draft_.begun) {
    core::MeteredBudget budget = table_budget_of(core::StageId::kSmoother);
    if (!draft_.keeps) find_trajectory(in, budget, out);
    if (config_.turns) look_on(in, budget, out);
    go_back(in, budget, out);
    give_way(in, budget, out);
    if (config_.stops_straight && !in.climbing) slow_down(in, Known(*this, in).view(), budget, out);
    charge(core::StageId::kPlanner, draft_.planner_work, out);
    double& searched_s = searched_s_[static_cast<std::size_t>(out.decision.point.p1_level)];
    searched_s = std::max(seconds(out.cost[core::StageId::kPlanner]), kForgets * searched_s);
    charge(core::StageId::kSmoother, draft_.smoother_work, out);
    choose(in, out);
  }
  out.gaze_target = gaze_target_;
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    const auto stage = static_cast<core::StageId>(i);
    policy_.observe(stage, out.decision.predicted_s[i], seconds(out.cost[i]));
  }
  const bool is_led_on = out.smoother_status == Status::kOk && !draft_.leaves;
  failures_ = is_led_on || in.climbing ? 0 : failures_ + 1;
}

void DecisionPipeline::fit_narrow(core::StageBudget& budget, DecisionOutput& out) noexcept {
  const VehicleModel& vehicle = config_.vehicle;
  if (out.planner_status == Status::kStartBlocked) return leave(slow_radius_m(vehicle), budget, out);
  fit(budget, slow_radius_m(vehicle), std::min(out.decision.point.speed_limit_mps, vehicle.slow_speed_mps),
      out);
  draft_.is_narrow = out.smoother_status == Status::kOk;
}

void DecisionPipeline::find_trajectory(const DecisionInput& in, core::StageBudget& budget,
                                       DecisionOutput& out) noexcept {
  const double speed_mps = out.decision.point.speed_limit_mps;
  const bool may_be_narrow = may_squeeze(), was_narrow = draft_.is_narrow;
  const bool may_go_narrower = may_be_narrow && !was_narrow;
  const auto is_found = [&out] { return out.smoother_status == Status::kOk; };
  // First with room for the smoother to cut corners, then as tight as the vehicle can fly: too tight for
  // extra room is no reason to flee. Where it is narrower still, slowly.
  if (was_narrow) {
    fit_narrow(budget, out);
  } else if (out.planner_status != Status::kStartBlocked) {
    fit(budget, radius_m(), speed_mps, out);
  }
  if (is_found()) {
    if (may_go_narrower) squeeze_on(in, budget, out);
    return;
  }
  search(in, radius_m(), out);
  if (out.planner_status != Status::kStartBlocked)
    fit(budget, radius_m(), speed_mps, out);
  else if (!may_be_narrow)
    leave(radius_m(), budget, out);
  if (!may_go_narrower) return;
  if (is_found()) return squeeze_on(in, budget, out);
  search(in, slow_radius_m(config_.vehicle), out);
  fit_narrow(budget, out);
}

bool DecisionPipeline::is_kept(const DecisionInput& in, const DecisionOutput& out) const noexcept {
  const MonotonicTime brakes = in.committed->start_time + from_seconds(in.committed->brake_begin_s);
  return !draft_.replaces && draft_.start.v_W.norm() < 1.1 * out.decision.point.speed_limit_mps &&
         draft_.takes_over + out.decision.point.deadline < brakes &&
         arrival_s(*in.committed, in) <= arrival_s(draft_.trajectory, in);
}

void DecisionPipeline::choose(const DecisionInput& in, DecisionOutput& out) noexcept {
  const bool is_free = std::isinf(draft_.committed_until_s);
  const bool keeps = is_free && draft_.stops && (draft_.keeps || is_kept(in, out));
  if (out.smoother_status == Status::kOk && !keeps) {
    has_planned_ = true;
    is_narrow_ = draft_.is_narrow;
    if (draft_.leaves) {
      leaves_at_ = draft_.trajectory.start_time;
      left_W_ = draft_.start.p_W;
    }
    if (draft_.dodges) dodges_at_ = draft_.trajectory.start_time;
    out.kind = DecisionKind::kNew;
    out.trajectory = draft_.trajectory;
    return;
  }
  if ((is_free && draft_.stops) || in.climbing) return;
  const Known known(*this, in);
  const MonotonicTime free_until =
      is_free ? MonotonicTime::max() : in.committed->start_time + from_seconds(draft_.committed_until_s);
  const auto stop = stop_before(in, free_until, known.view(), draft_.smoother_work, out.latency);
  if (!stop) return;
  out.kind = DecisionKind::kBrake;
  out.trajectory = *stop;
}

void DecisionPipeline::forget() noexcept {
  map_.forget();
  if (ways_ != nullptr) ways_->forget();
  motion_ = {};
  bodies_ = {};
  dodges_at_ = MonotonicTime::min();
  thin_until_ = {};
  thin_from_W_.reset();
  viewpoints_ = {};
  trail_ = {};
  kept_W_.clear();
  gaze_target_.reset();
  looks_next_.reset();
  left_W_.reset();
  has_planned_ = false;
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
      return plan(in, out);
    case core::StageId::kSmoother:
      return smooth(in, out);
  }
}

}  // namespace roborun::flight
