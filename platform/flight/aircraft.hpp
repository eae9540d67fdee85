/// What the flight lane reads and commands, whoever is behind it: a simulation, or the recording of one.
#pragma once

#include "core/geometry/vector.hpp"
#include "firmware_if/autopilot.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "firmware_if/motors.hpp"
#include "firmware_if/odometry.hpp"
#include "firmware_if/time.hpp"

namespace roborun::flight {

/// What the failsafe asks for besides the sensors.
struct AircraftHealth {
  double battery_ratio{};  ///< Of a full charge. NaN: the battery's monitor says nothing usable.
  Nanos esc_silence{};     ///< How long the most silent ESC has not been heard.
  bool hears_operator{};   ///< In this frame.
  bool killed{};           ///< By the kill switch, for good.
};

/// What the flight lane knows of it at the end of a minor frame.
struct Flown {
  bool estimated{};                 ///< The next three are.
  Vector3 up_B = Vector3::UnitZ();  ///< The vertical in the body's axes: forward, left, up.
  double height_m{};                ///< Over the place of the take-off.
  double speed_mps{};
  bool acts{};  ///< The failsafe does something.
};

/// Contract:
///  1. No call blocks or allocates.
///  2. Each minor frame of the flight lane calls begin_frame(), then reads the sensors, then asks for
///  health() at most once, then commands the motors at most once, then calls end_frame(), then is_flown().
class Aircraft {
 public:
  virtual ~Aircraft() = default;
  /// The world is now where it is at `now`.
  virtual void begin_frame(MonotonicTime now) noexcept = 0;
  [[nodiscard]] virtual firmware_if::Imu& imu() noexcept = 0;
  [[nodiscard]] virtual firmware_if::Gnss& gnss() noexcept = 0;
  [[nodiscard]] virtual firmware_if::Barometer& barometer() noexcept = 0;
  /// Null: it has none.
  [[nodiscard]] virtual firmware_if::Odometry* odometry() noexcept { return nullptr; }
  [[nodiscard]] virtual firmware_if::Motors& motors() noexcept = 0;
  /// Null: the runtime itself flies it. Else the autopilot does: its state is the state, it gets set-points, and sensors and
  /// motors above are not asked. begin_frame() brings it what has come, end_frame() takes away what is to be sent; the flight
  /// lane steps it.
  [[nodiscard]] virtual firmware_if::Autopilot* autopilot() noexcept { return nullptr; }
  [[nodiscard]] virtual AircraftHealth health(MonotonicTime now) noexcept = 0;
  /// Motors off for good, whatever is commanded from here on: by the runtime itself, and after a landing. Motors of an
  /// autopilot stop if it obeys.
  virtual void terminate() noexcept = 0;
  virtual void disarm() noexcept = 0;
  /// What was commanded leaves.
  virtual void end_frame(MonotonicTime now) noexcept = 0;
  virtual void is_flown(const Flown& flown) noexcept { (void)flown; }
};

}  // namespace roborun::flight
