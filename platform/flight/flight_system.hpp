/// Everything that flies, for one vehicle and one goal: stages, governor, and the programs of the lanes.
/// Lockstep and real time put the same system under different clocks.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "core/executive/stage_meter.hpp"
#include "core/memory/arena.hpp"
#include "core/memory/static_vector.hpp"
#include "platform/flight/decision_pipeline.hpp"
#include "platform/flight/decision_program.hpp"
#include "platform/flight/flight_config.hpp"
#include "platform/flight/flight_control.hpp"
#include "platform/flight/flight_program.hpp"
#include "stages/planning/way_memory.hpp"

namespace roborun::flight {

/// What may be the reader's own. All outlive the system.
struct FlightParts {
  stages::OccupancyMap& map;  ///< Of map_bounds_W(), at least.
  stages::Planner& planner;
  governor::DecisionPolicy* policy{nullptr};  ///< Null: the governor that ships.
  stages::Ways* ways{nullptr};                ///< Null: the memory that ships, where knows_ways().
  /// The cameras once more, for the flight lane's look between two decisions; empty: it does not look.
  std::span<firmware_if::DepthCamera* const> watched{};
};

/// The published designs know their horizon alone.
[[nodiscard]] constexpr bool knows_ways(governor::Design design) noexcept {
  return design == governor::Design::kAware;
}

/// What the governor that ships is made from for this flight: where a policy that builds on it begins.
[[nodiscard]] governor::GovernorConfig governor_config(const FlightConfig& config) noexcept;

/// About 200 kB, without the memory in the arena: not for a small stack.
class FlightSystem {
 public:
  /// Precondition, asserted: config.validate() is kOk. Takes arena_bytes() from the arena: look at arena.exhausted() before the lanes start. At most
  /// kMostCameras cameras and kMostLidars LiDARs; all references outlive the system.
  FlightSystem(const FlightConfig& config, core::StageMeter& meter, Aircraft& aircraft,
               std::span<firmware_if::DepthCamera* const> cameras, const FlightParts& parts,
               core::Arena& arena, std::span<firmware_if::Lidar* const> lidars = {}) noexcept;
  FlightSystem(const FlightSystem&) = delete;
  FlightSystem& operator=(const FlightSystem&) = delete;

  /// What the constructor takes from the arena.
  [[nodiscard]] static std::size_t arena_bytes(const FlightConfig& config) noexcept;

  [[nodiscard]] FlightControl& control() noexcept { return control_; }
  [[nodiscard]] FlightProgram& flight_program() noexcept { return flight_program_; }
  [[nodiscard]] const FailsafePilot& pilot() const noexcept { return flight_program_.pilot(); }
  [[nodiscard]] DecisionProgram& decision_program() noexcept { return decision_program_; }
  [[nodiscard]] const governor::DecisionPolicy& policy() const noexcept { return policy_; }
  [[nodiscard]] const stages::OccupancyMap& map() const noexcept { return map_; }

 private:
  stages::OccupancyMap& map_;
  stages::PointCloud cloud_;
  stages::Smoother smoother_;
  std::optional<stages::WayMemory>
      ways_;  ///< Where knows_ways() and the world fits; idle if the ways are the reader's own.
  governor::Governor governor_;  ///< Idle if the policy is the reader's own.
  governor::DecisionPolicy& policy_;
  DecisionPipeline pipeline_;
  FlightControl control_;
  LaneMail mail_;
  FlightProgram flight_program_;
  DecisionProgram decision_program_;
};

}  // namespace roborun::flight
