#include "stages/control/estimator.hpp"

#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::stages {
namespace {

constexpr int kCovarianceEvery = 4;
constexpr int kPosition = 0;
constexpr int kVelocity = 3;
constexpr int kAttitude = 6;
constexpr int kGyroBias = 9;
constexpr int kAccelBias = 12;

Vector3 to_vector(const std::array<double, 3>& v) noexcept { return {v[0], v[1], v[2]}; }

/// A standard deviation that a measurement can be weighed with.
bool is_sigma(double sigma) noexcept { return sigma > 0.0 && std::isfinite(sigma); }

Matrix3 skew(const Vector3& v) noexcept {
  Matrix3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Rotation by a small vector, to second order, normalised.
Quaternion small_rotation(const Vector3& angle_rad) noexcept {
  const Vector3 half = 0.5 * angle_rad;
  return Quaternion(1.0 - 0.5 * half.squaredNorm(), half.x(), half.y(), half.z()).normalized();
}

bool has_heading(const firmware_if::GnssFix& fix) noexcept {
  return std::isfinite(fix.heading_rad) && fix.sigma_heading_rad > 0.0;
}

double yaw_of(const Quaternion& q) noexcept {
  const Matrix3 R = q.toRotationMatrix();
  return core::atan2(R(1, 0), R(0, 0));
}

}  // namespace

Status Estimator::predict(const firmware_if::ImuSample& sample) noexcept {
  const Vector3 gyro_B = to_vector(sample.angular_rate_B_radps);
  const Vector3 force_B = to_vector(sample.specific_force_B_mps2);
  if (!is_finite(gyro_B) || !is_finite(force_B)) {
    ++counters_.refused_not_finite;
    return Status::kInvalidArgument;
  }
  if (counters_.imu > 0 && sample.stamp <= state_.stamp) {
    ++counters_.refused_stamp;
    return Status::kStale;
  }
  ++counters_.imu;
  // A gap is not integrated over: at most 20 ms, the rest is caught up by the fixes.
  const double dt_s = counters_.imu == 1 ? 0.0 : std::fmin(seconds(sample.stamp - state_.stamp), 0.02);
  state_.stamp = sample.stamp;
  last_force_B_ = force_B;
  if (!started_) return Status::kOk;

  state_.w_WB_B = gyro_B - gyro_bias_B_;
  state_.q_WB = (state_.q_WB * small_rotation(dt_s * state_.w_WB_B)).normalized();
  force_W_ = state_.q_WB.toRotationMatrix() * (force_B - accel_bias_B_);
  const Vector3 a_W = force_W_ - Vector3(0.0, 0.0, core::kGravity_mps2);
  state_.p_WB += dt_s * state_.v_WB + (0.5 * dt_s * dt_s) * a_W;
  state_.v_WB += dt_s * a_W;

  covariance_dt_s_ += dt_s;
  if (++since_covariance_ >= kCovarianceEvery) {
    propagate_covariance(covariance_dt_s_);
    since_covariance_ = 0;
    covariance_dt_s_ = 0.0;
  }
  past_.add({state_.stamp, state_.p_WB, state_.v_WB, state_.q_WB});
  reset_if_broken();
  return Status::kOk;
}

void Estimator::propagate_covariance(double dt_s) noexcept {
  const Matrix3 R_WB = state_.q_WB.toRotationMatrix();
  Covariance F = Covariance::Identity();
  F.block<3, 3>(kPosition, kVelocity) = dt_s * Matrix3::Identity();
  F.block<3, 3>(kVelocity, kAttitude) = -dt_s * skew(force_W_);
  F.block<3, 3>(kVelocity, kAccelBias) = -dt_s * R_WB;
  F.block<3, 3>(kAttitude, kGyroBias) = -dt_s * R_WB;
  const Covariance FP = F.lazyProduct(P_);
  P_ = FP.lazyProduct(F.transpose());

  const double samples = kCovarianceEvery;
  const double sample_dt_s = dt_s / samples;
  const double velocity =
      samples * config_.accel_noise_mps2 * config_.accel_noise_mps2 * sample_dt_s * sample_dt_s;
  const double attitude =
      samples * config_.gyro_noise_radps * config_.gyro_noise_radps * sample_dt_s * sample_dt_s;
  for (int i = 0; i < 3; ++i) {
    P_(kVelocity + i, kVelocity + i) += velocity;
    P_(kAttitude + i, kAttitude + i) += attitude;
    P_(kGyroBias + i, kGyroBias + i) += config_.gyro_bias_walk_radps * config_.gyro_bias_walk_radps * dt_s;
    P_(kAccelBias + i, kAccelBias + i) += config_.accel_bias_walk_mps2 * config_.accel_bias_walk_mps2 * dt_s;
  }
}

bool Estimator::correct(int index, double innovation, double sigma) noexcept {
  const double S = P_(index, index) + sigma * sigma;
  if (!(innovation * innovation <= config_.gate_sigma * config_.gate_sigma * S)) {
    ++counters_.refused_gate;
    return false;
  }
  const Eigen::Matrix<double, kStates, 1> K = P_.col(index) / S;
  const Eigen::Matrix<double, kStates, 1> dx = K * innovation;
  P_ -= K * P_.row(index).eval();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  state_.p_WB += dx.segment<3>(kPosition);
  state_.v_WB += dx.segment<3>(kVelocity);
  state_.q_WB = (small_rotation(dx.segment<3>(kAttitude)) * state_.q_WB).normalized();
  gyro_bias_B_ += dx.segment<3>(kGyroBias);
  accel_bias_B_ += dx.segment<3>(kAccelBias);
  return true;
}

void Estimator::start(const firmware_if::GnssFix& fix) noexcept {
  state_.p_WB = to_vector(fix.p_WB_m);
  state_.v_WB = to_vector(fix.v_WB_mps);
  // Level by the accelerometer: the rotation that takes the measured force to the vertical, then the heading.
  const double norm = last_force_B_.norm();
  const Vector3 up_B = norm > 1.0 ? Vector3(last_force_B_ / norm) : Vector3(0.0, 0.0, 1.0);
  const Vector3 axis = up_B.cross(Vector3(0.0, 0.0, 1.0));
  const Quaternion level = Quaternion(1.0 + up_B.z(), axis.x(), axis.y(), axis.z()).normalized();
  const double turn_rad = fix.heading_rad - yaw_of(level);
  const core::SinCos half = core::sin_cos(0.5 * turn_rad);
  state_.q_WB = (Quaternion(half.cos, 0.0, 0.0, half.sin) * level).normalized();
  gyro_bias_B_.setZero();
  accel_bias_B_.setZero();
  force_W_ = Vector3(0.0, 0.0, core::kGravity_mps2);
  P_.setZero();
  for (int i = 0; i < 3; ++i) {
    P_(kPosition + i, kPosition + i) = 0.05 * 0.05;
    P_(kVelocity + i, kVelocity + i) = 0.1 * 0.1;
    P_(kAttitude + i, kAttitude + i) = 0.02 * 0.02;
    P_(kGyroBias + i, kGyroBias + i) = 0.005 * 0.005;
    P_(kAccelBias + i, kAccelBias + i) = 0.1 * 0.1;
  }
  past_.clear();
  since_covariance_ = 0;
  covariance_dt_s_ = 0.0;
  started_ = true;
}

Status Estimator::update(const firmware_if::GnssFix& fix) noexcept {
  const Vector3 p_W = to_vector(fix.p_WB_m);
  const Vector3 v_W = to_vector(fix.v_WB_mps);
  if (!is_finite(p_W) || !is_finite(v_W) || !is_sigma(fix.sigma_horizontal_m) ||
      !is_sigma(fix.sigma_vertical_m) || !is_sigma(fix.sigma_speed_mps)) {
    ++counters_.refused_not_finite;
    return Status::kInvalidArgument;
  }
  if (!started_) {
    if (counters_.imu == 0 || !has_heading(fix)) return Status::kNotReady;
    last_gnss_ = fix.stamp;
    start(fix);
    ++counters_.gnss;
    return Status::kOk;
  }
  const PastStates::Past* then = past_.at(fix.stamp);
  if (fix.stamp <= last_gnss_ || then == nullptr) {
    ++counters_.refused_stamp;
    return Status::kStale;
  }
  last_gnss_ = fix.stamp;
  const bool accepted = correct_by(fix, p_W - then->p_WB, v_W - then->v_WB, yaw_of(then->q_WB));
  if (accepted) ++counters_.gnss;
  reset_if_broken();
  return accepted ? Status::kOk : Status::kInvalidArgument;
}

bool Estimator::correct_by(const firmware_if::GnssFix& fix, const Vector3& dp, const Vector3& dv,
                           double yaw_rad) noexcept {
  bool accepted = true;
  for (int i = 0; i < 3; ++i) {
    // The receiver's own slow bias is not white: never trust it below 2 cm.
    const double sigma_m = std::fmax(i == 2 ? fix.sigma_vertical_m : fix.sigma_horizontal_m, 0.02);
    accepted = correct(kPosition + i, dp[i], sigma_m) && accepted;
  }
  for (int i = 0; i < 3; ++i) accepted = correct(kVelocity + i, dv[i], fix.sigma_speed_mps) && accepted;
  if (has_heading(fix)) {
    const double turn_rad = core::wrap_angle(fix.heading_rad - yaw_rad);
    accepted = correct(kAttitude + 2, turn_rad, fix.sigma_heading_rad) && accepted;
  }
  return accepted;
}

Status Estimator::update(const firmware_if::BarometerSample& sample) noexcept {
  if (!std::isfinite(sample.altitude_m)) {
    ++counters_.refused_not_finite;
    return Status::kInvalidArgument;
  }
  if (!started_) return Status::kNotReady;
  const PastStates::Past* then = past_.at(sample.stamp);
  if (sample.stamp <= last_barometer_ || then == nullptr) {
    ++counters_.refused_stamp;
    return Status::kStale;
  }
  last_barometer_ = sample.stamp;
  if (!correct(kPosition + 2, sample.altitude_m - then->p_WB.z(), config_.barometer_sigma_m))
    return Status::kInvalidArgument;
  ++counters_.barometer;
  reset_if_broken();
  return Status::kOk;
}

Status Estimator::state(EstimatedState& out) const noexcept {
  if (!started_) return Status::kNotReady;
  out = state_;
  out.position_sigma_m = std::sqrt(std::fmax(P_(0, 0), std::fmax(P_(1, 1), P_(2, 2))));
  return Status::kOk;
}

void Estimator::reset_if_broken() noexcept {
  const bool fine = is_finite(state_.p_WB) && is_finite(state_.v_WB) && state_.q_WB.coeffs().allFinite() &&
                    is_finite(gyro_bias_B_) && is_finite(accel_bias_B_) && P_.diagonal().allFinite();
  if (fine) return;
  ++counters_.resets;
  started_ = false;
  past_.clear();
}

}  // namespace roborun::stages
