#include "stages/control/frame_shift.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::stages {
namespace {

/// Fixes of ten a second whose errors last for 15 s: so many say no more than one.
constexpr double kAlike = 150.0;
constexpr Nanos kForgotten{500'000'000};  // between two fixes that are refused alike

}  // namespace

void FrameShift::begin(double sigma_m) noexcept {
  *this = {};
  sigma_m_ = sigma_m;
  placed_ = sigma_m > 0.0;
}

FrameShift::Verdict FrameShift::update(const Vector3& innovation_m, double sigma_m, double gate_sigma,
                                       MonotonicTime stamp) noexcept {
  if (!placed_) {
    shift_W_ += innovation_m;
    sigma_m_ = sigma_m;
    placed_ = true;
    return Verdict::kTaken;
  }
  const double variance_m2 = sigma_m_ * sigma_m_;
  const double gate_m2 = gate_sigma * gate_sigma * (variance_m2 + sigma_m * sigma_m);
  if (!(innovation_m.squaredNorm() <= gate_m2)) return refuse(innovation_m, sigma_m, gate_sigma, stamp);
  const double gain = variance_m2 / (variance_m2 + kAlike * sigma_m * sigma_m);
  shift_W_ += gain * innovation_m;
  sigma_m_ = std::max(std::sqrt((1.0 - gain) * variance_m2), std::min(sigma_m, sigma_m_));
  return Verdict::kTaken;
}

FrameShift::Verdict FrameShift::refuse(const Vector3& innovation_m, double sigma_m, double gate_sigma,
                                       MonotonicTime stamp) noexcept {
  const bool alike =
      stamp - jump_last_ < kForgotten && (innovation_m - jump_m_).norm() <= gate_sigma * sigma_m;
  jump_last_ = stamp;
  if (!alike) {
    jump_m_ = innovation_m;
    jump_since_ = stamp;
    return Verdict::kRefused;
  }
  if (stamp - jump_since_ < kAgree || innovation_m.norm() > kMostJump_m) return Verdict::kRefused;
  shift_W_ += innovation_m;
  jump_last_ = {};
  return Verdict::kJumped;
}

}  // namespace roborun::stages
