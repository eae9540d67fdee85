/// What flight takes from the battery, by rotor momentum theory: the power of each rotor, the energy of a metre of level
/// flight, and the speed that spends least per metre. The simulated battery (platform/sitl/vehicle) is emptied by the same
/// function.
#pragma once

#include "core/vehicle_model.hpp"

namespace roborun {

/// Electrical power of one rotor, W, with `thrust_N` >= 0 and air coming along its axis at `axial_mps`:
///   P = T (v_i + v) / efficiency,  v_i = -v/2 + sqrt(v^2/4 + T / (2 rho A))
/// Descent (v < 0) counts as v = 0: it never gives power back. RT-safe: O(1).
[[nodiscard]] double rotor_power_W(const VehicleModel& vehicle, double thrust_N, double axial_mps) noexcept;

/// Joules per metre of level flight in still air at a constant speed.
struct EnergyPerMetre {
  double flight_Jpm{};     ///< Of the rotors: hovering and drag.
  double computing_Jpm{};  ///< Of power.avionics_W: companion computer, sensors, autopilot.
  [[nodiscard]] double total_Jpm() const noexcept { return flight_Jpm + computing_Jpm; }
};
/// The rotors hold weight and drag together, tilted forward, so that a part of the speed blows along their axis. Precondition:
/// speed_mps > 0. RT-safe: O(1).
[[nodiscard]] EnergyPerMetre energy_per_metre(const VehicleModel& vehicle, double speed_mps) noexcept;

/// The speed from 0.1 to 30 m/s, to 0.01 m/s, at which total_Jpm() is least: slower, hovering and computing cost more per metre,
/// faster, drag does. It may be beyond what the vehicle can fly. RT-safe: O(1), 30 evaluations.
[[nodiscard]] double cheapest_speed_mps(const VehicleModel& vehicle) noexcept;

/// In the air on the spot, W, avionics included. RT-safe: O(1).
[[nodiscard]] double hover_power_W(const VehicleModel& vehicle) noexcept;

}  // namespace roborun
