/// What a program and its plugins must have in common.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware_if/assert.hpp"
#include "platform/board/part_request.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/planning/planner.hpp"
#include "stages/planning/ways.hpp"

#define ROBORUN_TEXT_OF(x) #x
#define ROBORUN_TEXT(x) ROBORUN_TEXT_OF(x)

namespace roborun::board {

/// Grows with every change of a class or struct that program and plugin both see: this file, part_request.hpp,
/// Planner, OccupancyMap, Ways, MapView, StageBudget, DepthFrame, and what these are made of.
inline constexpr std::uint32_t kPluginAbi = 11;

/// A change that somebody forgot to count above, or another compiler or Eigen, shows in the sizes.
[[nodiscard]] constexpr std::uint32_t plugin_layout() noexcept {
  constexpr std::array<std::size_t, 15> kSizes{
      sizeof(void*),
      __GXX_ABI_VERSION,
      sizeof(PartRequest),
      sizeof(Pose),
      alignof(Pose),
      alignof(Quaternion),
      sizeof(firmware_if::DepthFrame),
      sizeof(stages::PosedDepthFrame),
      sizeof(stages::IntegrationRequest),
      sizeof(stages::IntegrationResult),
      sizeof(stages::ExportRequest),
      sizeof(stages::CellBlock),
      sizeof(stages::PlanRequest),
      sizeof(stages::PlanResult),
      sizeof(core::Work),
  };
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const std::size_t size : kSizes) hash = (hash ^ static_cast<std::uint32_t>(size)) * 16777619U;
  return hash;
}

/// For people: what layouts come from.
inline constexpr const char* kPluginBuild = "compiler " __VERSION__ ", Eigen " ROBORUN_TEXT(
    EIGEN_WORLD_VERSION) "." ROBORUN_TEXT(EIGEN_MAJOR_VERSION) "." ROBORUN_TEXT(EIGEN_MINOR_VERSION);

/// The answer of roborun_plugin_abi(). The order of its members never changes.
struct PluginAbi {
  std::uint32_t version;
  std::uint32_t layout;
  const char* build;
};

inline constexpr PluginAbi kProgramAbi{kPluginAbi, plugin_layout(), kPluginBuild};

// The entries of a plugin, all extern "C". A part belongs to the caller, who deletes it; null: it could not be
// made. A plugin has its own copy of all code, and so gets the program's way into the fail-safe.
using PluginAbiEntry = const PluginAbi* (*)();
using PluginPlannerEntry = stages::Planner* (*)(const PartRequest*, AssertionHandler);
using PluginMapEntry = stages::OccupancyMap* (*)(const PartRequest*, AssertionHandler);
using PluginWaysEntry = stages::Ways* (*)(const PartRequest*, AssertionHandler);
inline constexpr const char* kPluginAbiEntry = "roborun_plugin_abi";
inline constexpr const char* kPluginPlannerEntry = "roborun_make_planner";
inline constexpr const char* kPluginMapEntry = "roborun_make_map";
inline constexpr const char* kPluginWaysEntry = "roborun_make_ways";

}  // namespace roborun::board
