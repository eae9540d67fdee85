#include "platform/app/flight_lane.hpp"

#include "core/geometry/math.hpp"

namespace roborun::app {
namespace {

constexpr Nanos kSettle{1'000'000'000};  // the filter's biases need a second on the ground
constexpr Nanos kHover{300'000'000};     // at the top, before the first decision

}  // namespace

void FlightLane::sense(firmware_if::Imu& imu, firmware_if::Gnss& gnss, firmware_if::Barometer& barometer) {
  // At most a ring's worth a frame, so that a flood of samples cannot hold the lane.
  constexpr int kMost = 16;
  firmware_if::ImuSample sample;
  for (int i = 0; i < kMost && imu.read(sample) == Status::kOk; ++i) (void)estimator_.predict(sample);
  firmware_if::GnssFix fix;
  for (int i = 0; i < kMost && gnss.read(fix) == Status::kOk; ++i) (void)estimator_.update(fix);
  firmware_if::BarometerSample pressure;
  for (int i = 0; i < kMost && barometer.read(pressure) == Status::kOk; ++i)
    (void)estimator_.update(pressure);
}

void FlightLane::commit(MonotonicTime now) {
  stages::EstimatedState state;
  if (estimator_.state(state) != Status::kOk) return;
  if (!first_estimate_) {
    first_estimate_ = now;
    const Matrix3 R_WB = state.q_WB.toRotationMatrix();
    yaw_rad_ = core::atan2(R_WB(1, 0), R_WB(0, 0));
  }
  if (!flying_) {
    if (now - *first_estimate_ < kSettle) return;
    committed_ = take_off_(state.p_WB, now);
    ++committed_number_;
    flying_ = true;
  }
  if (!airborne_ && now > committed_.start_time + from_seconds(committed_.duration_s()) + kHover)
    airborne_ = true;
  if (offered_ && offered_->start_time <= now) {
    committed_ = *offered_;
    ++committed_number_;
    offered_.reset();
  }
}

void FlightLane::track(MonotonicTime now, firmware_if::Motors& motors) {
  stages::Tracker::Input in;
  if (!flying_ || estimator_.state(in.state) != Status::kOk) return;
  in.reference = committed_.at(now);
  in.yaw_rad = yaw_rad_;
  // A refused step leaves the command of the frame before.
  (void)tracker_.step(in, command_);
  (void)motors.command(command_);
}

}  // namespace roborun::app
