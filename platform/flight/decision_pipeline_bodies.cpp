// What a decision does among bodies that move: slower, waiting, aside.
#include <array>
#include <cmath>

#include "platform/flight/decision_pipeline.hpp"
#include "platform/flight/rest_of_budget.hpp"
#include "stages/planning/fenced_view.hpp"

namespace roborun::flight {
namespace {

constexpr std::array<double, 2> kSlower{0.5, 0.25};  // of the speed limit
constexpr double kDodge_mps = 2.0;
constexpr std::array<double, 2> kDodge_m{1.5, 3.0};
constexpr double kDiagonal = 0.70710678118654752;
constexpr std::array<std::array<double, 2>, 8> kDodgeWay{{{0, 1},
                                                          {0, -1},
                                                          {-1, 0},
                                                          {1, 0},
                                                          {-kDiagonal, kDiagonal},
                                                          {-kDiagonal, -kDiagonal},
                                                          {kDiagonal, kDiagonal},
                                                          {kDiagonal, -kDiagonal}}};
constexpr double kReact_s = 1.0;      // until the next decision has an answer
constexpr std::uint64_t kLooks = 40;  // of one prediction, counted as so many lookups

/// Slower plans than the one that was found. What is too fast to slow down in front of a body may still pass it.
core::StaticVector<double, 1 + kSlower.size()> speeds_to_try_mps(const DecisionOutput& out,
                                                                 double fastest_mps) noexcept {
  core::StaticVector<double, 1 + kSlower.size()> speeds_mps;
  if (out.planner_status == Status::kStartBlocked) return speeds_mps;
  const double limit_mps = out.decision.point.speed_limit_mps;
  if (out.smoother_status != Status::kOk && fastest_mps > limit_mps) (void)speeds_mps.push_back(fastest_mps);
  for (const double share : kSlower) (void)speeds_mps.push_back(share * limit_mps);
  return speeds_mps;
}

/// To which side was decided: what touches nothing is not changed for what an estimate is wrong by.
bool goes_aside_still(const Trajectory& committed, MonotonicTime dodges_at, MonotonicTime now,
                      const BodyTracks::Meeting& flown) noexcept {
  return std::isinf(flown.touch_s) && committed.start_time == dodges_at &&
         now < dodges_at + from_seconds(committed.duration_s());
}

}  // namespace

BodyTracks::Meeting DecisionPipeline::meets(const Trajectory& trajectory, MonotonicTime from,
                                            core::Work& work) const noexcept {
  work.units += kLooks;
  return bodies_.meets(trajectory, from, radius_m(), config_.vehicle.radius_m);
}

std::optional<Trajectory> DecisionPipeline::stop_before_body(const DecisionInput& in, bool too_fast,
                                                             const stages::MapView& known, core::Work& work,
                                                             Nanos latency) const noexcept {
  if (bodies_.count(in.now) == 0 && !too_fast) return std::nullopt;
  const MonotonicTime soonest = in.now + latency + config_.minor_frame;
  const BodyTracks::Meeting flown = meets(*in.committed, soonest, work);
  const double speed_mps = in.committed->at(soonest).v_W.norm();
  const bool near = flown.near_s < kReact_s + speed_mps / config_.vehicle.acceleration_mps2;
  if (!near && !too_fast) return std::nullopt;
  auto stop = stop_before(in, MonotonicTime::max(), known, work, latency);
  if (!stop) return std::nullopt;
  // What goes aside already is not stopped in a body's way, though it is fast.
  const BodyTracks::Meeting stopped = meets(*stop, soonest, work);
  const bool goes_aside = std::isinf(flown.touch_s) && !std::isinf(stopped.touch_s);
  if (too_fast ? goes_aside : stopped.score() <= flown.score()) return std::nullopt;
  return stop;
}

void DecisionPipeline::dodge(const DecisionInput& in, core::StageBudget& budget, double& best_score,
                             Trajectory& best) noexcept {
  const stages::FencedView fenced(map_.view(), config_.fence);
  const stages::FinestView finest(fenced);
  // What is too fast to go aside at once does so while it brakes.
  Trajectory stop;
  if (brake(draft_.start, draft_.takes_over, stop) != Status::kOk) return;
  const double speed_mps =
      std::fmin(std::fmax(kDodge_mps, draft_.start.v_W.norm()), config_.vehicle.speed_mps);
  double best_rest_m = BodyTracks::kNever;
  for (const double distance_m : kDodge_m) {
    for (const auto& way : kDodgeWay) {
      const Vector3 end_W = stop.end_W() + distance_m * Vector3(way[0], way[1], 0.0);
      const double rest_m = (in.goal_W - end_W).norm();
      if (!config_.flight_bounds_W.contains(end_W)) continue;
      const std::array<Vector3, 2> path_W{draft_.start.p_W, end_W};
      stages::SmoothRequest request;
      request.path_W = path_W;
      request.start = draft_.start;
      request.start_time = draft_.takes_over;
      request.limits = limits(speed_mps);
      request.radius_m = radius_m();
      stages::SmoothResult smoothed;
      RestOfBudget rest(budget, draft_.smoother_work);
      const Status status = smoother_.smooth(request, finest, rest, smoothed);
      draft_.smoother_work.units += smoothed.work.units;
      if (status == Status::kBudgetSpent) {
        return;
      }
      if (status != Status::kOk) continue;
      const double score = meets(smoothed.trajectory, draft_.takes_over, draft_.smoother_work).score();
      const bool is_better =
          score > best_score || (score == best_score && std::isinf(score) && rest_m < best_rest_m);
      if (!is_better) continue;
      best_score = score;
      best_rest_m = rest_m;
      best = smoothed.trajectory;
    }
  }
}

void DecisionPipeline::give_way(const DecisionInput& in, core::StageBudget& budget,
                                DecisionOutput& out) noexcept {
  if (in.climbing || bodies_.count(in.now) == 0) return;
  const bool is_free = std::isinf(draft_.committed_until_s);
  const BodyTracks::Meeting flown = meets(*in.committed, draft_.takes_over, draft_.smoother_work);
  draft_.replaces = !std::isinf(flown.near_s);
  double best_score = -1.0;
  Trajectory best;
  // True: nothing can be better. Leaving known free space counts as touching.
  const auto consider = [&](const Trajectory& trajectory, double free_s = BodyTracks::kNever) {
    const double score =
        std::fmin(meets(trajectory, draft_.takes_over, draft_.smoother_work).score(), free_s);
    if (score > best_score) {
      best_score = score;
      best = trajectory;
    }
    return std::isinf(best_score);
  };
  meter_.charge_to(core::StageId::kSmoother);
  bool done = out.smoother_status == Status::kOk && consider(draft_.trajectory);
  if (done) return;
  const double first_score = best_score;
  const double fastest_mps = std::fmin(draft_.start.v_W.norm(), config_.vehicle.speed_mps);
  for (const double speed_mps : speeds_to_try_mps(out, fastest_mps)) {
    if (done) break;
    fit(budget, radius_m(), speed_mps, out);
    done = out.smoother_status == Status::kOk && consider(draft_.trajectory);
  }
  Trajectory stop;
  if (!done && brake(draft_.start, draft_.takes_over, stop) == Status::kOk) {
    const stages::FencedView fenced(map_.view(), config_.fence);
    // Where what is flown touches a body sooner than the stop leaves free space, it is better than that.
    const double free_s = free_until_s(stages::FinestView(fenced), stop, 0.0, config_.vehicle.radius_m,
                                       draft_.smoother_work.units);
    if (std::isinf(free_s) || free_s >= flown.touch_s) done = consider(stop, free_s);
  }
  const bool is_aside = is_free && !done && goes_aside_still(*in.committed, dodges_at_, in.now, flown);
  const double other_score = best_score;
  if (!done && !is_aside) dodge(in, budget, best_score, best);
  draft_.dodges = best_score > other_score;
  draft_.keeps = is_aside || (is_free && flown.score() >= best_score);
  if (best_score < 0.0) return;
  draft_.trajectory = best;
  draft_.leaves &= best_score == first_score;
  out.smoother_status = Status::kOk;
}

}  // namespace roborun::flight
