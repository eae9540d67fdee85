/// A vehicle at the far end of sensor ports, as an aircraft of the runtime; and whether it can be flown.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/sensor_rig.hpp"
#include "platform/flight/actuator_side.hpp"
#include "platform/live/far_end.hpp"
#include "platform/live/hook_and_light.hpp"
#include "platform/live/port_look.hpp"
#include "platform/live/port_pictures.hpp"
#include "platform/sensor_port/port_bus.hpp"
#include "platform/sensor_port/port_names.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::live {

/// Gate, node, kill switch and arming are those of a vehicle on a CAN bus (flight::ActuatorSide): the bus is two ports.
class PortAircraft final : public FarEnd {
 public:
  /// What of `rig` has to be there, and with `needs_hook` a package. Stamps count from `epoch`; the world begins at `origin`, or at the first fix.
  PortAircraft(const std::string& name, const SensorRig& rig, Nanos minor_frame, Nanos epoch,
               const std::optional<sensor_port::EarthPlace>& origin, bool needs_hook);
  PortAircraft(const PortAircraft&) = delete;
  PortAircraft& operator=(const PortAircraft&) = delete;

  [[nodiscard]] std::optional<sensor_port::EarthPlace> origin() const override { return origin_; }
  [[nodiscard]] std::vector<Need> look(MonotonicTime now) override;
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> cameras() noexcept override {
    return pictures_.cameras();
  }
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> watched() noexcept override {
    return pictures_.watched();
  }
  [[nodiscard]] std::span<firmware_if::Lidar* const> lidars() noexcept override { return pictures_.lidars(); }
  [[nodiscard]] std::vector<PortUse> use(MonotonicTime now) const override;

  void begin_frame(MonotonicTime now) noexcept override { lines_.update(now); }
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return imu_.device; }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override {
    if (!gnss_) return no_gnss_;
    return gnss_->device;
  }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return pressure_.device; }
  [[nodiscard]] firmware_if::Odometry* odometry() noexcept override {
    return odometry_ ? &odometry_->device : nullptr;
  }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return actuators_; }
  [[nodiscard]] flight::AircraftHealth health(MonotonicTime now) noexcept override {
    return {actuators_.charge_ratio(now), actuators_.esc_silence(now), lines_.hears_operator(),
            actuators_.kill_switch().killed()};
  }
  void terminate() noexcept override { actuators_.terminate(); }
  void disarm() noexcept override { actuators_.disarm(); }
  void end_frame(MonotonicTime now) noexcept override {
    actuators_.step(now);
    hook_and_light_.step(now, std::nullopt);
  }
  void is_flown(const flight::Flown& flown) noexcept override { hook_and_light_.is_flown(flown); }
  void release_package() noexcept override { hook_and_light_.release(); }
  [[nodiscard]] std::uint64_t packages_released() const noexcept override {
    return hook_and_light_.released();
  }

 private:
  struct NoGnss final : firmware_if::Gnss {
    [[nodiscard]] Status read(firmware_if::GnssFix&) noexcept override { return Status::kNotReady; }
  };
  void look_at_navigation(MonotonicTime now, std::vector<Need>& needs);
  void look_at_bus(MonotonicTime now, std::vector<Need>& needs);
  /// What hangs on bus and lines: kill switch, operator, ESCs, battery.
  void look_at_vehicle(MonotonicTime now, std::vector<Need>& needs) const;

  sensor_port::PortClock clock_;
  std::optional<sensor_port::EarthPlace> origin_;
  std::string bus_out_;
  PortPictures pictures_;
  Port<sensor_port::PortImu> imu_;
  std::optional<Port<sensor_port::PortGnss>> gnss_;
  std::optional<Port<sensor_port::PortOdometry>> odometry_;
  Port<sensor_port::PortBarometer> pressure_;
  Port<sensor_port::PortLines> lines_port_;
  Port<sensor_port::PortCan> bus_;
  sensor_port::PortLines& lines_;
  std::string speaks_;  ///< What is wrong with the port that is written to; empty: nothing.
  NoGnss no_gnss_;
  flight::ActuatorSide actuators_;
  HookAndLight hook_and_light_;
};

}  // namespace roborun::live
