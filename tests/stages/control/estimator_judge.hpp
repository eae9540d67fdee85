/// The rules of estimator.hpp a second time, without its ways: sums of products over plain arrays, one function for each sensor. It is
/// built of the same parts (PastStates, FrameShift, Witness, OdometryAnchor), which have tests of their own.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "stages/control/estimator.hpp"

namespace roborun::stages::judge {

constexpr double ms(double x) { return x * 1e-3; }
inline Vector3 vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
inline double s_of(Nanos t) { return 1e-9 * static_cast<double>(t.count()); }

inline Quaternion unit(double w, double x, double y, double z) {
  const double n = std::sqrt(w * w + x * x + y * y + z * z);
  return {w / n, x / n, y / n, z / n};
}
inline Quaternion times(const Quaternion& a, const Quaternion& b) {
  return unit(a.w() * b.w() - a.x() * b.x() - a.y() * b.y() - a.z() * b.z(),
              a.w() * b.x() + a.x() * b.w() + a.y() * b.z() - a.z() * b.y(),
              a.w() * b.y() - a.x() * b.z() + a.y() * b.w() + a.z() * b.x(),
              a.w() * b.z() + a.x() * b.y() - a.y() * b.x() + a.z() * b.w());
}
/// cos and sin of half of a small angle, to second order.
inline Quaternion turned_by(const Vector3& r) {
  const double square = r.x() * r.x() + r.y() * r.y() + r.z() * r.z();
  return unit(1.0 - square / 8.0, r.x() / 2.0, r.y() / 2.0, r.z() / 2.0);
}
inline Vector3 rotated(const Quaternion& q, const Vector3& v) {
  const Vector3 u(q.x(), q.y(), q.z());
  return v + 2.0 * q.w() * u.cross(v) + 2.0 * u.cross(u.cross(v));
}
/// The smallest turn from one direction to another; nothing where they are opposite.
inline Quaternion between(const Vector3& from, const Vector3& to, double least) {
  const double along = 1.0 + from.dot(to);
  if (along <= least) return Quaternion::Identity();
  const Vector3 axis = from.cross(to);
  return unit(along, axis.x(), axis.y(), axis.z());
}

class Estimator {
 public:
  using Fix = firmware_if::GnssFix;
  using Odometry = firmware_if::OdometrySample;
  stages::Estimator::Counters n{};

  explicit Estimator(const stages::Estimator::Config& config) : c_(config), past_(config.oldest_fix) {}

  Status predict(const firmware_if::ImuSample& s) {
    const Vector3 rate = vec(s.angular_rate_B_radps), force = vec(s.specific_force_B_mps2);
    if (!rate.allFinite() || !force.allFinite())
      return refuse(n.refused_not_finite, Status::kInvalidArgument);
    const bool first = n.imu == 0;
    if (!first && !is_regular(s.stamp)) {
      if (!is_new_clock(s.stamp)) return refuse(n.refused_stamp, Status::kStale);
      ++n.clock_resets;
      lost_ = true;
      x_.stamp = s.stamp;
      past_.clear();
      gnss_at_ = barometer_at_ = odometry_heard_ = odometry_at_ = odometry_first_ = motion_agreed_ = {};
    }
    ++n.imu;
    const double dt = first ? 0.0 : s_of(s.stamp - x_.stamp);
    const Vector3 leap_rate = first ? Vector3(0, 0, 0) : Vector3(rate - rate_);
    const Vector3 leap_force = first ? Vector3(0, 0, 0) : Vector3(force - force_);
    x_.stamp = s.stamp;
    rate_ = rate;
    force_ = force;
    felt_ = first ? force : Vector3(0.95 * felt_ + 0.05 * force);
    if (!started_) return Status::kOk;
    // The mean of two samples, where they lie far apart.
    const double share = dt > ms(20) ? 0.5 : 0.0;
    step(rate - share * leap_rate, force - share * leap_force, dt);
    widen(leap_rate.norm(), leap_force.norm(), dt);
    unpropagated_s_ += dt;
    if (++samples_ == 4) propagate();
    past_.add({x_.stamp, x_.p_WB, x_.v_WB, x_.q_WB});
    notice_what_is_broken();
    return Status::kOk;
  }

