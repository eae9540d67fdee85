// How the estimator notices that it was spoilt, and what it does then.
#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "stages/control/estimator.hpp"
#include "stages/control/estimator_terms.hpp"

namespace roborun::stages {
namespace {

// Between two samples of the IMU: what is more than in any flight counts as a hole in what is known.
constexpr double kLeap_radps = 2.0;
constexpr double kLeap_mps2 = 40.0;
constexpr double kUnknown_radps = 1.0;  // of the rates and the acceleration in a hole
constexpr double kUnknown_mps2 = 4.0;
constexpr double kMuch_rad = 0.02;  // in one step
constexpr double kMuch_mps = 0.2;
constexpr double kMostAttitude_rad = 0.5;  // more is no small angle
constexpr int kHeadingsAlike = 4;  // in a row, each with news: a compass that says so, not one that fails

}  // namespace

bool Estimator::is_next(MonotonicTime stamp) noexcept {
  if (counters_.imu == 0) return true;
  if (stamp > state_.stamp && stamp - state_.stamp <= kLongestGap) {
    odd_last_ = {};
    return true;
  }
  const Nanos gap = stamp - odd_last_;
  if (odd_last_ == MonotonicTime{} || gap <= Nanos{0} || gap > kClockPatience) odd_since_ = stamp;
  odd_last_ = stamp;
  if (stamp - odd_since_ < kClockPatience) return false;
  ++counters_.clock_resets;
  odd_last_ = {};
  // Nobody knows for how long it was away: the next that says where it is, is believed.
  lost_ = true;
  state_.stamp = stamp;
  past_.clear();
  last_gnss_ = last_barometer_ = last_odometry_ = odometry_stamp_ = first_odometry_ = fix_agreed_ = {};
  return true;
}

void Estimator::grow_between(const Vector3& leap_radps, const Vector3& leap_mps2, double dt_s) noexcept {
  const double hole_s = std::fmax(dt_s - kLongStep_s, 0.0);
  const double turn_radps = leap_radps.norm(), push_mps2 = leap_mps2.norm();
  const bool leaps = turn_radps > kLeap_radps || push_mps2 > kLeap_mps2;
  if (hole_s <= 0.0 && !leaps) return;
  const double angle_rad = hole_s * kUnknown_radps + (turn_radps > kLeap_radps ? dt_s * turn_radps : 0.0);
  const double speed_mps = hole_s * kUnknown_mps2 + (push_mps2 > kLeap_mps2 ? dt_s * push_mps2 : 0.0);
  const double place_m = 0.5 * hole_s * speed_mps;
  // What was measured before does not know of it, and would shrink what has just grown.
  if (angle_rad > kMuch_rad || speed_mps > kMuch_mps) corrected_ = state_.stamp;
  for (int i = 0; i < 3; ++i) {
    P_(kPosition + i, kPosition + i) += place_m * place_m;
    P_(kVelocity + i, kVelocity + i) += speed_mps * speed_mps;
    double& attitude = P_(kAttitude + i, kAttitude + i);
    attitude = std::fmax(attitude,
                         std::fmin(attitude + angle_rad * angle_rad, kMostAttitude_rad * kMostAttitude_rad));
  }
}

void Estimator::begin_again(const Vector3& p_WB, const Vector3& v_WB, const Quaternion& q_WB,
                            Nanos age) noexcept {
  constexpr double kPosition_m = 0.3, kVelocity_mps = 0.5, kAttitude_rad = 0.15;
  state_.p_WB = p_WB + seconds(age) * v_WB;
  state_.v_WB = v_WB;
  state_.q_WB = q_WB;
  const std::optional<OdometryAnchor> anchor = anchor_;
  begin_filter();
  anchor_ = anchor;
  for (int i = 0; i < 3; ++i) {
    set_sigma(kPosition + i, kPosition_m);
    set_sigma(kVelocity + i, kVelocity_mps);
    set_sigma(kAttitude + i, kAttitude_rad);
  }
  fix_witness_ = odometry_witness_ = {};
  lost_ = barometer_placed_ = false;
  corrected_ = state_.stamp;
  ++counters_.resets;
  ++map_number_;
}

void Estimator::begin_again(const firmware_if::GnssFix& fix) noexcept {
  // The thrust points where the acceleration needs it, not up: the force that is felt has to be turned into that.
  const Vector3 acceleration_W = fix_witness_.acceleration_mps2();
  const Vector3 force_W = (acceleration_W + Vector3(0.0, 0.0, core::kGravity_mps2)).normalized();
  const double felt_mps2 = mean_force_B_.norm();
  const Vector3 felt_B = felt_mps2 > 1.0 ? Vector3(mean_force_B_ / felt_mps2) : Vector3(0.0, 0.0, 1.0);
  const Vector3 axis = felt_B.cross(force_W);
  const double along = 1.0 + felt_B.dot(force_W);
  Quaternion q_WB = Quaternion::Identity();  // where it is felt upside down, nothing is known of the tilt
  if (along > 0.1) q_WB = Quaternion(along, axis.x(), axis.y(), axis.z()).normalized();
  // A turn about the force leaves that where it is; it turns the heading by as much, nearly.
  const double yaw_rad = has_heading(fix) ? fix.heading_rad : core::yaw_of(state_.q_WB);
  const core::SinCos half = core::sin_cos(0.5 * core::wrap_angle(yaw_rad - core::yaw_of(q_WB)));
  const Vector3 turn = half.sin * force_W;
  q_WB = (Quaternion(half.cos, turn.x(), turn.y(), turn.z()) * q_WB).normalized();
  const Nanos age = state_.stamp - fix.stamp;
  begin_again(to_vector(fix.p_WB_m) - shift_.shift_W(),
              to_vector(fix.v_WB_mps) + seconds(age) * acceleration_W, q_WB, age);
}

void Estimator::begin_again(const firmware_if::OdometrySample& sample, const OdometryState& in_O,
                            const PastStates::Past& then) noexcept {
  // The frame that was anchored is as it was, unless it began anew meanwhile: then it lies where the vehicle was believed to be.
  const bool is_known = anchor_ && anchor_->reset_counter() == sample.reset_counter;
  const OdometryAnchor anchor = is_known ? *anchor_ : OdometryAnchor(in_O, then, sample.reset_counter);
  const OdometryState in_W = anchor.in_W(in_O);
  begin_again(in_W.p_m, in_W.v_mps, in_W.q, state_.stamp - sample.stamp);
  anchor_ = anchor;
  shift_.forget();  // it was learnt by a state that was wrong
}

void Estimator::set_sigma(int index, double sigma) noexcept {
  P_.row(index).setZero();
  P_.col(index).setZero();
  P_(index, index) = sigma * sigma;
}

void Estimator::turn_again(double turn_rad, double sigma_rad) noexcept {
  state_.q_WB = (core::turn_z(turn_rad) * state_.q_WB).normalized();
  set_sigma(kAttitude + 2, 2.0 * sigma_rad);
  past_.clear();
  fix_witness_ = {};
  ++counters_.resets;
  ++map_number_;
}

void Estimator::weigh(const firmware_if::GnssFix& fix, const PastStates::Past& then,
                      bool moves_alike) noexcept {
  const double turn_rad =
      has_heading(fix) ? core::wrap_angle(fix.heading_rad - core::yaw_of(then.q_WB)) : 0.0;
  const bool alike = has_heading(fix) && fix.heading_rad != last_heading_rad_ &&
                     std::fabs(core::wrap_angle(turn_rad - last_turn_rad_)) <=
                         config_.gate_sigma * 1.5 * fix.sigma_heading_rad;
  headings_alike_ = alike ? std::min(headings_alike_ + 1, kHeadingsAlike) : 0;
  last_turn_rad_ = turn_rad;
  last_heading_rad_ = fix.heading_rad;
  const Nanos agreed = fix_witness_.refused(
      {fix.stamp, to_vector(fix.p_WB_m), to_vector(fix.v_WB_mps), largest_sigma_m(fix), fix.sigma_speed_mps},
      config_.gate_sigma);
  if (moves_alike) return;
  if (!fits(kVelocity, to_vector(fix.v_WB_mps) - then.v_WB, fix.sigma_speed_mps)) {
    if (agreed >= Witness::kPatience) begin_again(fix);
  } else if (agreed >= Witness::kPatience && headings_alike_ == kHeadingsAlike) {
    turn_again(turn_rad, fix.sigma_heading_rad);
  }
}

bool Estimator::is_settling(MonotonicTime stamp) noexcept {
  constexpr double kSettled_rad = 0.025;
  const bool is_wide =
      std::fmax(P_(kAttitude, kAttitude), P_(kAttitude + 1, kAttitude + 1)) > kSettled_rad * kSettled_rad;
  if (stamp <= corrected_) return true;
  if (is_wide) corrected_ = state_.stamp;
  return false;
}

bool Estimator::fits_in_motion(const firmware_if::GnssFix& fix, const PastStates::Past& then) const noexcept {
  const double turn_rad =
      has_heading(fix) ? core::wrap_angle(fix.heading_rad - core::yaw_of(then.q_WB)) : 0.0;
  return fits(kVelocity, to_vector(fix.v_WB_mps) - then.v_WB, fix.sigma_speed_mps) &&
         fits(kAttitude, Vector3(0.0, 0.0, turn_rad), has_heading(fix) ? fix.sigma_heading_rad : 1.0);
}

bool Estimator::is_lost_to(const firmware_if::OdometrySample& sample, const OdometryState& in_O) noexcept {
  const Nanos agreed = odometry_witness_.refused(
      {sample.stamp, in_O.p_m, in_O.v_mps, sample.sigma_position_m, sample.sigma_speed_mps},
      config_.gate_sigma);
  if (sample.stamp - fix_agreed_ <= kOdometryLost) return false;
  return agreed >= Witness::kPatience;
}

void Estimator::reset_if_broken() noexcept {
  const bool fine = is_finite(state_.p_WB) && is_finite(state_.v_WB) && state_.q_WB.coeffs().allFinite() &&
                    is_finite(gyro_bias_B_) && is_finite(accel_bias_B_) && P_.diagonal().allFinite();
  if (fine) return;
  ++counters_.resets;
  ++map_number_;
  started_ = false;
  first_odometry_ = {};
  past_.clear();
}

}  // namespace roborun::stages
