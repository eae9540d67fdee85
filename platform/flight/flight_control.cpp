#include "platform/flight/flight_control.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "stages/planning/curve.hpp"

namespace roborun::flight {
namespace {

constexpr Nanos kSettle{1'000'000'000};     // the filter's biases need a second on the ground
constexpr Nanos kHover{300'000'000};        // at the top, before the first decision
constexpr double kGyroRange_radps = 35.0;   // 2,000 degrees a second
constexpr double kAccelRange_mps2 = 157.0;  // 16 g
constexpr double kBrakeShare = 0.625;  // of the limit of acceleration: besides what the path itself needs
constexpr double kTakeOff_mps = 1.5;
constexpr double kTakeOff_mps2 = 1.5;
constexpr double kStand_m = 0.5;
constexpr double kStand_mps = 0.3;
constexpr double kNearGround_m = 1.5;  // over the take-off's height: from there on slowly
constexpr double kTouchdown_mps = 0.5;
constexpr double kBelowGround_m = 500.0;  // the reference goes on until the vehicle stands on something
constexpr Nanos kLanded{1'000'000'000};
constexpr double kNotFollowed_m =
    3.0;  // an autopilot that follows a descent is not so high over its set-point

/// Straight up from the ground to the height of the first hover.
Trajectory take_off(const Vector3& ground_W, double cruise_m, const VehicleModel& vehicle,
                    MonotonicTime start) {
  const Vector3 top_W(ground_W.x(), ground_W.y(), cruise_m);
  stages::Course line;
  (void)line.point_W.push_back(ground_W);
  (void)line.point_W.push_back(top_W);
  TrajectoryPoint ground;
  ground.p_W = ground_W;
  const stages::MotionLimits limits{std::min(kTakeOff_mps, vehicle.climb_mps),
                                    std::min(kTakeOff_mps2, vehicle.acceleration_mps2),
                                    followed_limits(vehicle).jerk_mps3};
  Trajectory t;
  t.start_time = start;
  stages::SegmentParts part{};
  const bool climbs = stages::fit_curve(line, ground, limits, t, part) == stages::CurveFit::kOk;
  return climbs && t.segment_count > 0 ? t : Trajectory::hold(ground_W, start);
}

/// Straight on to rest, its speed along a smooth step: at most 1.5 v / T of acceleration and 6 v / T^2 of jerk.
Trajectory stop_from(const Vector3& p_W, const Vector3& v_W, const VehicleModel& vehicle,
                     MonotonicTime start) {
  const double v_mps = v_W.norm();
  if (v_mps < kStand_mps) return Trajectory::hold(p_W, start);
  const double T_s =
      std::max(1.5 * v_mps / vehicle.acceleration_mps2, std::sqrt(6.0 * v_mps / vehicle.jerk_mps3));
  Trajectory t;
  t.start_time = start;
  t.segment_count = 1;
  t.segment[0].duration_s = T_s;
  t.segment[0].coefficient[0] = p_W;
  t.segment[0].coefficient[1] = v_W;
  t.segment[0].coefficient[3] = -v_W / (T_s * T_s);
  t.segment[0].coefficient[4] = v_W / (2.0 * T_s * T_s * T_s);
  return t;
}

/// Within the range of the sensor; false for NaN.
bool is_plausible(const firmware_if::ImuSample& sample) {
  const auto within = [](const std::array<double, 3>& v, double limit) {
    return std::all_of(v.begin(), v.end(), [limit](double x) { return std::fabs(x) <= limit; });
  };
  return within(sample.angular_rate_B_radps, kGyroRange_radps) &&
         within(sample.specific_force_B_mps2, kAccelRange_mps2);
}

}  // namespace

double braking_mps2(const VehicleModel& vehicle) noexcept {
  // What the path needs and what braking needs together stay within the tilt limit.
  return std::min(kBrakeShare * vehicle.acceleration_mps2,
                  std::max(tilt_acceleration_mps2(vehicle) - vehicle.acceleration_mps2, 0.5));
}

void FlightControl::sense(firmware_if::Imu& imu, firmware_if::Gnss& gnss, firmware_if::Barometer& barometer,
                          firmware_if::Odometry* odometry) {
  // At most a ring's worth a frame, so that a flood of samples cannot hold the lane.
  constexpr int kMost = 16;
  firmware_if::ImuSample sample;
  for (int i = 0; i < kMost && imu.read(sample) == Status::kOk; ++i) {
    const bool same = sample.angular_rate_B_radps == imu_.angular_rate_B_radps &&
                      sample.specific_force_B_mps2 == imu_.specific_force_B_mps2;
    imu_repeats_ = same ? std::min(imu_repeats_ + 1, kMostRepeats) : 0;
    imu_ = sample;
    if (is_plausible(sample)) (void)estimator_.predict(sample);
  }
  firmware_if::OdometrySample seen;
  for (int i = 0; odometry != nullptr && i < kMost && odometry->read(seen) == Status::kOk; ++i) {
    const bool differs = seen.p_OB_m != odometry_.p_OB_m || seen.v_OB_mps != odometry_.v_OB_mps;
    odometry_ = seen;
    if (estimator_.update(seen) == Status::kOk && differs) last_position_ = seen.stamp;
  }
  firmware_if::GnssFix fix;
  for (int i = 0; i < kMost && gnss.read(fix) == Status::kOk; ++i) {
    const bool differs = fix.p_WB_m != fix_.p_WB_m || fix.v_WB_mps != fix_.v_WB_mps;
    fix_ = fix;
    if (estimator_.update(fix) == Status::kOk && differs)
      last_position_ = std::max(last_position_, fix.stamp);
  }
  firmware_if::BarometerSample pressure;
  for (int i = 0; i < kMost && barometer.read(pressure) == Status::kOk; ++i)
    (void)estimator_.update(pressure);
  stages::EstimatedState state;
  if (estimator_.state(state) == Status::kOk) shift_W_ = state.shift_W;
}

void FlightControl::sense(MonotonicTime now, firmware_if::Autopilot& autopilot) {
  constexpr int kMost = 16;
  const MonotonicTime heard = last_position_;
  for (int i = 0; i < kMost && autopilot.read(seen_) == Status::kOk; ++i) last_position_ = seen_.stamp;
  const bool was_silent = last_position_ - heard > kAutopilotSilent;
  if (seen_.sequence > 0) (void)estimator_.follow(seen_, now, flying_);
  const firmware_if::AutopilotReport before = autopilot_.value_or(firmware_if::AutopilotReport{});
  autopilot_ = autopilot.report();
  stages::EstimatedState state;
  if (estimator_.state(state) != Status::kOk) return;
  using firmware_if::AutopilotStage;
  shift_W_ = state.shift_W;
  const bool has_turned = state.map_number != map_number_;
  map_number_ = state.map_number;
  // While nobody led it, it stopped by itself, somewhere: from there on it is led anew. In a frame that turned, too.
  const bool was_lost = before.stage == AutopilotStage::kLost && autopilot_->stage == AutopilotStage::kOurs;
  if ((was_lost || was_silent || has_turned) && flying_) {
    offered_.reset();
    committed_ = stop_from(state.p_WB, state.v_WB, vehicle_, now);
    ++committed_number_;
    braking_ = descending_ = false;
  }
  if (asked_ && !may_take_off_ && !flying_) withdraw(autopilot);
  if (asked_ || !may_take_off_ || autopilot_->stage != AutopilotStage::kReady) return;
  asked_ = true;
  stood_m_ = state.p_WB.z();
  autopilot.take_command(cruise_m_ - state.p_WB.z());
}

void FlightControl::withdraw(firmware_if::Autopilot& autopilot) {
  using firmware_if::AutopilotStage;
  const bool taken =
      autopilot_->stage == AutopilotStage::kTaking || autopilot_->stage == AutopilotStage::kOurs;
  if (!taken || withdrawn_) return;
  if (!autopilot_->in_air) {
    withdrawn_ = true;
    autopilot.disarm();
  } else {
    autopilot.take_command(0.0);
  }
}

bool FlightControl::may_climb(MonotonicTime now) const {
  const bool obeys = !autopilot_ || autopilot_->stage == firmware_if::AutopilotStage::kOurs;
  return now - *first_estimate_ >= kSettle && may_take_off_ && obeys;
}

void FlightControl::commit(MonotonicTime now) {
  stages::EstimatedState state;
  if (estimator_.state(state) != Status::kOk) return;
  if (!first_estimate_) {
    first_estimate_ = now;
    const Matrix3 R_WB = state.q_WB.toRotationMatrix();
    yaw_rad_ = core::yaw_of(R_WB);
    gaze_.begin(yaw_rad_);
  }
  if (!flying_) {
    // Withdrawn in the autopilot's own climb: it flies, so it is led, and the failsafe says where to.
    const bool withdrawn = asked_ && !may_take_off_ && autopilot_->in_air &&
                           autopilot_->stage == firmware_if::AutopilotStage::kOurs;
    if (!withdrawn && !may_climb(now)) return;
    committed_ = withdrawn ? stop_from(state.p_WB, state.v_WB, vehicle_, now)
                           : take_off(state.p_WB, cruise_m_, vehicle_, now);
    ++committed_number_;
    flying_ = true;
    home_W_ = committed_.end_W() + state.shift_W;
    ground_m_ = stood_m_.value_or(state.p_WB.z());
  }
  if (!airborne_ && now > committed_.ends() + kHover && gaze_.ready()) airborne_ = true;
  if (braking_ || descending_ || !gaze_.ready()) offered_.reset();
  if (offered_ && offered_->start_time <= now) {
    committed_ = *offered_;
    ++committed_number_;
    offered_.reset();
    airborne_ = true;  // also within the hover: from here on the vehicle is where its decisions say
  }
}

void FlightControl::brake() {
  offered_.reset();
  if (braking_ || descending_ || !flying_) return;
  braking_ = true;
  brake_at_s_ = -1.0;
  brake_rate_ = 1.0;
}

bool FlightControl::standing(MonotonicTime now) const {
  stages::EstimatedState state;
  return flying_ && !braking_ && now > committed_.ends() && estimator_.state(state) == Status::kOk &&
         state.v_WB.norm() < kStand_mps && (state.p_WB - reference_.p_W).norm() < kStand_m;
}

void FlightControl::descend(MonotonicTime now, double speed_mps) {
  if (descending_ || !flying_) return;
  const Vector3 from_W = committed_.at(now).p_W;
  speed_mps = std::min(speed_mps, vehicle_.descent_mps);
  const double fast_m = std::max(from_W.z() - ground_m_ - kNearGround_m, 0.0);
  const auto straight_down = [](const Vector3& at_W, double length_m, double rate_mps) {
    PolynomialSegment segment;
    segment.duration_s = length_m / rate_mps;
    segment.coefficient[0] = at_W;
    segment.coefficient[1] = Vector3(0.0, 0.0, -rate_mps);
    return segment;
  };
  Trajectory down;
  down.start_time = now;
  down.segment_count = 2;
  down.segment[0] = straight_down(from_W, fast_m, speed_mps);
  down.segment[1] =
      straight_down(from_W - Vector3(0.0, 0.0, fast_m), kNearGround_m + kBelowGround_m, kTouchdown_mps);
  down.brake_begin_s = down.duration_s();
  committed_ = down;
  ++committed_number_;
  braking_ = false;
  descending_ = true;
  moving_ = now;
}

TrajectoryPoint FlightControl::next_reference(MonotonicTime now) {
  if (!braking_) return committed_.at(now);
  // The same curve at a rate that falls to zero: p = c(s), v = c' s', a = c'' s'^2 + c' s''.
  if (brake_at_s_ < 0.0) brake_at_s_ = seconds(now - committed_.start_time) - period_s_;
  const double brake_mps2 = braking_mps2(vehicle_);
  const double rate = brake_rate_;
  const double speed_mps = committed_.at_s(brake_at_s_).v_W.norm();
  brake_rate_ = std::max(rate - lost_rate(brake_mps2, speed_mps, period_s_), 0.0);
  brake_at_s_ += period_s_ * brake_rate_;
  TrajectoryPoint point = committed_.at_s(brake_at_s_);
  if (brake_rate_ <= 0.0 || brake_at_s_ >= committed_.duration_s()) {
    committed_ = Trajectory::hold(point.p_W, now);
    ++committed_number_;
    braking_ = false;
    return committed_.at(now);
  }
  const double slowing = (brake_rate_ - rate) / period_s_;
  const double r = brake_rate_;
  point.j_W = Vector3(r * r * r * point.j_W + 3.0 * r * slowing * point.a_W);
  point.a_W = Vector3(r * r * point.a_W + slowing * point.v_W);
  point.v_W *= r;
  return point;
}

void FlightControl::watch_touchdown(MonotonicTime now, const stages::EstimatedState& state) {
  constexpr double kStill_mps = 0.2;
  constexpr double kBelow_m = 0.3;
  constexpr double kCarried_ratio = 0.8;
  double thrust_N = 0.0;
  for (const double ratio : command_.thrust_ratio) thrust_N += ratio * vehicle_.max_thrust_N;
  const bool still = std::fabs(state.v_WB.z()) < kStill_mps;
  const bool pushed = reference_.p_W.z() < state.p_WB.z() - kBelow_m;
  const bool carried = thrust_N < kCarried_ratio * vehicle_.mass_kg * 9.81;
  if (!(still && pushed && carried)) moving_ = now;
  landed_ = now - moving_ >= kLanded;
}

void FlightControl::track(MonotonicTime now, firmware_if::Autopilot& autopilot) {
  stages::EstimatedState state;
  if (landed_ || estimator_.state(state) != Status::kOk) return;
  if (flying_) {
    reference_ = next_reference(now);
    if (!descending_) yaw_rad_ = gaze_.step({now, committed_, committed_number_, gaze_target_});
  } else {
    reference_ = {};
    reference_.p_W = state.p_WB;
  }
  const auto array = [](const Vector3& v) { return std::array<double, 3>{v.x(), v.y(), v.z()}; };
  (void)autopilot.command(
      now, {array(reference_.p_W + shift_W_), array(reference_.v_W), array(reference_.a_W), yaw_rad_});
  if (!descending_) return;
  const bool in_air = autopilot.report().in_air;
  if (in_air && state.p_WB.z() > reference_.p_W.z() + kNotFollowed_m) autopilot.land();
  // The autopilot's landing detector has its own witnesses; ours is that it stands still.
  if (in_air || std::fabs(state.v_WB.z()) > kStand_mps) moving_ = now;
  landed_ = now - moving_ >= kLanded;
}

void FlightControl::track(MonotonicTime now, firmware_if::Motors& motors) {
  stages::Tracker::Input in;
  if (!flying_ || landed_ || estimator_.state(in.state) != Status::kOk) return;
  reference_ = next_reference(now);
  in.reference = reference_;
  if (!descending_) yaw_rad_ = gaze_.step({now, committed_, committed_number_, gaze_target_});
  in.yaw_rad = yaw_rad_;
  // A refused step leaves the command of the frame before.
  (void)tracker_.step(in, command_);
  if (descending_) watch_touchdown(now, in.state);
  if (!landed_) (void)motors.command(command_);
}

}  // namespace roborun::flight
