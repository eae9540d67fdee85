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
  /// The three steps of a minor frame, in this order. RT-safe: O(1), no allocation (but the take-off's own).
  /// Reads all sensors, at most a ring's worth each, and estimates.
  void sense(firmware_if::Imu& imu, firmware_if::Gnss& gnss, firmware_if::Barometer& barometer);
  /// Switches to an offered trajectory that is due.
  void commit(MonotonicTime now);
  /// Tracks the committed trajectory and commands the motors; nothing before the take-off.
  void track(MonotonicTime now, firmware_if::Motors& motors);
  /// All three at once, where nobody asks what each of them takes.
  template <typename Sensors>
  void step(MonotonicTime now, Sensors& sensors, firmware_if::Motors& motors) {
    sense(sensors, sensors, sensors);
    commit(now);
    track(now, motors);
  }

  [[nodiscard]] const Trajectory& committed() const { return committed_; }
  /// Another number for each committed trajectory; 0 before the first.
  [[nodiscard]] std::uint64_t committed_number() const { return committed_number_; }
  [[nodiscard]] const stages::Estimator& estimator() const { return estimator_; }
  [[nodiscard]] const stages::Tracker& tracker() const { return tracker_; }
  /// The climb is over: decisions may begin.
  [[nodiscard]] bool airborne() const { return airborne_; }

 private:
  stages::Estimator estimator_;
  stages::Tracker tracker_;
  TakeOff take_off_;
  Trajectory committed_{};
  std::uint64_t committed_number_{0};
  std::optional<Trajectory> offered_;
  firmware_if::MotorCommand command_{};
  std::optional<MonotonicTime> first_estimate_;
  bool flying_{false};  ///< There is a trajectory to track.
  bool airborne_{false};
  double yaw_rad_{0.0};
};

}  // namespace roborun::app
