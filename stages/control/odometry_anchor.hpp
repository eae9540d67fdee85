/// Where the frame of the odometry lies in the world that is flown in.
#pragma once

#include <cstdint>

#include "core/geometry/vector.hpp"
#include "firmware_if/odometry.hpp"
#include "firmware_if/status.hpp"
#include "stages/control/past_states.hpp"

namespace roborun::stages {

/// A sample as the filter uses it. Frame as said by who holds it: O, or W once it is anchored.
struct OdometryState {
  Vector3 p_m = Vector3::Zero();
  Quaternion q = Quaternion::Identity();
  Vector3 v_mps = Vector3::Zero();
};

/// Turned about the vertical alone: O's z is up. Made so that one sample is where the vehicle was believed to be: a frame that
/// begins anew moves, and what was mapped stays.
class OdometryAnchor {
 public:
  OdometryAnchor() = default;
  OdometryAnchor(const OdometryState& in_O, const PastStates::Past& then, std::uint8_t reset_counter) noexcept;

  [[nodiscard]] OdometryState in_W(const OdometryState& in_O) const noexcept;
  [[nodiscard]] std::uint8_t reset_counter() const noexcept { return reset_counter_; }

 private:
  Quaternion q_WO_ = Quaternion::Identity();
  Vector3 p_WO_ = Vector3::Zero();
  std::uint8_t reset_counter_{0};
};

/// kInvalidArgument: not finite, no rotation, or a sigma that nothing can be weighed with. RT-safe: O(1).
[[nodiscard]] Status read_odometry(const firmware_if::OdometrySample& sample, OdometryState& in_O) noexcept;

}  // namespace roborun::stages
