#include "stages/control/estimator.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "core/range.hpp"
#include "stages/control/estimator_terms.hpp"

namespace roborun::stages {
namespace {

constexpr int kCovarianceEvery = 4;
constexpr double kBarometerGain = 0.01;  // at 50 Hz: over two seconds
constexpr double kMeanForceGain = 0.05;
constexpr double kMostAnchored_rad = 0.12;  // else the state is no place to anchor anything at
constexpr double kMostAnchored_mps = 1.0;
// Odometry is never trusted more: what it says wanders, and half of the corrections are still under way (its latency).
constexpr double kLeastSigma_m = 0.02;
constexpr double kLeastSigma_rad = 0.005;
constexpr double kLeastSigma_mps = 0.05;

Matrix3 skew(const Vector3& v) noexcept {
  Matrix3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace

Status Estimator::predict(const firmware_if::ImuSample& sample) noexcept {
  const Vector3 gyro_B = to_vector(sample.angular_rate_B_radps);
  const Vector3 force_B = to_vector(sample.specific_force_B_mps2);
  if (!is_finite(gyro_B) || !is_finite(force_B)) {
    ++counters_.refused_not_finite;
    return Status::kInvalidArgument;
  }
  if (!is_next(sample.stamp)) {
    ++counters_.refused_stamp;
    return Status::kStale;
  }
  const bool is_first = ++counters_.imu == 1;
  const double dt_s = is_first ? 0.0 : seconds(sample.stamp - state_.stamp);
  const Vector3 before_radps = is_first ? gyro_B : last_rate_B_,
                before_mps2 = is_first ? force_B : last_force_B_;
  state_.stamp = sample.stamp;
  last_rate_B_ = gyro_B;
  last_force_B_ = force_B;
  mean_force_B_ = is_first ? force_B : Vector3(mean_force_B_ + kMeanForceGain * (force_B - mean_force_B_));
  if (!started_) return Status::kOk;

  if (dt_s <= kLongStep_s)
    integrate(gyro_B, force_B, dt_s);
  else
    integrate(0.5 * (gyro_B + before_radps), 0.5 * (force_B + before_mps2), dt_s);
  grow_between(gyro_B - before_radps, force_B - before_mps2, dt_s);
  if (++since_covariance_ >= kCovarianceEvery) {
    propagate_covariance(covariance_dt_s_);
    since_covariance_ = 0;
    covariance_dt_s_ = 0.0;
  }
  past_.add({state_.stamp, state_.p_WB, state_.v_WB, state_.q_WB});
  reset_if_broken();
  return Status::kOk;
}

void Estimator::integrate(const Vector3& rate_B_radps, const Vector3& force_B_mps2, double dt_s) noexcept {
  state_.w_WB_B = rate_B_radps - gyro_bias_B_;
  state_.q_WB = (state_.q_WB * small_rotation(dt_s * state_.w_WB_B)).normalized();
  force_W_ = state_.q_WB.toRotationMatrix() * (force_B_mps2 - accel_bias_B_);
  const Vector3 a_W = force_W_ - Vector3(0.0, 0.0, core::kGravity_mps2);
  state_.p_WB += dt_s * state_.v_WB + (0.5 * dt_s * dt_s) * a_W;
  state_.v_WB += dt_s * a_W;
  if (anchor_) shift_.grow(config_.drift_ratio * dt_s * state_.v_WB.norm());
  covariance_dt_s_ += dt_s;
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

void Estimator::begin_filter() noexcept {
  anchor_.reset();
  candidate_.reset();
  fixes_agreed_ = false;
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

void Estimator::start(const firmware_if::GnssFix& fix) noexcept {
  state_.p_WB = to_vector(fix.p_WB_m);
  state_.v_WB = to_vector(fix.v_WB_mps);
  // Level by the accelerometer: the rotation that takes the measured force to the vertical, then the heading.
  const double norm = last_force_B_.norm();
  const Vector3 up_B = norm > 1.0 ? Vector3(last_force_B_ / norm) : Vector3(0.0, 0.0, 1.0);
  const Vector3 axis = up_B.cross(Vector3(0.0, 0.0, 1.0));
  const Quaternion level = Quaternion(1.0 + up_B.z(), axis.x(), axis.y(), axis.z()).normalized();
  const double turn_rad = fix.heading_rad - core::yaw_of(level);
  state_.q_WB = (core::turn_z(turn_rad) * level).normalized();
  shift_.begin(largest_sigma_m(fix));
  begin_filter();
}

void Estimator::start(const firmware_if::OdometrySample& sample, const OdometryState& in_O) noexcept {
  state_.p_WB = in_O.p_m;
  state_.v_WB = in_O.v_mps;
  state_.q_WB = in_O.q;
  shift_.begin(0.0);
  barometer_placed_ = false;
  odometry_stamp_ = sample.stamp;
  begin_filter();
}

Status Estimator::update(const firmware_if::GnssFix& fix) noexcept {
  const Vector3 p_W = to_vector(fix.p_WB_m);
  const Vector3 v_W = to_vector(fix.v_WB_mps);
  if (!is_finite(p_W) || !is_finite(v_W) || !core::is_sigma(fix.sigma_horizontal_m) ||
      !core::is_sigma(fix.sigma_vertical_m) || !core::is_sigma(fix.sigma_speed_mps)) {
    ++counters_.refused_not_finite;
    return Status::kInvalidArgument;
  }
  if (!started_) {
    if (counters_.imu == 0 || !has_heading(fix) || !is_recent(fix.stamp)) return Status::kNotReady;
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
  if (lost_) {
    begin_again(fix);
    return Status::kNotReady;
  }
  if (is_settling(fix.stamp)) return Status::kNotReady;
  const bool moves_alike = fits_in_motion(fix, *then);
  const bool accepted = take(fix, *then, moves_alike);
  if (accepted) ++counters_.gnss;
  if (accepted && moves_alike) fix_agreed_ = fix.stamp;
  if (accepted || follows_odometry(fix.stamp))
    fix_witness_.accepted();
  else
    weigh(fix, *then, moves_alike);
  reset_if_broken();
  return accepted ? Status::kOk : Status::kInvalidArgument;
}

bool Estimator::take(const firmware_if::GnssFix& fix, const PastStates::Past& then,
                     bool moves_alike) noexcept {
  const Vector3 dp_m = to_vector(fix.p_WB_m) - shift_.shift_W() - then.p_WB;
  const Vector3 dv_mps = to_vector(fix.v_WB_mps) - then.v_WB;
  if (follows_odometry(fix.stamp)) return place_frame(fix, dp_m);
  if (largest_sigma_m(fix) > kMapLost_m) return place_coarsely(fix, dp_m, dv_mps, core::yaw_of(then.q_WB));
  const double gate_m = config_.gate_sigma * core::hypot2(largest_sigma_m(fix), largest_sigma(kPosition));
  const bool accepted = correct_by(fix, dp_m, dv_mps, core::yaw_of(then.q_WB));
  // The vehicle did not jump with them: the inertial sensors of this second would have felt it.
  fixes_agreed_ = fixes_agreed_ || accepted;
  if (moves_alike && !accepted && fixes_agreed_ && dp_m.norm() > gate_m &&
      shift_.refuse(dp_m, largest_sigma_m(fix), config_.gate_sigma, fix.stamp) ==
          FrameShift::Verdict::kJumped)
    ++counters_.jumps;
  return accepted;
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
  if (!barometer_placed_) barometer_shift_m_ = sample.altitude_m - then->p_WB.z();
  barometer_placed_ = true;
  const double dz_m = sample.altitude_m - barometer_shift_m_ - then->p_WB.z();
  if (follows_odometry(sample.stamp)) {
    const double most_m = config_.gate_sigma * config_.barometer_sigma_m;  // nonsense does not carry it away
    barometer_shift_m_ += kBarometerGain * std::clamp(dz_m, -most_m, most_m);
    ++counters_.barometer;
    return Status::kOk;
  }
  if (!correct(kPosition + 2, dz_m, config_.barometer_sigma_m)) return Status::kInvalidArgument;
  ++counters_.barometer;
  reset_if_broken();
  return Status::kOk;
}

Estimator::Innovation Estimator::innovation_of(const firmware_if::OdometrySample& sample,
                                               const OdometryState& in_W,
                                               const PastStates::Past& then) noexcept {
  const Quaternion turn = in_W.q * then.q_WB.conjugate();
  const double sign = turn.w() < 0.0 ? -2.0 : 2.0;
  return {in_W.p_m - then.p_WB,
          sign * turn.vec(),
          in_W.v_mps - then.v_WB,
          std::fmax(sample.sigma_position_m, kLeastSigma_m),
          std::fmax(sample.sigma_attitude_rad, kLeastSigma_rad),
          std::fmax(sample.sigma_speed_mps, kLeastSigma_mps)};
}

bool Estimator::fits(int first, const Vector3& innovation, double sigma) const noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    const double S = P_(first + axis, first + axis) + sigma * sigma;
    if (!(innovation[axis] * innovation[axis] <= config_.gate_sigma * config_.gate_sigma * S)) return false;
  }
  return true;
}

bool Estimator::fits(const Innovation& i) const noexcept {
  return fits(kPosition, i.p_m, i.sigma_p_m) && fits(kAttitude, i.angle_rad, i.sigma_rad) &&
         fits(kVelocity, i.v_mps, i.sigma_mps);
}

void Estimator::correct_by(Innovation i) noexcept {
  constexpr double kLarge_rad = 0.1;
  if (i.angle_rad.norm() > kLarge_rad) {
    // Three axes one after another make no large turn: it is taken as it is.
    const Vector3 half = 0.5 * i.angle_rad;
    const Quaternion turn(std::sqrt(std::fmax(1.0 - half.squaredNorm(), 0.0)), half.x(), half.y(), half.z());
    state_.q_WB = (turn * state_.q_WB).normalized();
    for (int axis = kAttitude; axis < kAttitude + 3; ++axis) set_sigma(axis, i.sigma_rad);
    i.angle_rad.setZero();
  }
  for (int axis = 0; axis < 3; ++axis) {
    (void)correct(kPosition + axis, i.p_m[axis], i.sigma_p_m);
    (void)correct(kAttitude + axis, i.angle_rad[axis], i.sigma_rad);
    (void)correct(kVelocity + axis, i.v_mps[axis], i.sigma_mps);
  }
}

double Estimator::largest_sigma(int first) const noexcept {
  return std::sqrt(
      std::fmax(P_(first, first), std::fmax(P_(first + 1, first + 1), P_(first + 2, first + 2))));
}

bool Estimator::try_anchor(const firmware_if::OdometrySample& sample, const OdometryState& in_O,
                           const PastStates::Past& then) noexcept {
  const bool agrees = candidate_ && candidate_->anchor.reset_counter() == sample.reset_counter &&
                      fits(innovation_of(sample, candidate_->anchor.in_W(in_O), then));
  if (!agrees) {
    // A frame that lies where it lay stays; and one that is where the vehicle is believed to be is worth no more than that belief.
    const bool is_same = anchor_ && anchor_->reset_counter() == sample.reset_counter &&
                         fits(innovation_of(sample, anchor_->in_W(in_O), then));
    candidate_.reset();
    if (is_same)
      candidate_ = Candidate{*anchor_, sample.stamp};
    else if (largest_sigma(kAttitude) < kMostAnchored_rad && largest_sigma(kVelocity) < kMostAnchored_mps)
      candidate_ = Candidate{OdometryAnchor(in_O, then, sample.reset_counter), sample.stamp};
    return false;
  }
  if (sample.stamp - candidate_->since < kAnchorPatience) return false;
  if (largest_sigma(kPosition) > kMapLost_m) ++map_number_;
  anchor_ = candidate_->anchor;
  ++counters_.anchored;
  return true;
}

Status Estimator::update(const firmware_if::OdometrySample& sample) noexcept {
  OdometryState in_O;
  if (read_odometry(sample, in_O) != Status::kOk) {
    ++counters_.refused_not_finite;
    return Status::kInvalidArgument;
  }
  if (!started_) {
    if (counters_.imu == 0 || !is_recent(sample.stamp)) return Status::kNotReady;
    if (first_odometry_ == MonotonicTime{}) first_odometry_ = sample.stamp;
    if (sample.stamp - first_odometry_ >= kFixPatience) start(sample, in_O);
    return Status::kNotReady;
  }
  const PastStates::Past* then = past_.at(sample.stamp);
  if (sample.stamp <= odometry_stamp_ || then == nullptr) {
    ++counters_.refused_stamp;
    return Status::kStale;
  }
  odometry_stamp_ = sample.stamp;
  if (lost_) {
    begin_again(sample, in_O, *then);
    return Status::kNotReady;
  }
  if (is_settling(sample.stamp)) return Status::kNotReady;
  // What was lost for long has to agree with itself again, as at its start.
  const bool follows = follows_odometry(sample.stamp) && anchor_->reset_counter() == sample.reset_counter &&
                       fits(innovation_of(sample, anchor_->in_W(in_O), *then));
  if (!follows) {
    ++counters_.refused_gate;
    if (!try_anchor(sample, in_O, *then)) {
      if (is_lost_to(sample, in_O)) begin_again(sample, in_O, *then);
      return Status::kNotReady;
    }
  }
  odometry_witness_.accepted();
  candidate_.reset();
  last_odometry_ = sample.stamp;
  correct_by(innovation_of(sample, anchor_->in_W(in_O), *then));
  ++counters_.odometry;
  reset_if_broken();
  return Status::kOk;
}

bool Estimator::place_frame(const firmware_if::GnssFix& fix, const Vector3& innovation_m) noexcept {
  const auto verdict = shift_.update(innovation_m, largest_sigma_m(fix), config_.gate_sigma, fix.stamp);
  if (verdict == FrameShift::Verdict::kRefused) {
    ++counters_.refused_gate;
    return false;
  }
  if (verdict == FrameShift::Verdict::kJumped) {
    // The odometry may have slipped as well as the fixes: what was mapped before may lie elsewhere.
    ++counters_.jumps;
    ++map_number_;
  }
  return true;
}

bool Estimator::place_coarsely(const firmware_if::GnssFix& fix, const Vector3& dp_m, const Vector3& dv_mps,
                               double yaw_rad) noexcept {
  const auto verdict = shift_.update(dp_m, largest_sigma_m(fix), config_.gate_sigma, fix.stamp);
  if (verdict == FrameShift::Verdict::kRefused) ++counters_.refused_gate;
  if (verdict == FrameShift::Verdict::kJumped) ++counters_.jumps;
  // No innovation of the position: it keeps the variance from growing, as a fix does, and moves nothing.
  return correct_by(fix, Vector3::Zero(), dv_mps, yaw_rad) && verdict != FrameShift::Verdict::kRefused;
}

void Estimator::move_frame(const EstimatedState& next, bool hold) noexcept {
  constexpr double kTurned_rad = 0.035;
  const double gap_s = seconds(next.stamp - state_.stamp);
  const Quaternion expected = state_.q_WB * small_rotation(gap_s * state_.w_WB_B);
  const double turned_rad = core::wrap_angle(core::yaw_of(next.q_WB) - core::yaw_of(expected));
  const Vector3 expected_W = state_.p_WB + gap_s * state_.v_WB;
  followed_shift_W_ = hold ? Vector3(next.p_WB - expected_W) : Vector3::Zero();
  if (!hold || gap_s > seconds(kOldestState) || !(std::fabs(turned_rad) < kTurned_rad)) ++map_number_;
  ++counters_.jumps;
}

Status Estimator::follow(const firmware_if::AutopilotState& sample, MonotonicTime now,
                         bool hold_frame) noexcept {
  const Nanos age = now - sample.stamp;
  if (age < Nanos{0} || age > kOldestState || (started_ && now <= state_.stamp)) {
    ++counters_.refused_stamp;
    return Status::kStale;
  }
  const Vector3 p_WB = to_vector(sample.p_WB_m);
  const Vector3 v_WB = to_vector(sample.v_WB_mps);
  const Vector3 w_WB_B = to_vector(sample.w_WB_B_radps);
  const Quaternion q_WB(sample.q_WB[0], sample.q_WB[1], sample.q_WB[2], sample.q_WB[3]);
  if (!is_finite(p_WB) || !is_finite(v_WB) || !is_finite(w_WB_B) || !q_WB.coeffs().allFinite() ||
      !(std::fabs(q_WB.squaredNorm() - 1.0) < 0.02)) {
    ++counters_.refused_not_finite;
    return Status::kInvalidArgument;
  }
  const double dt_s = seconds(age);
  EstimatedState next = state_;
  next.stamp = now;
  next.p_WB = p_WB + dt_s * v_WB;
  next.v_WB = v_WB;
  next.q_WB = (q_WB * small_rotation(dt_s * w_WB_B)).normalized();
  next.w_WB_B = w_WB_B;
  if (!started_)
    begin_filter();
  else if (sample.frame_number != followed_frame_)
    move_frame(next, hold_frame);
  followed_frame_ = sample.frame_number;
  next.p_WB -= followed_shift_W_;
  state_ = next;
  past_.add({state_.stamp, state_.p_WB, state_.v_WB, state_.q_WB});
  return Status::kOk;
}

Status Estimator::state(EstimatedState& out) const noexcept {
  if (!started_) return Status::kNotReady;
  out = state_;
  out.map_sigma_m = largest_sigma(kPosition);
  out.map_sigma_rad = largest_sigma(kAttitude);
  out.shift_W = shift_.shift_W() + followed_shift_W_;
  out.drift_ratio = anchor_ ? config_.drift_ratio : 0.0;
  const bool is_shifted = anchor_ || shift_.sigma_m() > kMapLost_m;
  out.position_sigma_m = is_shifted ? core::hypot2(out.map_sigma_m, shift_.sigma_m()) : out.map_sigma_m;
  out.map_number = map_number_;
  return Status::kOk;
}

}  // namespace roborun::stages