  Status update(const Fix& fix) {
    const double sigma_m = most_of(fix);
    if (!vec(fix.p_WB_m).allFinite() || !vec(fix.v_WB_mps).allFinite() || !is_sigma(fix.sigma_horizontal_m) ||
        !is_sigma(fix.sigma_vertical_m) || !is_sigma(fix.sigma_speed_mps))
      return refuse(n.refused_not_finite, Status::kInvalidArgument);
    if (!started_) {
      if (n.imu == 0 || !has_heading(fix) || !is_recent(fix.stamp)) return Status::kNotReady;
      ++n.gnss;
      gnss_at_ = fix.stamp;
      x_.p_WB = vec(fix.p_WB_m);
      x_.v_WB = vec(fix.v_WB_mps);
      const Vector3 up = force_.norm() > 1.0 ? Vector3(force_.normalized()) : Vector3(0, 0, 1);
      const Quaternion level = between(up, {0, 0, 1}, -1.0);
      x_.q_WB = times(about_z(fix.heading_rad - core::yaw_of(level)), level);
      shift_.begin(sigma_m);
      begin();
      return Status::kOk;
    }
    const PastStates::Past* then = compared_with(fix.stamp, gnss_at_);
    if (then == nullptr) return refuse(n.refused_stamp, Status::kStale);
    if (lost_) {
      begin_from(fix);
      return Status::kNotReady;
    }
    if (is_settling(fix.stamp)) return Status::kNotReady;
    const double turn = has_heading(fix) ? core::wrap_angle(fix.heading_rad - core::yaw_of(then->q_WB)) : 0.0;
    const Vector3 dv = vec(fix.v_WB_mps) - then->v_WB, dp = vec(fix.p_WB_m) - shift_.shift_W() - then->p_WB;
    const bool speed_fits = fits(3, dv, fix.sigma_speed_mps);
    const bool moves_alike =
        speed_fits && fits(6, {0, 0, turn}, has_heading(fix) ? fix.sigma_heading_rad : 1.0);
    const bool holds = follows(fix.stamp);
    bool accepted = true;
    if (holds || sigma_m > 0.3) {  // it says where the frame is
      const auto verdict = shift_.update(dp, sigma_m, c_.gate_sigma, fix.stamp);
      accepted = verdict != FrameShift::Verdict::kRefused;
      n.refused_gate += accepted ? 0 : 1;
      n.jumps += verdict == FrameShift::Verdict::kJumped ? 1 : 0;
      if (holds && verdict == FrameShift::Verdict::kJumped) ++x_.map_number;
      if (!holds) accepted = believe(fix, {0, 0, 0}, dv, turn) && accepted;
    } else {
      const double gate_m = c_.gate_sigma * std::hypot(sigma_m, sigma_of(0));
      accepted = believe(fix, dp, dv, turn);
      agreed_once_ = agreed_once_ || accepted;
      if (!accepted && moves_alike && agreed_once_ && dp.norm() > gate_m &&
          shift_.refuse(dp, sigma_m, c_.gate_sigma, fix.stamp) == FrameShift::Verdict::kJumped)
        ++n.jumps;
    }
    n.gnss += accepted ? 1 : 0;
    if (accepted && moves_alike) motion_agreed_ = fix.stamp;
    if (accepted || follows(fix.stamp))
      of_fixes_.accepted();
    else
      weigh(fix, turn, moves_alike, dv);
    notice_what_is_broken();
    return accepted ? Status::kOk : Status::kInvalidArgument;
  }

