// What a vehicle that does not see all around does where no way is found: it looks, and goes to where it sees more.
// What a decision remembers of thin things.
#include <algorithm>
#include <array>

#include "core/geometry/math.hpp"
#include "platform/flight/decision_pipeline.hpp"
#include "stages/perception/polled_view.hpp"
#include "stages/planning/fenced_view.hpp"

namespace roborun::flight {
namespace {

/// So many pixels of a decision's images show something thin where poles or wires are: 40 to 900 in worlds of them. In environment
/// 14 they are at most 3 (clean cameras), 23 (d455).
constexpr std::uint32_t kThinPixels = 32;
/// Where something thin was seen there is more of it, until so much time and so much way are past.
constexpr Nanos kThinLasts{5'000'000'000};
constexpr double kThinNear_m = 5.0;

constexpr Nanos kSettles{500'000'000};  // images of the place where it has stepped back to
constexpr double kStepBack_m = 3.0;
constexpr double kSlowly_mps = 1.0;
constexpr double kHere_m = 0.3;  // nearer than that a direction means little
constexpr std::size_t kCorners = 32;

}  // namespace

std::optional<Vector3> DecisionPipeline::known_end_W() const noexcept {
  std::array<Vector3, kCorners> way_W;
  const std::size_t count =
      ways_known_ ? ways_->known_way(draft_.start.p_W, config_.horizon_m, way_W) : std::size_t{0};
  return count > 0 ? std::optional(way_W[count - 1]) : std::nullopt;
}

Vector3 DecisionPipeline::undecided_W(const DecisionInput& in) const noexcept {
  const Vector3 end_W = known_end_W().value_or(in.goal_W);
  const Vector3 offset = end_W - draft_.start.p_W;
  return core::hypot2(offset.x(), offset.y()) > kHere_m ? end_W : in.goal_W;
}

std::optional<DecisionPipeline::Look> DecisionPipeline::find_look(const DecisionInput& in) noexcept {
  const Vector3 at_W = undecided_W(in);
  if (const std::optional<Vector3> end_W = known_end_W()) {
    const stages::FencedView fenced(map_.view(), config_.fence);
    const stages::FinestView finest(fenced);
    core::Work& work = draft_.planner_work;
    const stages::PolledView view(finest, *draft_.planner_budget, work);
    const auto from_W = viewpoints_.next(
        view, {*end_W, slow_radius_m(config_.vehicle), config_.level_view_ratio, config_.flight_bounds_W},
        work.units);
    if (from_W) return Look{*from_W, *end_W};
    // All was looked at, and the way still leads there: the next time from the first one again.
    if (!view.spent()) viewpoints_ = {};
  }
  Vector3 away_W = draft_.start.p_W - at_W;
  away_W.z() = 0.0;
  const double far_m = core::hypot2(away_W.x(), away_W.y());
  if (!(far_m > kHere_m)) return std::nullopt;
  return Look{draft_.start.p_W + kStepBack_m / far_m * away_W, at_W};
}

void DecisionPipeline::look_on(const DecisionInput& in, core::StageBudget& budget,
                               DecisionOutput& out) noexcept {
  const bool stands = draft_.start.v_W.norm() <= kAtRest_mps && !in.climbing;
  const bool was_blocked = gaze_target_ && !gaze_target_->aside;
  gaze_target_ = GazeTarget{undecided_W(in), out.smoother_status == Status::kOk || !stands};
  if (gaze_target_->aside) {
    looks_next_.reset();
    return;
  }
  // Time for half a turn, then for that and once round.
  const Nanos look_first = from_seconds(core::kPi / config_.vehicle.yaw_rate_radps);
  const Nanos look_again = 3 * look_first;
  if (!was_blocked) blocked_since_ = std::max(blocked_since_, in.now - look_again + look_first);
  if (in.now - blocked_since_ >= look_again) {
    blocked_since_ = in.now;
    meter_.charge_to(core::StageId::kPlanner);
    looks_next_ = find_look(in);
  }
  if (!looks_next_) return;
  gaze_target_->at_W = looks_next_->at_W;
  const double radius = slow_radius_m(config_.vehicle);
  const Status planned = out.planner_status;
  draft_.planner_work.volume_m3 = 0.0;
  search_to(looks_next_->from_W, in, radius, out);
  // What had no time to end is searched for once more in the next decision, which has more.
  if (out.planner_status != Status::kBudgetSpent) looks_next_.reset();
  if (out.planner_status == Status::kOk) fit(budget, radius, kSlowly_mps, out);
  if (out.smoother_status == Status::kOk)
    back_until_ = draft_.trajectory.ends() + kSettles;
  else
    out.planner_status = planned;
  kept_W_.clear();
}

void DecisionPipeline::note_thin(const DecisionInput& in, std::uint32_t pixels) noexcept {
  if (pixels < kThinPixels) return;
  thin_until_ = in.now + kThinLasts;
  thin_from_W_ = in.p_WB;
}

bool DecisionPipeline::is_among_thin(const DecisionInput& in) const noexcept {
  return in.now < thin_until_ || (thin_from_W_.has_value() && (in.p_WB - *thin_from_W_).norm() < kThinNear_m);
}

}  // namespace roborun::flight
