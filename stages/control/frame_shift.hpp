/// What satellite navigation says of the frame that is flown in: where it is on the earth.
#pragma once

#include <cstdint>

#include "core/geometry/vector.hpp"
#include "firmware_if/time.hpp"

namespace roborun::stages {

/// What is flown, mapped and planned lies in a frame that never jumps (REP 105: odom). While odometry holds it, fixes do not
/// move it: they move this shift, and with it the goal. Three numbers, one variance: between the last fix and the next one the
/// odometry's drift is added to it, and averaging takes none of what a fix says of its own error away, because that
/// wanders for minutes.
class FrameShift {
 public:
  enum class Verdict : std::uint8_t {
    kTaken,
    kRefused,  ///< Beyond the gate.
    kJumped,   ///< Beyond the gate, all alike for kAgree, and no farther than kMostJump_m: taken as it is.
  };
  static constexpr Nanos kAgree{600'000'000};
  static constexpr double kMostJump_m = 5.0;  ///< What is more is not believed, however long it lasts.

  /// Add to a place in the flown frame: where it is on the earth.
  [[nodiscard]] const Vector3& shift_W() const noexcept { return shift_W_; }
  [[nodiscard]] double sigma_m() const noexcept { return sigma_m_; }
  /// The flown frame begins at a fix with this error; 0: it begins as the odometry's, and the first fix places it.
  void begin(double sigma_m) noexcept;
  /// The next fix places the frame, whatever is believed until then.
  void forget() noexcept { placed_ = false; }
  void grow(double drift_m) noexcept { sigma_m_ += drift_m; }
  /// A fix less the place then and the shift. `gate_sigma` as of the estimator.
  [[nodiscard]] Verdict update(const Vector3& innovation_m, double sigma_m, double gate_sigma,
                               MonotonicTime stamp) noexcept;
  /// The same for a fix that somebody else has refused: kRefused or kJumped.
  [[nodiscard]] Verdict refuse(const Vector3& innovation_m, double sigma_m, double gate_sigma,
                               MonotonicTime stamp) noexcept;

 private:
  Vector3 shift_W_ = Vector3::Zero();
  double sigma_m_{0.0};
  bool placed_{false};
  Vector3 jump_m_ = Vector3::Zero();  ///< Of the first of those that were refused alike.
  MonotonicTime jump_since_{};
  MonotonicTime jump_last_{};
};

}  // namespace roborun::stages
