/// The flight system in lockstep: its lanes under virtual clocks, one minor frame a call. What it flies may
/// be simulated or recorded.
#pragma once

#include "core/executive/lane_executive.hpp"
#include "core/executive/lane_meter.hpp"
#include "platform/flight/flight_system.hpp"

namespace roborun::flight {

/// How the computer does in a minor frame.
struct Computer {
  bool flight_runs{true};  ///< False: no lane runs while the world goes on; the flight lane makes up for it.
  bool decision_runs{true};  ///< False: the decision lane stands still.
  double slower{1.0};        ///< A decision that begins now takes so many times as long.
};

class LockstepFlight {
 public:
  /// As FlightSystem; decisions are charged what config.costs says.
  LockstepFlight(const FlightConfig& config, Aircraft& aircraft,
                 std::span<firmware_if::DepthCamera* const> cameras, const FlightParts& parts,
                 core::Arena& arena, std::span<firmware_if::Lidar* const> lidars = {}) noexcept;

  /// One minor frame of all lanes. A decision is computed at once from the inputs of its start; its last
  /// slot, the hand-over, waits until the board would have been ready. Returns the decision begun in this
  /// frame, or null.
  const DecisionOutput* step(const Computer& computer = {}) noexcept;
  /// The instant of the last frame.
  [[nodiscard]] MonotonicTime now() const noexcept { return now_; }
  [[nodiscard]] FlightSystem& system() noexcept { return system_; }

 private:
  Aircraft& aircraft_;
  Nanos minor_frame_;
  core::CostProfile rated_costs_;  ///< What computing costs on a sound computer ...
  core::CostProfile costs_;        ///< ... and what it costs now.
  double slower_{1.0};
  MonotonicTime now_{};
  core::VirtualClock flight_clock_;
  core::VirtualClock decision_clock_;
  core::CostProfileMeter meter_;
  FlightSystem system_;
  core::Reactions reactions_;
  core::LaneExecutive flight_lane_;
  core::LaneExecutive decision_lane_;
};

}  // namespace roborun::flight
