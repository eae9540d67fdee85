/// The flight lane: once a minor frame from sensors to motors, along whatever trajectory is committed.
#pragma once

#include <functional>
#include <optional>

#include "core/trajectory.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "firmware_if/motors.hpp"
#include "stages/control/estimator.hpp"
#include "stages/control/tracker.hpp"

namespace roborun::app {

class FlightLane {
 public:
  using TakeOff = std::function<Trajectory(const Vector3& ground_W, MonotonicTime start)>;

  FlightLane(const stages::Estimator::Config& estimator, const stages::Tracker::Config& tracker)
      : estimator_(estimator), tracker_(tracker) {}

  /// Makes the climb to the first hover; flown as soon as the estimator has settled.
  void set_take_off(TakeOff take_off) { take_off_ = std::move(take_off); }
  /// A trajectory that takes over at its start time. The last one offered counts.
  void offer(const Trajectory& trajectory) { offered_ = trajectory; }
  /// One minor frame: read all sensors, estimate, switch to an offered trajectory that is due, track,
  /// command.
  template <typename Sensors>
  void step(MonotonicTime now, Sensors& sensors, firmware_if::Motors& motors) {
    read(static_cast<firmware_if::Imu&>(sensors), static_cast<firmware_if::Gnss&>(sensors),
         static_cast<firmware_if::Barometer&>(sensors));
    fly(now, motors);
  }

  [[nodiscard]] const Trajectory& committed() const { return committed_; }
  [[nodiscard]] const stages::Estimator& estimator() const { return estimator_; }
  [[nodiscard]] const stages::Tracker& tracker() const { return tracker_; }
  /// The climb is over: decisions may begin.
  [[nodiscard]] bool airborne() const { return airborne_; }

 private:
  void read(firmware_if::Imu& imu, firmware_if::Gnss& gnss, firmware_if::Barometer& barometer);
  void fly(MonotonicTime now, firmware_if::Motors& motors);

  stages::Estimator estimator_;
  stages::Tracker tracker_;
  TakeOff take_off_;
  Trajectory committed_{};
  std::optional<Trajectory> offered_;
  firmware_if::MotorCommand command_{};
  std::optional<MonotonicTime> first_estimate_;
  bool taking_off_{false};
  bool airborne_{false};
  double yaw_rad_{0.0};
};

}  // namespace roborun::app
