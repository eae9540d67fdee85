/// Everything that flies, for one world and one design: memory, stages, governor, and the programs of the
/// lanes. Lockstep and real time put the same system under different clocks.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/executive/stage_meter.hpp"
#include "core/memory/arena.hpp"
#include "platform/app/backends.hpp"
#include "platform/app/camera_rig.hpp"
#include "platform/app/decision_pipeline.hpp"
#include "platform/app/flight_lane.hpp"
#include "platform/app/flight_programs.hpp"
#include "platform/app/mission.hpp"

namespace roborun::app {

class FlightSystem {
 public:
  /// Takes all memory. Throws sitl::InputError for an unknown backend, or a world too large for the map. All
  /// references must outlive it.
  FlightSystem(const sitl::World& world, const MissionConfig& config, core::StageMeter& meter,
               Aircraft& aircraft, const std::array<firmware_if::DepthCamera*, kCameras>& cameras);
  FlightSystem(const FlightSystem&) = delete;
  FlightSystem& operator=(const FlightSystem&) = delete;

  [[nodiscard]] FlightLane& flight() noexcept { return flight_; }
  [[nodiscard]] FlightProgram& flight_program() noexcept { return *flight_program_; }
  [[nodiscard]] DecisionProgram& decision_program() noexcept { return *decision_program_; }
  [[nodiscard]] const governor::Governor& governor() const noexcept { return *governor_; }
  /// The memory plan, with what was used so far.
  [[nodiscard]] std::vector<report::PoolUse> pools() const;
  [[nodiscard]] const stages::OccupancyMap& map() const noexcept { return *backends_.map; }
  /// A fault: the own map gets no memory for new bricks.
  void refuse_bricks(bool refuse) noexcept;
  /// A fault: kOff, no answer; kIntermittent, often none; kNone. Without effect in a mission without faults.
  void fail_planner(sitl::FaultKind fault) noexcept { planner_fault_ = fault; }

 private:
  std::array<firmware_if::DepthCamera*, kCameras> cameras_;
  std::vector<std::byte> block_;
  std::optional<core::Arena> arena_;
  std::optional<stages::PointCloud> cloud_;
  sitl::FaultKind planner_fault_{sitl::FaultKind::kNone};
  MapAndPlanner backends_;
  stages::Smoother smoother_;
  std::optional<governor::Governor> governor_;
  std::optional<DecisionPipeline> pipeline_;
  FlightLane flight_;
  LaneMail mail_;
  std::optional<FlightProgram> flight_program_;
  std::optional<DecisionProgram> decision_program_;
};

}  // namespace roborun::app
