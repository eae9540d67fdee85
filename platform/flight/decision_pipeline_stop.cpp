// Stops: where an autopilot's leads when the vehicle hears no commands any more, how soon a vehicle that stands decides, how it
// squeezes through a narrow place, and how it leaves one without room.
#include <algorithm>

#include "platform/flight/decision_pipeline.hpp"
#include "platform/flight/flight_config.hpp"
#include "stages/perception/polled_view.hpp"
#include "stages/perception/swept_ball.hpp"
#include "stages/planning/fenced_view.hpp"
#include "stages/planning/way_out.hpp"

namespace roborun::flight {
namespace {

constexpr double kLeaving_mps = 0.5;
constexpr Nanos kShutIn{5'000'000'000};  // searches with all time and with either room found nothing

}  // namespace

bool DecisionPipeline::stops_free(const Trajectory& trajectory, MonotonicTime from, const DecisionOutput& out,
                                  const stages::MapView& view, core::Work& work) const noexcept {
  constexpr Nanos kReserve = std::chrono::milliseconds(50);
  // The next decision may find nothing better than to brake: then this is flown so long, and the stop from there.
  const MonotonicTime until = from + out.decision.point.deadline + kReserve;
  Trajectory braked;
  return stops_free(trajectory, from, until, view, work) &&
         brake(trajectory.at(until), until, braked) == Status::kOk &&
         stages::is_trajectory_free(view, braked, 0.0, config_.vehicle.radius_m, work.units) &&
         stops_free(braked, until, until + from_seconds(braked.duration_s()), view, work);
}

bool DecisionPipeline::stops_free(const Trajectory& trajectory, MonotonicTime from, MonotonicTime until,
                                  const stages::MapView& view, core::Work& work) const noexcept {
  constexpr Nanos kEvery = std::chrono::milliseconds(250);
  constexpr double kAtOnce_mps3 = 1e3;
  const StoppingModel model = stopping_model(config_.vehicle);
  for (MonotonicTime t = from; t < until; t += kEvery) {
    TrajectoryPoint point = trajectory.at(t);
    const double v_mps = point.v_W.norm();
    if (v_mps < kCrawl_mps + kAtRest_mps) continue;
    // As a stop that takes this distance.
    point.a_W.setZero();
    stages::MotionLimits straight = limits(v_mps);
    straight.acceleration_mps2 = 0.5 * v_mps * v_mps / model.distance_m(v_mps);
    straight.jerk_mps3 = kAtOnce_mps3;
    Trajectory stop;
    if (smoother_.brake(point, t, straight, stop) != Status::kOk) return false;
    if (!stages::is_trajectory_free(view, stop, 0.0, config_.vehicle.radius_m, work.units)) return false;
  }
  return true;
}

bool DecisionPipeline::may_squeeze() const noexcept {
  constexpr double kSlowEnough = 1.05;  // of the slow speed: what trajectories keep to
  const VehicleModel& vehicle = config_.vehicle;
  return slow_radius_m(vehicle) < radius_m() &&
         draft_.start.v_W.norm() <= kSlowEnough * vehicle.slow_speed_mps;
}

void DecisionPipeline::squeeze_on(const DecisionInput& in, core::StageBudget& budget,
                                  DecisionOutput& out) noexcept {
  constexpr double kNearer_m = 1.0;
  if (!ways_known_) return;
  const double wide_m = ways_->to_goal_m(draft_.trajectory.end_W());
  if (wide_m < ways_->to_goal_m(draft_.start.p_W)) return;
  const Trajectory wide = draft_.trajectory;
  const stages::Path path_W = kept_W_;
  search(in, slow_radius_m(config_.vehicle), out);
  if (out.planner_status != Status::kStartBlocked) fit_narrow(budget, out);
  if (draft_.is_narrow && ways_->to_goal_m(draft_.trajectory.end_W()) < wide_m - kNearer_m) return;
  draft_.trajectory = wide;
  draft_.is_narrow = false;
  kept_W_ = path_W;
  out.planner_status = out.smoother_status = Status::kOk;
}

void DecisionPipeline::slow_down(const DecisionInput& in, const stages::MapView& known,
                                 core::StageBudget& budget, DecisionOutput& out) noexcept {
  constexpr Nanos kEvery = std::chrono::milliseconds(500);
  if (!std::isinf(draft_.committed_until_s)) return;
  draft_.stops = stops_free(*in.committed, draft_.takes_over, out, known, draft_.smoother_work);
  const bool is_found = out.smoother_status == Status::kOk;
  if (draft_.stops || (is_found && !draft_.keeps && !is_kept(in, out))) return;
  const Trajectory found = draft_.trajectory;
  const stages::Path path_W = kept_W_;
  const MonotonicTime ends = in.committed->ends();
  kept_W_.clear();
  for (MonotonicTime t = draft_.takes_over; t < ends && kept_W_.size() + 1 < kept_W_.capacity(); t += kEvery)
    (void)kept_W_.push_back(in.committed->at(t).p_W);
  if (ends > draft_.takes_over) (void)kept_W_.push_back(in.committed->end_W());
  const VehicleModel& vehicle = config_.vehicle;
  const double speed_mps = out.decision.point.speed_limit_mps;
  if (is_narrow_)
    fit(budget, slow_radius_m(vehicle), std::min(speed_mps, vehicle.slow_speed_mps), out);
  else
    fit(budget, radius_m(), speed_mps, out);
  if (out.smoother_status == Status::kOk) {
    draft_.is_narrow = is_narrow_;
    draft_.leaves = draft_.dodges = false;
  } else if (is_found && !draft_.keeps) {
    draft_.trajectory = found;
    kept_W_ = path_W;
    out.smoother_status = Status::kOk;
  }
}

void DecisionPipeline::hasten(const DecisionInput& in, DecisionOutput& out) const noexcept {
  constexpr double kReserve = 1.25;  // of the time for planner and smoother
  constexpr double kSearches = 3.0;  // of find_trajectory(), one of which is predicted
  constexpr int kSpareFrames = 4;
  if (in.climbing || out.decision.source == governor::BudgetSource::kFixed) return;
  // Where little is in view a search is predicted to take nothing.
  const double left_s = std::max(kSearches * out.decision.predicted_s[core::StageId::kPlanner],
                                 searched_s_[static_cast<std::size_t>(out.decision.point.p1_level)]) +
                        out.decision.predicted_s[core::StageId::kSmoother];
  const Nanos needed = out.latency + from_seconds(kReserve * left_s);
  const Nanos whole = config_.minor_frame * (needed / config_.minor_frame + kSpareFrames);
  const MonotonicTime stands = in.committed->ends();
  if (in.now + whole < stands) return;
  out.decision.point.deadline = std::min(out.decision.point.deadline, whole);
}

void DecisionPipeline::leave(double room_m, core::StageBudget& budget, DecisionOutput& out) noexcept {
  constexpr double kSamePlace_m = 2.0;  // as far as a way out leads
  constexpr int kTriesFiner = 4;        // failures: the governor asks for finer cells meanwhile
  // What is flown ends in a stop: from there.
  if (draft_.start.v_W.norm() > kAtRest_mps || draft_.start.a_W.norm() > kAtRest_mps) return;
  const stages::FencedView permitted(map_.view(), config_.fence);
  const stages::FinestView finest(permitted);
  // Where it stands again though it left, and only the cells are too coarse for the room that there is, finer ones are what lacks.
  const bool again = left_W_ && (draft_.start.p_W - *left_W_).norm() < kSamePlace_m;
  if (again && failures_ < kTriesFiner &&
      stages::is_ball_free(finest, draft_.start.p_W, room_m, draft_.smoother_work.units))
    return;
  stages::WayOutRequest request;
  request.start_W = draft_.start.p_W;
  request.start_time = draft_.takes_over;
  request.bounds_W = config_.flight_bounds_W;
  request.limits = limits(std::min(out.decision.point.speed_limit_mps, kLeaving_mps));
  request.body_m = config_.vehicle.radius_m;
  request.room_m = room_m;
  meter_.charge_to(core::StageId::kSmoother);
  draft_.leaves =
      stages::find_way_out(request, permitted, finest, budget, draft_.smoother_work, draft_.trajectory);
  out.smoother_status = draft_.leaves ? Status::kOk : Status::kNoPath;
}

void DecisionPipeline::go_back(const DecisionInput& in, core::StageBudget& budget,
                               DecisionOutput& out) noexcept {
  const Vector3& from_W = draft_.start.p_W;
  const bool stands = draft_.start.v_W.norm() <= kAtRest_mps && !in.climbing;
  if (out.planner_status != Status::kNoPath || !stands || !ways_known_) shut_in_since_ = in.now;
  if (in.now - shut_in_since_ < kShutIn) return;
  meter_.charge_to(core::StageId::kSmoother);
  core::Work& work = draft_.smoother_work;
  const stages::FencedView permitted(map_.view(), config_.fence);
  const stages::FinestView finest(permitted);
  const stages::PolledView view(finest, budget, work);
  const double nearer_m = ways_->to_goal_m(from_W) - view.cell_m();
  for (std::size_t i = 0; i < trail_.size() && !view.spent(); ++i) {
    const Vector3& to_W = trail_.back(i);
    Trajectory line;
    line.start_time = draft_.takes_over;
    if (!(ways_->to_goal_m(to_W) < nearer_m) || !config_.flight_bounds_W.contains(to_W) ||
        !stages::is_ball_free(view, to_W, slow_radius_m(config_.vehicle), work.units) ||
        !stages::append_rest_to_rest(from_W, to_W, limits(kLeaving_mps), line) ||
        !stages::is_trajectory_free(view, line, 0.0, config_.vehicle.radius_m, work.units))
      continue;
    draft_.trajectory = line;
    draft_.leaves = true;
    out.smoother_status = Status::kOk;
    return;
  }
}

}  // namespace roborun::flight
