/// The knobs of Eq. 3: each of three stages has a precision and a volume.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/executive/stage_budget.hpp"
#include "core/memory/enum_array.hpp"

namespace roborun::governor {

/// The stages that have knobs, in the order of Eq. 3.
enum class Knob : std::uint8_t {
  kPerceive,  ///< p0, v0: what the map integrates.
  kExport,    ///< p1, v1: what the planner gets of the map.
  kPlan,      ///< p2 = p1, v2: what the planner explores.
};
inline constexpr std::size_t kKnobCount = 3;
inline constexpr std::array<Knob, kKnobCount> kKnobs{Knob::kPerceive, Knob::kExport, Knob::kPlan};

/// One value per knob.
template <typename T>
using KnobArray = core::EnumArray<Knob, T, kKnobCount>;

/// Returns the stage of the decision lane that a knob governs.
[[nodiscard]] constexpr core::StageId stage_of(Knob knob) noexcept {
  constexpr KnobArray<core::StageId> kStage{
      {core::StageId::kMap, core::StageId::kExport, core::StageId::kPlanner}};
  return kStage[knob];
}

}  // namespace roborun::governor
