/// Makes a plugin of a planner, a map or a memory of ways: `roborun fly --planner plugin:FILE.so`, `--map plugin:FILE.so`,
/// `--ways plugin:FILE.so`.
///
/// One source of a shared object includes this header and names its class once:
///
///   #include "platform/board/plugin.hpp"
///   ROBORUN_PLUGIN_PLANNER(mine::StraightPlanner)
///
/// and CMake needs
///
///   find_package(roborun REQUIRED COMPONENTS mission)
///   add_library(straight_planner MODULE straight_planner.cpp)
///   target_link_libraries(straight_planner PRIVATE roborun::plugin)
///
/// It counts its work (stages::PlanResult::work, stages::OccupancyMap): in lockstep a flight is charged for that,
/// and what it says is compared with the time it took (platform/mission/work_check.hpp).
/// The class has a constructor from `const board::PartRequest&`, or none. A shared object may hold one planner,
/// one map and one memory of ways. Not for programs: it defines an entry.
#pragma once

#include <type_traits>

#include "platform/board/plugin_abi.hpp"

#define ROBORUN_PLUGIN_ENTRY extern "C" __attribute__((visibility("default")))

#define ROBORUN_PLUGIN_PLANNER(Class)                                                  \
  ROBORUN_PLUGIN_ENTRY roborun::stages::Planner* roborun_make_planner(                 \
      const roborun::board::PartRequest* request, roborun::AssertionHandler handler) { \
    return roborun::board::make_plugin_part<Class>(*request, handler);                 \
  }
#define ROBORUN_PLUGIN_MAP(Class)                                                      \
  ROBORUN_PLUGIN_ENTRY roborun::stages::OccupancyMap* roborun_make_map(                \
      const roborun::board::PartRequest* request, roborun::AssertionHandler handler) { \
    return roborun::board::make_plugin_part<Class>(*request, handler);                 \
  }
#define ROBORUN_PLUGIN_WAYS(Class)                                                                          \
  ROBORUN_PLUGIN_ENTRY roborun::stages::Ways* roborun_make_ways(const roborun::board::PartRequest* request, \
                                                                roborun::AssertionHandler handler) {        \
    return roborun::board::make_plugin_part<Class>(*request, handler);                                      \
  }

ROBORUN_PLUGIN_ENTRY inline __attribute__((used)) const roborun::board::PluginAbi* roborun_plugin_abi() {
  return &roborun::board::kProgramAbi;
}

namespace roborun::board {

/// Returns null for a class whose constructor throws.
template <typename Class>
[[nodiscard]] Class* make_plugin_part(const PartRequest& request, AssertionHandler handler) noexcept {
  set_assertion_handler(handler);
  try {
    if constexpr (std::is_constructible_v<Class, const PartRequest&>) {
      return new Class(request);
    } else {
      return new Class;
    }
  } catch (...) {
    return nullptr;
  }
}

}  // namespace roborun::board
