#include "stages/control/past_states.hpp"

#include <algorithm>

namespace roborun::stages {

void PastStates::add(const Past& past) noexcept {
  ring_[count_ % kMost] = past;
  ++count_;
}

const PastStates::Past* PastStates::at(MonotonicTime stamp) const noexcept {
  const std::size_t available = std::min(count_ - first_, kMost);
  if (available == 0) return nullptr;
  const MonotonicTime newest = ring_[(count_ - 1) % kMost].stamp;
  if (newest - stamp > oldest_ || stamp > newest) return nullptr;
  for (std::size_t back = 1; back <= available; ++back) {
    const Past& p = ring_[(count_ - back) % kMost];
    if (p.stamp <= stamp + Nanos{1'250'000}) return &p;
  }
  return nullptr;
}

Status PastStates::pose_at(MonotonicTime stamp, Pose& X_WB) const noexcept {
  const Past* then = at(stamp);
  if (then == nullptr || stamp - then->stamp > Nanos{20'000'000}) return Status::kStale;
  X_WB = {then->q_WB.toRotationMatrix(), then->p_WB};
  return Status::kOk;
}

void PastStates::catch_up(const PastStates& newer) noexcept {
  for (std::size_t i = std::max(count_, newer.count_ - std::min(newer.count_, kMost)); i < newer.count_; ++i)
    ring_[i % kMost] = newer.ring_[i % kMost];
  oldest_ = newer.oldest_;
  first_ = newer.first_;
  count_ = newer.count_;
}

}  // namespace roborun::stages
