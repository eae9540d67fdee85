/// A vehicle whose sensors, motors' controllers and battery are nodes on a DroneCAN bus; and whether it can be flown.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/sensor_rig.hpp"
#include "platform/flight/actuator_side.hpp"
#include "platform/live/bus_sensors.hpp"
#include "platform/live/bus_wire.hpp"
#include "platform/live/far_end.hpp"
#include "platform/live/hook_and_light.hpp"
#include "platform/live/port_look.hpp"
#include "platform/live/port_pictures.hpp"
#include "platform/sensor_port/port_bus.hpp"
#include "platform/sensor_port/port_names.hpp"

namespace roborun::live {

/// Cameras, LiDARs and odometry are ports; so are the operator's link and those lines that no GPIO has. Motors are armed only
/// if the kill switch was seen to work, on both wires, and the arming switch was switched on after all else was ready.
class BusAircraft final : public FarEnd {
 public:
  /// What of `rig` has to be there, and with `needs_hook` a package. Stamps count from `epoch`; the world begins at `origin`, or
  /// at the first fix. Throws InputError for lines that cannot be had, and a kill switch that does not stand on run.
  BusAircraft(std::unique_ptr<BusWire> wire, const sensor_port::VehiclePorts& ports, const SensorRig& rig,
              Nanos minor_frame, Nanos epoch, const std::optional<sensor_port::EarthPlace>& origin,
              const BusLines& lines, bool needs_hook);
  BusAircraft(const BusAircraft&) = delete;
  BusAircraft& operator=(const BusAircraft&) = delete;

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

  void begin_frame(MonotonicTime now) noexcept override {
    lines_.device.update(now);
    sensors_.hear(now);
  }
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return sensors_.imu(); }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override { return sensors_.gnss(); }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return sensors_.barometer(); }
  [[nodiscard]] firmware_if::Odometry* odometry() noexcept override {
    return odometry_ ? &odometry_->device : nullptr;
  }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return actuators_; }
  [[nodiscard]] flight::AircraftHealth health(MonotonicTime now) noexcept override {
    return {actuators_.charge_ratio(now), actuators_.esc_silence(now), lines_.device.hears_operator(),
            actuators_.kill_switch().killed()};
  }
  void terminate() noexcept override { actuators_.terminate(); }
  void disarm() noexcept override { actuators_.disarm(); }
  void end_frame(MonotonicTime now) noexcept override {
    actuators_.step(now);
    hook_and_light_.step(now, sensors_.height_m(now));
  }
  void is_flown(const flight::Flown& flown) noexcept override {
    hook_and_light_.is_flown(flown);
    if (flown.estimated) sensors_.set_up(flown.up_B);
  }
  void release_package() noexcept override { hook_and_light_.release(); }
  [[nodiscard]] std::uint64_t packages_released() const noexcept override {
    return hook_and_light_.released();
  }

 private:
  [[nodiscard]] Need look_at_bus(MonotonicTime now);
  [[nodiscard]] Need look_at_kill_switch();
  /// `others`: all else is there.
  [[nodiscard]] Need look_at_arming(bool others);

  sensor_port::PortClock clock_;
  std::optional<sensor_port::EarthPlace> origin_;
  std::unique_ptr<BusWire> wire_;
  PortPictures pictures_;
  std::optional<Port<sensor_port::PortOdometry>> odometry_;
  Port<sensor_port::PortLines> lines_;
  std::unique_ptr<gpio::KernelKillLines> kill_lines_;  ///< Null: the port's.
  std::unique_ptr<gpio::GpiodInput> arm_line_;         ///< Null: the port's.
  BusSensors sensors_;
  flight::ActuatorSide actuators_;
  HookAndLight hook_and_light_;
  std::uint64_t frames_{0};  ///< Heard on the bus until heard_.
  MonotonicTime heard_ = MonotonicTime::min();
  bool was_safe_{false};  ///< The arming switch, once all else was there.
};

}  // namespace roborun::live
