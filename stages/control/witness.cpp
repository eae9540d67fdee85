#include "stages/control/witness.hpp"

#include <algorithm>

#include "core/geometry/math.hpp"

namespace roborun::stages {
namespace {

/// A receiver's error is nearly the same in two fixes of a second: what it says of it is no measure of how they differ.
constexpr double kMostSigma_m = 0.3;

}  // namespace

Nanos Witness::refused(const Sample& sample, double gate_sigma) noexcept {
  const Nanos gap = sample.stamp - last_.stamp;
  const bool follows = first_ && gap > Nanos{0} && gap < kForgotten && sample.p_m != last_.p_m;
  if (follows) {
    moved_m_ += 0.5 * seconds(gap) * (sample.v_mps + last_.v_mps);
    acceleration_mps2_ = (sample.v_mps - last_.v_mps) / seconds(gap);
  }
  last_ = sample;
  accepted_ = 0;
  if (follows) {
    const double sigma_m = core::hypot2(1.5 * std::min(sample.sigma_p_m, kMostSigma_m),
                                        sample.sigma_v_mps * seconds(sample.stamp - first_->stamp));
    if ((sample.p_m - first_->p_m - moved_m_).norm() <= gate_sigma * sigma_m)
      return sample.stamp - first_->stamp;
  }
  first_ = sample;
  moved_m_.setZero();
  acceleration_mps2_.setZero();
  return Nanos{0};
}

}  // namespace roborun::stages