  Status update(const firmware_if::BarometerSample& b) {
    if (!std::isfinite(b.altitude_m)) return refuse(n.refused_not_finite, Status::kInvalidArgument);
    if (!started_) return Status::kNotReady;
    const PastStates::Past* then = compared_with(b.stamp, barometer_at_);
    if (then == nullptr) return refuse(n.refused_stamp, Status::kStale);
    if (!placed_) zero_m_ = b.altitude_m - then->p_WB.z();
    placed_ = true;
    const double dz = b.altitude_m - zero_m_ - then->p_WB.z();
    if (follows(b.stamp)) {
      const double most = c_.gate_sigma * c_.barometer_sigma_m;
      zero_m_ += 0.01 * std::min(std::max(dz, -most), most);
    } else if (!correct(2, dz, c_.barometer_sigma_m)) {
      return Status::kInvalidArgument;
    } else {
      notice_what_is_broken();
    }
    ++n.barometer;
    return Status::kOk;
  }

  Status update(const Odometry& s) {
    OdometryState o;
    if (read_odometry(s, o) != Status::kOk) return refuse(n.refused_not_finite, Status::kInvalidArgument);
    if (!started_) {
      if (n.imu == 0 || !is_recent(s.stamp)) return Status::kNotReady;
      if (odometry_first_ == MonotonicTime{}) odometry_first_ = s.stamp;
      if (s_of(s.stamp - odometry_first_) < 2.0) return Status::kNotReady;
      x_.p_WB = o.p_m;
      x_.v_WB = o.v_mps;
      x_.q_WB = o.q;
      shift_.begin(0.0);
      placed_ = false;
      odometry_at_ = s.stamp;
      begin();
      return Status::kNotReady;
    }
    const PastStates::Past* then = compared_with(s.stamp, odometry_at_);
    if (then == nullptr) return refuse(n.refused_stamp, Status::kStale);
    if (lost_) {
      begin_from(s, o, *then);
      return Status::kNotReady;
    }
    if (is_settling(s.stamp)) return Status::kNotReady;
    const bool known = anchor_ && anchor_->reset_counter() == s.reset_counter;
    if (!(known && follows(s.stamp) && lies(*anchor_, s, o, *then))) {
      ++n.refused_gate;
      if (!anchored(s, o, *then, known)) {
        const Nanos agreed = of_odometry_.refused(
            {s.stamp, o.p_m, o.v_mps, s.sigma_position_m, s.sigma_speed_mps}, c_.gate_sigma);
        if (s_of(s.stamp - motion_agreed_) > 0.5 && s_of(agreed) >= 0.6) begin_from(s, o, *then);
        return Status::kNotReady;
      }
    }
    of_odometry_.accepted();
    candidate_.reset();
    odometry_heard_ = s.stamp;
    const Besides d = besides(*anchor_, s, o, *then);
    Vector3 turn = d.turn;
    if (turn.norm() > 0.1) {  // at once
      const double half = turn.norm() / 2.0;
      x_.q_WB =
          times(unit(std::sqrt(std::max(1.0 - half * half, 0.0)), turn.x() / 2, turn.y() / 2, turn.z() / 2),
                x_.q_WB);
      for (int i = 6; i < 9; ++i) set_sigma(i, d.s_turn);
      turn.setZero();
    }
    for (int i = 0; i < 3; ++i) {
      (void)correct(i, d.p[i], d.s_p);
      (void)correct(6 + i, turn[i], d.s_turn);
      (void)correct(3 + i, d.v[i], d.s_v);
    }
    ++n.odometry;
    notice_what_is_broken();
    return Status::kOk;
  }

  Status state(EstimatedState& out) const {
    if (!started_) return Status::kNotReady;
    out = x_;
    out.map_sigma_m = sigma_of(0);
    out.map_sigma_rad = sigma_of(6);
    out.shift_W = shift_.shift_W();
    out.drift_ratio = anchor_ ? c_.drift_ratio : 0.0;
    out.position_sigma_m = sigma_of(0);
    if (anchor_ || shift_.sigma_m() > 0.3) out.position_sigma_m = std::hypot(sigma_of(0), shift_.sigma_m());
    return Status::kOk;
  }

