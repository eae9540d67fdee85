/// The faults of a mission, begun in time: those of devices on the fault line, those of the computer itself.
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <vector>

#include "core/memory/arena.hpp"
#include "platform/flight/lockstep_flight.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/sitl/fault/faulty_sensors.hpp"
#include "stages/planning/planner.hpp"

namespace roborun::mission {

class MissionFaults {
 public:
  /// `config` must outlive it.
  explicit MissionFaults(const MissionConfig& config)
      : config_(config), begun_(config.faults.size(), false) {}

  [[nodiscard]] bool empty() const noexcept { return begun_.empty(); }
  /// How many have begun.
  [[nodiscard]] std::size_t begun() const noexcept {
    return static_cast<std::size_t>(std::count(begun_.begin(), begun_.end(), true));
  }
  /// For what can fail.
  [[nodiscard]] const sitl::FaultLine& line() const noexcept { return line_; }
  /// The cameras behind their faults; themselves in a mission without faults. Once for each of their readers.
  [[nodiscard]] std::vector<firmware_if::DepthCamera*> connect(
      std::span<firmware_if::DepthCamera* const> cameras);
  /// Since when time counts that counts from no phase; none: it does not yet. Without a call: from 0.
  void count_from(std::optional<MonotonicTime> start) noexcept { start_ = start; }
  /// Begins those that are due at `now`, and ends those that are over. True if the first one of all began.
  bool advance(MonotonicTime now, governor::Phase phase);
  /// What wind, map and computer are to do about it.
  [[nodiscard]] Vector3 mean_wind_W_mps() const;
  void refuse_bricks(core::Arena& arena) const noexcept;
  [[nodiscard]] flight::Computer computer(MonotonicTime now) const noexcept;

 private:
  const MissionConfig& config_;
  sitl::FaultLine line_;
  std::vector<bool> begun_;  ///< By config_.faults.
  bool any_{false};
  std::optional<MonotonicTime> start_{MonotonicTime{}};
  std::array<std::optional<MonotonicTime>, governor::kPhaseCount> phase_begin_{};
  std::deque<sitl::FaultyDepthCamera> camera_;
};

/// Gives no answer while the planner's fault lasts.
class FaultyPlanner final : public stages::Planner {
 public:
  FaultyPlanner(stages::Planner& planner, const sitl::FaultLine& line) noexcept
      : planner_(planner), line_(line) {}
  [[nodiscard]] Status plan(const stages::PlanRequest& request, const stages::MapView& view,
                            core::StageBudget& budget, stages::PlanResult& result) noexcept override;

 private:
  stages::Planner& planner_;
  const sitl::FaultLine& line_;
};

}  // namespace roborun::mission
