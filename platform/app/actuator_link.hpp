/// From motor commands to turning motors, in simulation as on the vehicle: switch, gate, frames, bus, ESCs;
/// and from the battery back to the runtime, over the same bus.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/dronecan/node.hpp"
#include "firmware_if/kill_switch.hpp"
#include "firmware_if/motors.hpp"
#include "platform/app/kill_lines.hpp"
#include "platform/app/motor_bus.hpp"
#include "platform/sitl/bus/fake_can.hpp"
#include "platform/sitl/bus/fake_esc.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"
#include "platform/sitl/bus/fake_power_module.hpp"
#include "platform/sitl/fault/fault_line.hpp"

namespace roborun::app {

/// What of the actuator side is real; null: it is simulated.
struct RealActuators {
  MotorBus* bus{nullptr};
  KernelKillLines* kill{nullptr};
};

/// The simulated actuator side of the vehicle. Each minor frame: the flight lane may command(), then step()
/// sends; the world calls advance() while time passes. Arms itself with the first command: the operator of a
/// simulation. No allocation after construction.
class ActuatorLink final : public firmware_if::Motors {
 public:
  /// The gate closes after three minor frames without a command. What is real takes the place of what is
  /// simulated (whose faults have no effect then), and must outlive the link.
  ActuatorLink(std::uint64_t seed, Nanos minor_frame, const RealActuators& real) noexcept;
  ActuatorLink(const ActuatorLink&) = delete;
  ActuatorLink& operator=(const ActuatorLink&) = delete;

  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override;
  /// The end of a minor frame: samples the kill switch, hears and sends.
  void step(MonotonicTime now) noexcept;
  /// Runs the bus until `now`; the ESCs hand their throttle to `motors`, the power module says what is left.
  void advance(MonotonicTime now, double charge_ratio, firmware_if::Motors& motors) noexcept;

  /// Faults of ESCs, power module, bus and kill switch; null: none. It must outlive the link.
  void connect(const sitl::FaultLine* faults) noexcept { faults_ = faults; }
  /// A twin for tests: the kill switch has no effect.
  void ignore_kill_switch() noexcept { ignores_kill_switch_ = true; }
  [[nodiscard]] const firmware_if::KillSwitch& kill_switch() const noexcept { return kill_switch_; }
  /// Motors off for good, by the runtime itself.
  void terminate() noexcept { gate_.kill(); }
  /// After a landing: zeros, and no arming by a later command.
  void disarm() noexcept;
  /// Throttle that the motors were given last, 0 .. 1.
  [[nodiscard]] const std::array<double, 4>& throttle() const noexcept { return turning_; }
  /// How long the most silent ESC has not been heard.
  [[nodiscard]] Nanos esc_silence(MonotonicTime now) const noexcept;
  /// What the power module said, 0 .. 1 in whole percent, rounded down. NaN: nothing for half a second (five
  /// of its messages), or nothing usable.
  [[nodiscard]] double charge_ratio(MonotonicTime now) const noexcept;

  [[nodiscard]] const firmware_if::dronecan::Node& node() const noexcept { return node_; }
  [[nodiscard]] const firmware_if::TransmitGate& gate() const noexcept { return gate_; }

 private:
  void break_lines(MonotonicTime now) noexcept;
  [[nodiscard]] double break_battery(double charge_ratio) noexcept;
  [[nodiscard]] double break_esc(std::size_t i, double ratio, MonotonicTime now) noexcept;

  sitl::FakeCan bus_;
  sitl::FakeCanPort& port_;
  firmware_if::TransmitGate gate_;
  std::array<firmware_if::dronecan::Reassembler::Session, 32> sessions_{};
  firmware_if::dronecan::Node node_;
  std::array<sitl::FakeEsc, 4> escs_;
  sitl::FakePowerModule power_module_;
  sitl::FakeGpioInput kill_open_;
  sitl::FakeGpioInput kill_closed_;
  firmware_if::KillSwitch kill_switch_;
  firmware_if::MotorCommand command_{};
  bool commanded_{false};  ///< This minor frame: the control cycle is alive.
  bool armed_{false};
  bool disarmed_{false};  ///< For good.
  bool ignores_kill_switch_{false};
  const sitl::FaultLine* faults_{nullptr};
  bool bus_off_{false};
  bool pulse_{false};
  std::array<double, 4> turning_{};  ///< What the motors were given last.
  double sound_charge_ratio_{1.0};   ///< The last one before a fault of the power module.
};

}  // namespace roborun::app
