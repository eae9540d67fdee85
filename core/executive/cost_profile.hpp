/// What the work of a stage costs on a named machine: how simulation charges time without reading a clock.
#pragma once

#include <array>
#include <cstdint>

#include "core/executive/stage_budget.hpp"
#include "core/precision.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::core {

/// cost = fixed_s[level] + units * per_unit_s + volume_m3 * per_m3_s[level]
struct StageCost {
  std::array<double, kPrecisionLevels> fixed_s{};   ///< Each [0, 1e6].
  double per_unit_s{};                              ///< [0, 1e6]
  std::array<double, kPrecisionLevels> per_m3_s{};  ///< Each [0, 1e6].
  /// Nobody gets time back for working: nothing may be negative. The upper end keeps a cost within Nanos.
  [[nodiscard]] Status validate() const noexcept;
};

/// Everything `factor` times as expensive.
[[nodiscard]] StageCost slower(const StageCost& cost, double factor) noexcept;

struct CostProfile {
  StageArray<StageCost> stage{};

  [[nodiscard]] const StageCost& of(StageId id) const noexcept { return stage[id]; }
  /// kOk if that of every stage is.
  [[nodiscard]] Status validate() const noexcept;
  /// Never negative; a level out of range is clamped. RT-safe: O(1).
  [[nodiscard]] Nanos cost(StageId id, const Work& work) const noexcept;
};

/// Every stage `factor` times as expensive. RT-safe: O(1).
[[nodiscard]] CostProfile slower(const CostProfile& profile, double factor) noexcept;

/// The authors' machine (four i9 cores, ROS). Map integration and export are their measured costs per volume;
/// the planner's is their shipped fit at 0.3 and 9.6 m with a constant factor per octave between; point cloud
/// 0.21 s, depth conversion 0.07 s and diagnostics 0.09 s are fixed, the governor takes the measured 0.10 s
/// (printed: 0.05), and each of the two hand-overs between machines 0.25 s at 0.3 m down to 0.01 s: one is
/// charged to the map, one to the export.
[[nodiscard]] CostProfile paper_profile() noexcept;

/// What is given for the published precisions, for those of a lattice: linear in the cell's edge between two of them, and
/// below the finest from octave to octave as much more as from the second to it.
[[nodiscard]] std::array<double, kPrecisionLevels> on_lattice(
    const std::array<double, kPrecisionLevels>& published, const PrecisionLattice& lattice) noexcept;
[[nodiscard]] CostProfile on_lattice(const CostProfile& published, const PrecisionLattice& lattice) noexcept;

}  // namespace roborun::core
