/// From motor commands to turning motors, in simulation as on the vehicle: switch, gate, frames, bus, ESCs.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/dronecan/node.hpp"
#include "firmware_if/kill_switch.hpp"
#include "firmware_if/motors.hpp"
#include "platform/sitl/bus/fake_can.hpp"
#include "platform/sitl/bus/fake_esc.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"

namespace roborun::app {

/// The simulated actuator side of the vehicle. Each minor frame: the flight lane may command(), then step()
/// sends; the world calls advance() while time passes. Arms itself with the first command: the operator of a
/// simulation. No allocation after construction.
class ActuatorLink final : public firmware_if::Motors {
 public:
  /// The gate closes after three minor frames without a command.
  ActuatorLink(std::uint64_t seed, Nanos minor_frame) noexcept;
  ActuatorLink(const ActuatorLink&) = delete;
  ActuatorLink& operator=(const ActuatorLink&) = delete;

  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override;
  /// The end of a minor frame: samples the kill switch, hears and sends.
  void step(MonotonicTime now) noexcept;
  /// Runs the bus until `now`; the ESCs hand their throttle to `motors`.
  void advance(MonotonicTime now, firmware_if::Motors& motors) noexcept;

  void press_kill_switch(MonotonicTime now) noexcept;
  [[nodiscard]] const firmware_if::dronecan::Node& node() const noexcept { return node_; }
  [[nodiscard]] const firmware_if::TransmitGate& gate() const noexcept { return gate_; }
  [[nodiscard]] const sitl::FakeCan& bus() const noexcept { return bus_; }

 private:
  sitl::FakeCan bus_;
  sitl::FakeCanPort& port_;
  firmware_if::TransmitGate gate_;
  std::array<firmware_if::dronecan::Reassembler::Session, 32> sessions_{};
  firmware_if::dronecan::Node node_;
  std::array<sitl::FakeEsc, 4> escs_;
  sitl::FakeGpioInput kill_open_;
  sitl::FakeGpioInput kill_closed_;
  firmware_if::KillSwitch kill_switch_;
  firmware_if::MotorCommand command_{};
  bool commanded_{false};  ///< This minor frame: the control cycle is alive.
  bool armed_{false};
};

}  // namespace roborun::app
