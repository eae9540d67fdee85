#include "stages/planning/speed_change.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::stages {
namespace {

constexpr double kNone = 1e-9;      // m/s and m/s2: no change
constexpr int kHalvings = 8;        // of the peak: what is missing to the best one is held longer
constexpr int kTurns = 4;           // rounds for the direction of the peak
constexpr double kAlmost = 1.0005;  // of the jerk limit, which those rounds may leave

}  // namespace

double change_s(double delta_mps, const ChangeLimits& limits) noexcept {
  const double a = limits.acceleration_mps2, j = limits.jerk_mps3;
  return delta_mps * j >= a * a ? delta_mps / a + a / j : 2.0 * std::sqrt(std::max(delta_mps, 0.0) / j);
}

double change_m(double from_mps, double to_mps, const ChangeLimits& limits) noexcept {
  return 0.5 * (from_mps + to_mps) * change_s(std::fabs(to_mps - from_mps), limits);
}

VelocityChange::VelocityChange(const TrajectoryPoint& from, const Vector3& v_W,
                               const ChangeLimits& limits) noexcept
    : v_from_W_(from.v_W), a_from_W_(from.a_W), delta_W_(v_W - from.v_W), jerk_mps3_(limits.jerk_mps3) {
  const double accelerates_mps2 = a_from_W_.norm();
  const double delta_mps = delta_W_.norm();
  if (accelerates_mps2 < kNone) {
    a_from_W_.setZero();
    if (delta_mps > kNone) {
      const double ramp_s =
          std::min(limits.acceleration_mps2 / jerk_mps3_, std::sqrt(delta_mps / jerk_mps3_));
      const Vector3 jerk_W = (jerk_mps3_ / delta_mps) * delta_W_;
      piece_[0] = {jerk_W, ramp_s};
      piece_[1] = {Vector3::Zero(), std::max(delta_mps / (jerk_mps3_ * ramp_s) - ramp_s, 0.0)};
      piece_[2] = {-jerk_W, ramp_s};
    }
  } else if (!with_peak(limits.acceleration_mps2)) {
    double low = 0.0, high = limits.acceleration_mps2;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (with_peak(middle) ? low : high) = middle;
    }
    (void)with_peak(low);
  }
  sum_up();
}

/// With the ramp in from a0 to the peak A n within t1, a hold, and the ramp out within A / j,
///   delta = a0 t1 / 2 + A n (t1 / 2 + hold + A / 2j)
/// so that n is the direction of delta - a0 t1 / 2. t1 = |A n - a0| / j depends on n: a few rounds; where they
/// do not settle, (|a0| + A) / j is enough for any direction.
bool VelocityChange::with_peak(double peak_mps2) noexcept {
  const double accelerates_mps2 = a_from_W_.norm();
  const double enough_s = (accelerates_mps2 + peak_mps2) / jerk_mps3_;
  double in_s = enough_s;
  Vector3 left_W = Vector3::Zero(), peak_W = Vector3::Zero();
  double left_mps = 0.0;
  const auto aim = [&] {
    left_W = delta_W_ - 0.5 * in_s * a_from_W_;
    left_mps = left_W.norm();
    peak_W = left_mps > kNone ? Vector3((peak_mps2 / left_mps) * left_W) : Vector3::Zero();
  };
  for (int i = 0; i < kTurns; ++i) {
    aim();
    in_s = (peak_W - a_from_W_).norm() / jerk_mps3_;
  }
  aim();
  if (!((peak_W - a_from_W_).norm() <= kAlmost * jerk_mps3_ * in_s)) {
    in_s = enough_s;
    aim();
  }
  const double out_s = peak_mps2 / jerk_mps3_;
  const double ramps_mps = 0.5 * peak_mps2 * (in_s + out_s);
  if (left_mps < ramps_mps) return false;
  const Vector3 none = Vector3::Zero();
  piece_[0] = {in_s > 0.0 ? Vector3((peak_W - a_from_W_) / in_s) : none, in_s};
  piece_[1] = {none, peak_mps2 > kNone ? (left_mps - ramps_mps) / peak_mps2 : 0.0};
  piece_[2] = {out_s > 0.0 ? Vector3(-peak_W / out_s) : none, out_s};
  return true;
}

double VelocityChange::duration_s() const noexcept {
  return piece_[0].duration_s + piece_[1].duration_s + piece_[2].duration_s;
}

void VelocityChange::sum_up() noexcept {
  TrajectoryPoint at;
  at.v_W = v_from_W_;
  at.a_W = a_from_W_;
  for (const Piece& piece : piece_) at = after(at, piece);
  way_W_ = at.p_W;
}

TrajectoryPoint after(const TrajectoryPoint& at, const VelocityChange::Piece& piece) noexcept {
  const double t = piece.duration_s;
  TrajectoryPoint then;
  then.p_W = at.p_W + t * (at.v_W + t * (0.5 * at.a_W + (t / 6.0) * piece.jerk_W));
  then.v_W = at.v_W + t * (at.a_W + (0.5 * t) * piece.jerk_W);
  then.a_W = at.a_W + t * piece.jerk_W;
  return then;
}

}  // namespace roborun::stages