 private:
  struct Besides {
    Vector3 p, turn, v;
    double s_p, s_turn, s_v;
  };
  struct Candidate {
    OdometryAnchor anchor;
    MonotonicTime since;
  };

  static Status refuse(std::uint64_t& counter, Status why) {
    ++counter;
    return why;
  }
  static bool is_sigma(double s) { return s > 0.0 && std::isfinite(s); }
  static bool has_heading(const Fix& fix) {
    return std::isfinite(fix.heading_rad) && fix.sigma_heading_rad > 0.0;
  }
  static double most_of(const Fix& fix) { return std::max(fix.sigma_horizontal_m, fix.sigma_vertical_m); }
  static Quaternion about_z(double a) { return unit(std::cos(a / 2.0), 0.0, 0.0, std::sin(a / 2.0)); }
  bool is_recent(MonotonicTime t) const { return t <= x_.stamp && t + c_.oldest_fix >= x_.stamp; }
  bool follows(MonotonicTime t) const { return anchor_ && s_of(t - odometry_heard_) <= 0.5; }

  /// Null: the sample is not newer than the `last` of its sensor, or nobody remembers its time.
  const PastStates::Past* compared_with(MonotonicTime t, MonotonicTime& last) const {
    const PastStates::Past* then = t > last ? past_.at(t) : nullptr;
    if (then != nullptr) last = t;
    return then;
  }
  bool is_regular(MonotonicTime t) {
    if (t <= x_.stamp || s_of(t - x_.stamp) > 0.5) return false;
    odd_last_ = {};
    return true;
  }
  /// All of 100 ms are odd, in their order and close to one another.
  bool is_new_clock(MonotonicTime t) {
    const bool goes_on = odd_last_ != MonotonicTime{} && t > odd_last_ && s_of(t - odd_last_) <= 0.1;
    if (!goes_on) odd_first_ = t;
    odd_last_ = t;
    if (s_of(t - odd_first_) < 0.1) return false;
    odd_last_ = {};
    return true;
  }

