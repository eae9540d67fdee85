/// What a runtime on real time flies, with what was looked at before the flight.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware_if/depth_camera.hpp"
#include "firmware_if/lidar.hpp"
#include "firmware_if/mavlink/flight_messages.hpp"
#include "firmware_if/mavlink/goal_request.hpp"
#include "platform/flight/actuator_side.hpp"
#include "platform/flight/aircraft.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::live {

/// One line of the readiness list.
struct Need {
  std::string device;   ///< "camera 1", "kill switch", ...
  std::string lacks;    ///< What is missing and what to do; empty: it is there.
  bool has_port{true};  ///< False: there is not even a port.
};

/// What a device brought.
struct PortUse {
  std::string device;
  std::uint64_t frames{};   ///< Samples taken.
  std::uint64_t dropped{};  ///< Overwritten before they were asked for, torn or refused.
  std::uint64_t stale{};    ///< Silences that lasted longer than the device may be silent.
};

/// What ESCs and the battery's monitor lack, as heard on the bus.
void look_at_power(const flight::ActuatorSide& motors, MonotonicTime now, std::vector<Need>& needs);
/// Enough for a flight is left, by what its monitor says; NaN: `unknown`.
[[nodiscard]] Need battery_need(double charge_ratio, const char* unknown);

class FarEnd : public flight::Aircraft {
 public:
  /// On the ground, before the lanes run, again and again: opens what is there by now, listens, and says what is missing. Nothing is
  /// armed.
  [[nodiscard]] virtual std::vector<Need> look(MonotonicTime now) = 0;
  [[nodiscard]] virtual std::span<firmware_if::DepthCamera* const> cameras() noexcept = 0;
  /// The same cameras once more, for the flight lane.
  [[nodiscard]] virtual std::span<firmware_if::DepthCamera* const> watched() noexcept = 0;
  [[nodiscard]] virtual std::span<firmware_if::Lidar* const> lidars() noexcept = 0;
  /// The package, in flight; any thread. Where there is no hook nothing happens.
  virtual void release_package() noexcept {}
  [[nodiscard]] virtual std::uint64_t packages_released() const noexcept { return 0; }
  /// Where (0, 0, 0) is; none: nobody said. Before the lanes run.
  [[nodiscard]] virtual std::optional<sensor_port::EarthPlace> origin() const { return std::nullopt; }
  /// The vehicle's MAVLink system.
  [[nodiscard]] virtual std::uint8_t sysid() const noexcept { return 1; }
  // Of the thread that watches, with a ground station behind an autopilot: a goal that it asks for, and what it is told.
  [[nodiscard]] virtual bool asked(firmware_if::mavlink::GoalRequest& request) noexcept {
    (void)request;
    return false;
  }
  virtual void tell(const firmware_if::mavlink::Statustext& line) noexcept { (void)line; }
  virtual void tell(const firmware_if::mavlink::CommandAck& ack) noexcept { (void)ack; }
  /// Once the lanes have ended.
  [[nodiscard]] virtual std::vector<PortUse> use(MonotonicTime now) const = 0;
};

}  // namespace roborun::live
