/// How an anytime stage asks whether it must stop: it reports the work done so far, somebody else knows the
/// time.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/memory/enum_array.hpp"

namespace roborun::core {

/// The stages of the decision lane, in the order in which they run.
enum class StageId : std::uint8_t { kPointCloud, kGovernor, kMap, kExport, kPlanner, kSmoother };
inline constexpr std::size_t kStageCount = 6;

/// One value per stage.
template <typename T>
using StageArray = EnumArray<StageId, T, kStageCount>;

[[nodiscard]] constexpr const char* to_string(StageId id) noexcept {
  switch (id) {
    case StageId::kPointCloud:
      return "point_cloud";
    case StageId::kGovernor:
      return "governor";
    case StageId::kMap:
      return "map";
    case StageId::kExport:
      return "export";
    case StageId::kPlanner:
      return "planner";
    case StageId::kSmoother:
      return "smoother";
  }
  return "unknown";
}

/// What a stage has done so far in this step.
struct Work {
  /// Counted by the stage itself, and what a unit is belongs to its docstring: pixels (point cloud), map
  /// cells and nodes visited (map, export), map lookups (planner, smoother).
  std::uint64_t units{0};
  double volume_m3{0.0};  ///< Space processed: integrated (map), exported (export), explored (planner).
  int level{0};           ///< Precision level at which it was processed.
};

/// Contract:
///  1. spent() neither blocks nor allocates, and once true stays true for the rest of the step.
///  2. A stage polls at least every 1,024 units of work, and returns its best so far as soon as it reads
///     true.
/// Flight reads a clock here; simulation asks the cost profile what the work would have cost on the board.
class StageBudget {
 public:
  virtual ~StageBudget() = default;
  [[nodiscard]] virtual bool spent(const Work& done) noexcept = 0;
};

/// Never spent: tests, and designs whose stages always run to the end.
class UnlimitedBudget final : public StageBudget {
 public:
  [[nodiscard]] bool spent(const Work&) noexcept override { return false; }
};

}  // namespace roborun::core
