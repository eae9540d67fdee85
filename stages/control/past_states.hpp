/// The vehicle's states of the last half second: what a late fix and an image of then are compared with.
#pragma once

#include <array>
#include <cstddef>

#include "core/geometry/vector.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::stages {

/// A ring of the newest 200 states: 0.5 s at 400 Hz.
class PastStates {
 public:
  struct Past {
    MonotonicTime stamp{};
    Vector3 p_WB = Vector3::Zero();
    Vector3 v_WB = Vector3::Zero();
    Quaternion q_WB = Quaternion::Identity();
  };
  /// `oldest`: what is older than the newest state by more counts as forgotten.
  explicit PastStates(Nanos oldest) noexcept : oldest_(oldest) {}

  /// Stamps ascend. RT-safe: O(1).
  void add(const Past& past) noexcept;
  void clear() noexcept { first_ = count_; }
  /// The newest state that is at most 1.25 ms younger than `stamp`; null if that is in the future, forgotten,
  /// or was never there. RT-safe: O(states since then).
  [[nodiscard]] const Past* at(MonotonicTime stamp) const noexcept;
  /// The pose then; kStale where at() has none, or none within 20 ms.
  [[nodiscard]] Status pose_at(MonotonicTime stamp, Pose& X_WB) const noexcept;
  /// Makes this, an older copy of `newer`, equal to it. RT-safe: O(states added since).
  void catch_up(const PastStates& newer) noexcept;

 private:
  static constexpr std::size_t kMost = 200;
  Nanos oldest_;
  std::array<Past, kMost> ring_{};
  std::size_t first_{0};
  std::size_t count_{0};  ///< Added so far; never decreases.
};

}  // namespace roborun::stages
