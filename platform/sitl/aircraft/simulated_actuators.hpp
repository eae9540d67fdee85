/// The far end of the motors' bus in simulation: the bus, four ESCs, the power module and the contacts of the
/// kill switch, with their faults.
#pragma once

#include <array>
#include <cstddef>

#include "firmware_if/can.hpp"
#include "firmware_if/gpio.hpp"
#include "firmware_if/motors.hpp"
#include "platform/sitl/bus/fake_can.hpp"
#include "platform/sitl/bus/fake_esc.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"
#include "platform/sitl/bus/fake_power_module.hpp"
#include "platform/sitl/fault/fault_line.hpp"

namespace roborun::sitl {

/// What of the actuators is not simulated; null: it is. All outlive the simulation.
struct OutsideActuators {
  firmware_if::CanBus* node{nullptr};            ///< The vehicle's end of the bus ...
  std::array<firmware_if::CanBus*, 4> esc{};     ///< ... and that of each ESC: all five, or none.
  firmware_if::GpioInput* kill_open{nullptr};    ///< Normally open contact of the kill switch ...
  firmware_if::GpioInput* kill_closed{nullptr};  ///< ... and normally closed: both, or none.
};

/// No allocation after construction. What is outside has no simulated faults.
class SimulatedActuators {
 public:
  SimulatedActuators(std::uint64_t seed, const OutsideActuators& outside) noexcept;
  SimulatedActuators(const SimulatedActuators&) = delete;
  SimulatedActuators& operator=(const SimulatedActuators&) = delete;

  /// The vehicle's end of the bus.
  [[nodiscard]] firmware_if::CanBus& bus() noexcept { return node_; }
  [[nodiscard]] firmware_if::GpioInput& kill_open() noexcept { return open_; }
  [[nodiscard]] firmware_if::GpioInput& kill_closed() noexcept { return closed_; }

  /// Other ends of the simulated bus, for what else speaks on it; on the bus from the first call on. Precondition: i < 3.
  [[nodiscard]] firmware_if::CanBus& spare_bus(std::size_t i = 0) noexcept {
    return bus_.port(kSparePort + i);
  }

  /// Faults of ESCs, power module, bus and kill switch; null: none. It must outlive the object.
  void connect(const FaultLine* faults) noexcept { faults_ = faults; }
  /// Bus and contacts as their faults want them, before the vehicle's side looks at them.
  void break_lines(MonotonicTime now) noexcept;
  /// Runs the bus until `now`; the ESCs hand their throttle to `motors`, the power module says what is left.
  void advance(MonotonicTime now, double charge_ratio, firmware_if::Motors& motors) noexcept;
  /// Throttle that the motors were given last, 0 .. 1.
  [[nodiscard]] const std::array<double, 4>& throttle() const noexcept { return turning_; }

 private:
  static constexpr std::size_t kSparePort = 6;
  [[nodiscard]] double break_battery(double charge_ratio) noexcept;
  [[nodiscard]] double break_esc(std::size_t i, double ratio, MonotonicTime now) noexcept;

  FakeCan bus_;
  FakeCanPort& port_;
  firmware_if::CanBus& node_;
  std::array<FakeEsc, 4> escs_;
  FakePowerModule power_module_;
  FakeGpioInput kill_open_;
  FakeGpioInput kill_closed_;
  firmware_if::GpioInput& open_;
  firmware_if::GpioInput& closed_;
  const FaultLine* faults_{nullptr};
  bool bus_off_{false};
  bool pulse_{false};
  std::array<double, 4> turning_{};  ///< What the motors were given last.
  double sound_charge_ratio_{1.0};   ///< The last one before a fault of the power module.
};

}  // namespace roborun::sitl
