#include "platform/flight/goal_queue.hpp"

#include <algorithm>

namespace roborun::flight {

const char* to_string(GoalAnswer answer) noexcept {
  switch (answer) {
    case GoalAnswer::kFlown:
      return "flown";
    case GoalAnswer::kReached:
      return "reached";
    case GoalAnswer::kBlocked:
      return "goal_blocked";
    case GoalAnswer::kNoWay:
      return "no_way";
    case GoalAnswer::kReplaced:
      return "replaced";
  }
  return "?";
}

GoalQueue::GoalQueue(const Config& config, const Vector3& first_W) noexcept : config_(config) {
  Places places_W;
  (void)places_W.push_back(first_W);
  begin(places_W);
}

Status GoalQueue::give(std::span<const Vector3> goals_W) noexcept {
  if (goals_W.empty() || goals_W.size() > kMost) return Status::kInvalidArgument;
  const auto may_be = [this](const Vector3& p_W) {
    return is_finite(p_W) && config_.bounds_W.contains(p_W) &&
           (config_.fence.empty() || config_.fence.allows(Aabb::around(p_W, config_.room_m)));
  };
  if (!std::all_of(goals_W.begin(), goals_W.end(), may_be)) return Status::kGoalBlocked;
  Places& places_W = given_.draft();
  places_W.clear();
  for (const Vector3& p_W : goals_W) (void)places_W.push_back(p_W);
  given_.publish();
  return Status::kOk;
}

bool GoalQueue::take(MonotonicTime now, const Vector3& p_WB) noexcept {
  if (!given_.take()) return false;
  // What is flown to goes on being it.
  if (is_last() && given_.read()[0] == now_W() && first_ + places_W_.size() == told_.size())
    told_.truncate(first_ + at_), places_W_.truncate(at_);
  for (std::size_t i = at_; i < places_W_.size(); ++i) answer(i, GoalAnswer::kReplaced, now, p_WB);
  begin(given_.read());
  return true;
}

bool GoalQueue::next(GoalAnswer answer_of_it, MonotonicTime now, const Vector3& p_WB) noexcept {
  if (is_last()) return false;
  answer(at_, answer_of_it, now, p_WB);
  ++at_;
  return true;
}

void GoalQueue::begin(const Places& places_W) noexcept {
  places_W_ = places_W;
  at_ = 0;
  first_ = told_.size();
  for (const Vector3& p_W : places_W_) (void)told_.push_back({p_W});
}

void GoalQueue::answer(std::size_t index, GoalAnswer answer, MonotonicTime now,
                       const Vector3& p_WB) noexcept {
  if (first_ + index >= told_.size()) return;
  Goal& goal = told_[first_ + index];
  goal.answer = answer;
  goal.at = now;
  goal.distance_m = (goal.p_W - p_WB).norm();
}

}  // namespace roborun::flight
