/// The flight system in lockstep: its lanes under virtual clocks, one minor frame a call. What it flies may
/// be simulated or recorded.
#pragma once

#include <array>

#include "core/executive/lane_executive.hpp"
#include "core/executive/lane_meter.hpp"
#include "platform/app/flight_system.hpp"

namespace roborun::app {

class LockstepFlight {
 public:
  /// As FlightSystem.
  LockstepFlight(const sitl::World& world, const MissionConfig& config, Aircraft& aircraft,
                 const std::array<firmware_if::DepthCamera*, kCameras>& cameras);

  /// One minor frame of all lanes. A decision is computed at once from the inputs of its start; its last
  /// slot, the hand-over, waits until the board would have been ready. Returns the decision begun in this
  /// frame, or null. `cpu` is a fault: kOff, neither lane runs while the world goes on, and the flight lane
  /// makes up for its frames afterwards; kStuck, the decision lane does not run; kSlow, it takes four times
  /// as long.
  const DecisionOutput* step(sitl::FaultKind cpu = sitl::FaultKind::kNone);
  /// Of the frame last stepped.
  [[nodiscard]] MonotonicTime now() const noexcept { return now_; }
  [[nodiscard]] FlightSystem& system() noexcept { return system_; }

 private:
  const MissionConfig& config_;
  Aircraft& aircraft_;
  core::CostProfile costs_;  ///< What computing costs now.
  double slowed_by_{1.0};
  MonotonicTime now_{};
  core::VirtualClock flight_clock_;
  core::VirtualClock decision_clock_;
  core::CostProfileMeter meter_;
  FlightSystem system_;
  core::Reactions reactions_;
  core::LaneExecutive flight_lane_;
  core::LaneExecutive decision_lane_;
};

}  // namespace roborun::app