  void step(const Vector3& rate, const Vector3& force, double dt) {
    x_.w_WB_B = rate - bias_rate_;
    x_.q_WB = times(x_.q_WB, turned_by(dt * x_.w_WB_B));
    force_W_ = rotated(x_.q_WB, force - bias_force_);
    const Vector3 a(force_W_.x(), force_W_.y(), force_W_.z() - core::kGravity_mps2);
    x_.p_WB += dt * (x_.v_WB + dt / 2.0 * a);
    x_.v_WB += dt * a;
    if (anchor_) shift_.grow(c_.drift_ratio * dt * x_.v_WB.norm());
  }
  void widen(double leap_radps, double leap_mps2, double dt) {
    const double hole = std::max(dt - ms(20), 0.0);
    double angle = hole * 1.0, speed = hole * 4.0;
    if (leap_radps > 2.0) angle += dt * leap_radps;
    if (leap_mps2 > 40.0) speed += dt * leap_mps2;
    if (angle == 0.0 && speed == 0.0) return;
    if (angle > 0.02 || speed > 0.2) corrected_ = x_.stamp;
    for (std::size_t i = 0; i < 3; ++i) {
      P_[i][i] += std::pow(hole * speed / 2.0, 2);
      P_[3 + i][3 + i] += speed * speed;
      double& a = P_[6 + i][6 + i];
      a = std::max(a, std::min(a + angle * angle, 0.25));
    }
  }
  void propagate() {
    const double dt = unpropagated_s_;
    samples_ = 0;
    unpropagated_s_ = 0.0;
    Matrix F{};
    for (std::size_t i = 0; i < 15; ++i) F[i][i] = 1.0;
    const Matrix3 R = x_.q_WB.toRotationMatrix();
    for (std::size_t i = 0; i < 3; ++i) {
      F[i][3 + i] = dt;
      for (std::size_t k = 0; k < 3; ++k)
        F[3 + i][12 + k] = F[6 + i][9 + k] = -dt * R(static_cast<int>(i), static_cast<int>(k));
      const std::size_t j = (i + 1) % 3, l = (i + 2) % 3;  // dv = -f x d(angle)
      F[3 + i][6 + l] = -dt * force_W_[static_cast<int>(j)];
      F[3 + i][6 + j] = dt * force_W_[static_cast<int>(l)];
    }
    Matrix G{}, next{};
    for (std::size_t i = 0; i < 15; ++i)
      for (std::size_t j = 0; j < 15; ++j)
        for (std::size_t k = 0; k < 15; ++k) G[i][j] += F[i][k] * P_[k][j];
    for (std::size_t i = 0; i < 15; ++i)
      for (std::size_t j = 0; j < 15; ++j)
        for (std::size_t k = 0; k < 15; ++k) next[i][j] += G[i][k] * F[j][k];
    P_ = next;
    for (std::size_t i = 0; i < 3; ++i) {
      P_[3 + i][3 + i] += std::pow(c_.accel_noise_mps2 * dt, 2) / 4.0;  // four samples
      P_[6 + i][6 + i] += std::pow(c_.gyro_noise_radps * dt, 2) / 4.0;
      P_[9 + i][9 + i] += std::pow(c_.gyro_bias_walk_radps, 2) * dt;
      P_[12 + i][12 + i] += std::pow(c_.accel_bias_walk_mps2, 2) * dt;
    }
  }
  double sigma_of(std::size_t i) const {
    return std::sqrt(std::max({P_[i][i], P_[i + 1][i + 1], P_[i + 2][i + 2]}));
  }
  bool fits(int first, const Vector3& d, double sigma) const {
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(first + i);
      if (!(d[i] * d[i] <= c_.gate_sigma * c_.gate_sigma * (P_[k][k] + sigma * sigma))) return false;
    }
    return true;
  }
  bool correct(int index, double d, double sigma) {
    const auto at = static_cast<std::size_t>(index);
    const double S = P_[at][at] + sigma * sigma;
    if (!(d * d <= c_.gate_sigma * c_.gate_sigma * S)) {
      ++n.refused_gate;
      return false;
    }
    std::array<double, 15> column{}, dx{};
    for (std::size_t i = 0; i < 15; ++i) column.at(i) = P_[i][at];
    const auto row = P_[at];
    for (std::size_t i = 0; i < 15; ++i) dx.at(i) = column.at(i) / S * d;
    for (std::size_t i = 0; i < 15; ++i)
      for (std::size_t j = 0; j < 15; ++j) P_[i][j] -= column.at(i) * row.at(j) / S;
    for (std::size_t i = 0; i < 15; ++i)
      for (std::size_t j = 0; j < i; ++j) P_[i][j] = P_[j][i] = (P_[i][j] + P_[j][i]) / 2.0;
    const auto three = [&](std::size_t i) { return Vector3(dx.at(i), dx.at(i + 1), dx.at(i + 2)); };
    x_.p_WB += three(0);
    x_.v_WB += three(3);
    x_.q_WB = times(turned_by(three(6)), x_.q_WB);
    bias_rate_ += three(9);
    bias_force_ += three(12);
    return true;
  }
  bool believe(const Fix& fix, const Vector3& dp, const Vector3& dv, double turn) {
    int refused = 0;
    const std::array sigma_m{fix.sigma_horizontal_m, fix.sigma_horizontal_m, fix.sigma_vertical_m};
    for (int i = 0; i < 3; ++i)
      refused += correct(i, dp[i], std::max(sigma_m.at(static_cast<std::size_t>(i)), 0.02)) ? 0 : 1;
    for (int i = 0; i < 3; ++i) refused += correct(3 + i, dv[i], fix.sigma_speed_mps) ? 0 : 1;
    if (has_heading(fix)) refused += correct(8, turn, fix.sigma_heading_rad) ? 0 : 1;
    return refused == 0;
  }
  void weigh(const Fix& fix, double turn, bool moves_alike, const Vector3& dv) {
    const bool alike =
        has_heading(fix) && fix.heading_rad != heading_before_ &&
        std::abs(core::wrap_angle(turn - turn_before_)) <= c_.gate_sigma * 1.5 * fix.sigma_heading_rad;
    alike_ = alike ? alike_ + 1 : 0;
    turn_before_ = turn;
    heading_before_ = fix.heading_rad;
    const Nanos agreed = of_fixes_.refused(
        {fix.stamp, vec(fix.p_WB_m), vec(fix.v_WB_mps), most_of(fix), fix.sigma_speed_mps}, c_.gate_sigma);
    if (moves_alike || s_of(agreed) < 0.6) return;
    if (!fits(3, dv, fix.sigma_speed_mps)) {
      begin_from(fix);
    } else if (alike_ >= 4) {
      x_.q_WB = times(about_z(turn), x_.q_WB);
      set_sigma(8, 2.0 * fix.sigma_heading_rad);
      past_.clear();
      of_fixes_ = {};
      ++n.resets;
      ++x_.map_number;
    }
  }
  bool is_settling(MonotonicTime t) {
    if (t <= corrected_) return true;
    if (std::max(P_[6][6], P_[7][7]) > 0.025 * 0.025) corrected_ = x_.stamp;
    return false;
  }
  static Besides besides(const OdometryAnchor& anchor, const Odometry& s, const OdometryState& o,
                         const PastStates::Past& then) {
    const OdometryState w = anchor.in_W(o);
    const Quaternion d = times(w.q, then.q_WB.conjugate());
    const double sign = d.w() < 0.0 ? -2.0 : 2.0;
    return {w.p_m - then.p_WB,
            {sign * d.x(), sign * d.y(), sign * d.z()},
            w.v_mps - then.v_WB,
            std::max(s.sigma_position_m, 0.02),
            std::max(s.sigma_attitude_rad, 0.005),
            std::max(s.sigma_speed_mps, 0.05)};
  }
  bool lies(const OdometryAnchor& anchor, const Odometry& s, const OdometryState& o,
            const PastStates::Past& then) const {
    const Besides d = besides(anchor, s, o, then);
    return fits(0, d.p, d.s_p) && fits(6, d.turn, d.s_turn) && fits(3, d.v, d.s_v);
  }
  /// One that is not followed: for 200 ms it agrees with a place of its frame, then it is.
  bool anchored(const Odometry& s, const OdometryState& o, const PastStates::Past& then, bool known) {
    if (candidate_ && candidate_->anchor.reset_counter() == s.reset_counter &&
        lies(candidate_->anchor, s, o, then)) {
      if (s_of(s.stamp - candidate_->since) < 0.2) return false;
      if (sigma_of(0) > 0.3) ++x_.map_number;
      anchor_ = candidate_->anchor;
      ++n.anchored;
      return true;
    }
    candidate_.reset();
    if (known && lies(*anchor_, s, o, then))
      candidate_ = Candidate{*anchor_, s.stamp};
    else if (sigma_of(6) < 0.12 && sigma_of(3) < 1.0)
      candidate_ = Candidate{OdometryAnchor(o, then, s.reset_counter), s.stamp};
    return false;
  }
  void set_sigma(int index, double sigma) {
    const auto at = static_cast<std::size_t>(index);
    for (std::size_t i = 0; i < 15; ++i) P_[at][i] = P_[i][at] = 0.0;
    P_[at][at] = sigma * sigma;
  }
  void begin() {
    anchor_.reset();
    candidate_.reset();
    agreed_once_ = false;
    bias_rate_.setZero();
    bias_force_.setZero();
    force_W_ = {0.0, 0.0, core::kGravity_mps2};
    P_ = {};
    for (int i = 0; i < 3; ++i) {
      set_sigma(i, 0.05);
      set_sigma(3 + i, 0.1);
      set_sigma(6 + i, 0.02);
      set_sigma(9 + i, 0.005);
      set_sigma(12 + i, 0.1);
    }
    past_.clear();
    samples_ = 0;
    unpropagated_s_ = 0.0;
    started_ = true;
  }
  void begin_in_flight(const Vector3& p, const Vector3& v, const Quaternion& q, double age) {
    x_.p_WB = p + age * v;
    x_.v_WB = v;
    x_.q_WB = q;
    begin();
    for (int i = 0; i < 3; ++i) {
      set_sigma(i, 0.3);
      set_sigma(3 + i, 0.5);
      set_sigma(6 + i, 0.15);
    }
    of_fixes_ = of_odometry_ = {};
    lost_ = placed_ = false;
    corrected_ = x_.stamp;
    ++n.resets;
    ++x_.map_number;
  }
  void begin_from(const Fix& fix) {
    const Vector3 a = of_fixes_.acceleration_mps2();
    const Vector3 needed = Vector3(a.x(), a.y(), a.z() + core::kGravity_mps2).normalized();
    const Vector3 felt = felt_.norm() > 1.0 ? Vector3(felt_.normalized()) : Vector3(0, 0, 1);
    const Quaternion tilt = between(felt, needed, 0.1);
    const double yaw = has_heading(fix) ? fix.heading_rad : core::yaw_of(x_.q_WB);
    const double turn = core::wrap_angle(yaw - core::yaw_of(tilt));
    const double sine = std::sin(turn / 2.0);
    const Quaternion q =
        times(unit(std::cos(turn / 2.0), sine * needed.x(), sine * needed.y(), sine * needed.z()), tilt);
    const double age = s_of(x_.stamp - fix.stamp);
    const std::optional<OdometryAnchor> anchor = anchor_;
    begin_in_flight(vec(fix.p_WB_m) - shift_.shift_W(), vec(fix.v_WB_mps) + age * a, q, age);
    anchor_ = anchor;
  }
  void begin_from(const Odometry& s, const OdometryState& o, const PastStates::Past& then) {
    const bool known = anchor_ && anchor_->reset_counter() == s.reset_counter;
    const OdometryAnchor anchor = known ? *anchor_ : OdometryAnchor(o, then, s.reset_counter);
    const OdometryState w = anchor.in_W(o);
    begin_in_flight(w.p_m, w.v_mps, w.q, s_of(x_.stamp - s.stamp));
    anchor_ = anchor;
    shift_.forget();
  }
  void notice_what_is_broken() {
    bool fine = x_.p_WB.allFinite() && x_.v_WB.allFinite() && x_.q_WB.coeffs().allFinite() &&
                bias_rate_.allFinite() && bias_force_.allFinite();
    for (std::size_t i = 0; i < 15; ++i) fine = fine && std::isfinite(P_[i][i]);
    if (fine) return;
    ++n.resets;
    ++x_.map_number;
    started_ = false;
    odometry_first_ = {};
    past_.clear();
  }

  using Matrix = std::array<std::array<double, 15>, 15>;
  stages::Estimator::Config c_;
  EstimatedState x_{};
  Matrix P_{};
  Vector3 bias_rate_{0, 0, 0}, bias_force_{0, 0, 0}, force_W_{0, 0, 0};
  Vector3 rate_{0, 0, 0}, force_{0, 0, 0}, felt_{0, 0, 0};
  bool started_{false}, lost_{false}, agreed_once_{false}, placed_{true};
  int samples_{0}, alike_{0};
  double unpropagated_s_{0.0}, heading_before_{0.0}, turn_before_{0.0}, zero_m_{0.0};
  MonotonicTime odd_first_{}, odd_last_{}, gnss_at_{}, barometer_at_{}, odometry_at_{}, odometry_heard_{},
      odometry_first_{}, motion_agreed_{}, corrected_{};
  PastStates past_;
  FrameShift shift_;
  Witness of_fixes_, of_odometry_;
  std::optional<OdometryAnchor> anchor_;
  std::optional<Candidate> candidate_;
};

}  // namespace roborun::stages::judge
