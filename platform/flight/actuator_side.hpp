/// From motor commands to frames on the bus: kill switch, transmit gate, node, arming; and from the bus back
/// to what the failsafe asks: battery and silence of the ESCs. The same on the vehicle and in simulation.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/can.hpp"
#include "firmware_if/dronecan/node.hpp"
#include "firmware_if/gpio.hpp"
#include "firmware_if/kill_switch.hpp"
#include "firmware_if/motors.hpp"
#include "firmware_if/transmit_gate.hpp"

namespace roborun::flight {

/// What arming asks for. Without the proof that the kill switch works: for simulation and motors without propellers.
enum class Arming : std::uint8_t { kUnproven, kProven };

/// Each minor frame: the flight lane may command(), then step() sends. Arms itself with the first command.
/// RT-safe: O(1), no allocation.
class ActuatorSide final : public firmware_if::Motors {
 public:
  /// `bus` is the vehicle's end; `open` and `closed` are the contacts of the kill switch. All outlive the
  /// object. The gate closes after three minor frames without a command.
  ActuatorSide(Nanos minor_frame, firmware_if::CanBus& bus, firmware_if::GpioInput& open,
               firmware_if::GpioInput& closed, Arming arming = Arming::kUnproven) noexcept;
  ActuatorSide(const ActuatorSide&) = delete;
  ActuatorSide& operator=(const ActuatorSide&) = delete;

  /// kInvalidArgument for a throttle that is not within 0 and 1: nothing changes.
  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override;
  /// The end of a minor frame: samples the kill switch, hears and sends.
  void step(MonotonicTime now) noexcept;
  /// Motors off for good, by the runtime itself.
  void terminate() noexcept {
    gate_.kill();
    disarmed_ = true;
  }
  /// After a landing: zeros, and no arming by a later command.
  void disarm() noexcept;
  /// On the ground, before anything was commanded: a switch that was pressed to show that it works is forgotten once it
  /// stands on "run" again. kNotReady: it does not. kInvalidArgument: motors were commanded, or terminated.
  [[nodiscard]] Status forget_proof() noexcept;
  /// A twin for tests: the kill switch has no effect.
  void ignore_kill_switch() noexcept { ignores_kill_switch_ = true; }

  /// How long the most silent ESC has not been heard.
  [[nodiscard]] Nanos esc_silence(MonotonicTime now) const noexcept;
  /// What the power module said, 0 .. 1 in whole percent, rounded down. NaN: nothing for half a second (five
  /// of its messages), or nothing usable.
  [[nodiscard]] double charge_ratio(MonotonicTime now) const noexcept;
  [[nodiscard]] const firmware_if::KillSwitch& kill_switch() const noexcept { return kill_switch_; }
  [[nodiscard]] const firmware_if::dronecan::Node& node() const noexcept { return node_; }
  [[nodiscard]] const firmware_if::TransmitGate& gate() const noexcept { return gate_; }
  /// For what else the flight lane says on the bus.
  [[nodiscard]] firmware_if::TransmitGate& gate() noexcept { return gate_; }
  [[nodiscard]] bool armed() const noexcept { return armed_; }

 private:
  firmware_if::TransmitGate gate_;
  std::array<firmware_if::dronecan::Reassembler::Session, 32> sessions_{};
  firmware_if::dronecan::Node node_;
  firmware_if::KillSwitch kill_switch_;
  firmware_if::MotorCommand command_{};
  Arming arming_;
  bool commanded_{false};  ///< This minor frame: the control cycle is alive.
  bool armed_{false};
  bool disarmed_{false};  ///< For good.
  bool ignores_kill_switch_{false};
};

}  // namespace roborun::flight
