/// What the flight lane does: once a minor frame from sensors to motors, along whatever trajectory is
/// committed.
#pragma once

#include <algorithm>
#include <optional>

#include "core/trajectory.hpp"
#include "core/vehicle_model.hpp"
#include "firmware_if/autopilot.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "firmware_if/motors.hpp"
#include "firmware_if/odometry.hpp"
#include "platform/flight/gaze.hpp"
#include "stages/control/estimator.hpp"
#include "stages/control/tracker.hpp"

namespace roborun::flight {

/// FlightControl::brake() slows down by so much.
[[nodiscard]] double braking_mps2(const VehicleModel& vehicle) noexcept;
/// What the rate along the path loses meanwhile in `step_s`, where the path itself is flown at `speed_mps`.
[[nodiscard]] inline double lost_rate(double braking_mps2, double speed_mps, double step_s) noexcept {
  return step_s * braking_mps2 / std::max(speed_mps, 1.0);
}

/// The set-point time-out of PX4 and ArduCopter as they are asked to be.
inline constexpr Nanos kAutopilotSilent{500'000'000};

class FlightControl {
 public:
  /// `period_s` is the minor frame.
  FlightControl(const VehicleModel& vehicle, double period_s, const GazeConfig& gaze = {})
      : vehicle_(vehicle),
        estimator_({}),
        tracker_(stages::Tracker::config_for(vehicle, period_s)),
        period_s_(period_s),
        gaze_(gaze, period_s) {}

  /// Straight up to the height of the first hover, flown as soon as the estimator has settled.
  void set_cruise_height(double cruise_m) { cruise_m_ = cruise_m; }
  /// While false the vehicle stays on the ground.
  void allow_take_off(bool allowed) { may_take_off_ = allowed; }
  /// A trajectory that takes over at its start time. The last one offered counts.
  void offer(const Trajectory& trajectory) { offered_ = trajectory; }
  /// For a vehicle that does not see all around: where it looks; none: where it flies.
  void look_at(const std::optional<GazeTarget>& target) { gaze_target_ = target; }
  /// The three steps of a minor frame, in this order. RT-safe: O(1), no allocation.
  /// Reads all sensors, at most a ring's worth each, and estimates.
  void sense(firmware_if::Imu& imu, firmware_if::Gnss& gnss, firmware_if::Barometer& barometer,
             firmware_if::Odometry* odometry = nullptr);
  /// The same of a vehicle that an autopilot flies: its state is the state. Asks for the command when a take-off is allowed.
  void sense(MonotonicTime now, firmware_if::Autopilot& autopilot);
  /// Switches to an offered trajectory that is due.
  void commit(MonotonicTime now);
  /// Tracks the committed trajectory and commands the motors; nothing before the take-off.
  void track(MonotonicTime now, firmware_if::Motors& motors);
  /// Sends the autopilot along it; before the take-off where it stands.
  void track(MonotonicTime now, firmware_if::Autopilot& autopilot);
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
  /// The climb is over, and the look round of a vehicle that needs one: decisions may begin.
  [[nodiscard]] bool airborne() const { return airborne_; }

  /// To a stop along the committed trajectory, whose path stays as it was checked; then it hovers there. What
  /// was offered is dropped, and nothing offered is flown until then.
  void brake();
  [[nodiscard]] bool braking() const { return braking_; }
  /// Braked, and at the place of the stop.
  [[nodiscard]] bool standing(MonotonicTime now) const;
  /// Straight down from where it stands, slower near the height of the take-off, and on until it has landed.
  void descend(MonotonicTime now, double speed_mps);
  [[nodiscard]] bool descending() const { return descending_; }
  /// Three witnesses for a second: it is told to go down, does not move although the reference is below it,
  /// and the motors carry less than its weight. Latched; the motors are not commanded from then on.
  [[nodiscard]] bool landed() const { return landed_; }

  [[nodiscard]] bool flying() const { return flying_; }
  /// Top of the climb, where satellite navigation says by now that it is. Precondition: flying().
  [[nodiscard]] Vector3 home_W() const { return home_W_ - shift_W_; }
  [[nodiscard]] double ground_m() const { return ground_m_; }
  [[nodiscard]] const TrajectoryPoint& reference() const { return reference_; }
  /// What the motors were told last; zeros before the take-off, and where an autopilot flies.
  [[nodiscard]] const firmware_if::MotorCommand& command() const { return command_; }
  /// Validity of the newest fix or sample of the odometry that the estimator took and that differs from the one before.
  [[nodiscard]] MonotonicTime last_position() const { return last_position_; }
  /// An autopilot has said nothing for so long that it stops by itself: nobody knows how far from the reference it is.
  [[nodiscard]] bool unheard(MonotonicTime now) const {
    return autopilot_ && now - last_position_ > kAutopilotSilent;
  }
  /// No IMU sample for 25 ms, or the same numbers 20 times: a living one is never without noise.
  [[nodiscard]] bool imu_lost(MonotonicTime now) const {
    // An autopilot's sensors are its own affair; how old its state is shows in last_position().
    return !autopilot_ && (imu_repeats_ >= kMostRepeats || estimator_.imu_lost(now));
  }

 private:
  static constexpr int kMostRepeats = 20;
  /// Whether the climb to the first hover may begin; with an autopilot, once it obeys.
  [[nodiscard]] bool may_climb(MonotonicTime now) const;
  [[nodiscard]] TrajectoryPoint next_reference(MonotonicTime now);
  /// A take-off by the autopilot that is no longer wanted: on the ground disarmed, in the air taken over for a stop.
  void withdraw(firmware_if::Autopilot& autopilot);
  void watch_touchdown(MonotonicTime now, const stages::EstimatedState& state);

  VehicleModel vehicle_;
  stages::Estimator estimator_;
  stages::Tracker tracker_;
  double period_s_;  ///< The minor frame.
  double cruise_m_{0.0};
  Trajectory committed_{};
  std::uint64_t committed_number_{0};
  std::optional<Trajectory> offered_;
  firmware_if::MotorCommand command_{};
  std::optional<MonotonicTime> first_estimate_;
  bool flying_{false};  ///< There is a trajectory to track.
  bool airborne_{false};
  Gaze gaze_;
  double yaw_rad_{0.0};
  std::optional<GazeTarget> gaze_target_;
  bool may_take_off_{true};

  std::optional<firmware_if::AutopilotReport> autopilot_;  ///< None: there is no autopilot.
  firmware_if::AutopilotState seen_{};                     ///< Its newest state.
  bool asked_{false}, withdrawn_{false};                   ///< The command of it.
  std::optional<double> stood_m_;                          ///< Height where it was when it was asked.

  Vector3 home_W_ = Vector3::Zero();
  double ground_m_{0.0};
  TrajectoryPoint reference_{};
  firmware_if::ImuSample imu_{};
  int imu_repeats_{0};
  firmware_if::GnssFix fix_{};
  firmware_if::OdometrySample odometry_{};
  MonotonicTime last_position_{};
  Vector3 shift_W_ = Vector3::Zero();  ///< EstimatedState::shift_W.
  std::uint32_t map_number_{0};        ///< EstimatedState::map_number, of an autopilot's state.

  bool braking_{false};
  double brake_at_s_{0.0};  ///< Where on the committed trajectory.
  double brake_rate_{0.0};  ///< How fast along it, 1: as planned.
  bool descending_{false};
  bool landed_{false};
  MonotonicTime moving_{};  ///< When the witnesses of a landing last disagreed.
};

}  // namespace roborun::flight
