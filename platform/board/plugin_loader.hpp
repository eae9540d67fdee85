/// Takes a map, a planner or a memory of ways out of a shared object (plugin.hpp).
#pragma once

#include <memory>
#include <string>

#include "platform/board/part_request.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/planning/planner.hpp"
#include "stages/planning/ways.hpp"

namespace roborun::board {

/// "plugin:FILE".
[[nodiscard]] bool is_plugin(const std::string& name) noexcept;

/// `name` is plugin:FILE; a FILE without a slash is in the working folder. A plugin stays loaded until the
/// program ends. Throws InputError for what cannot be loaded, is no plugin, has no such part, cannot make it, or
/// was built for another program: its ABI version and ours are named.
[[nodiscard]] std::unique_ptr<stages::OccupancyMap> load_map(const std::string& name,
                                                             const PartRequest& request);
[[nodiscard]] std::unique_ptr<stages::Planner> load_planner(const std::string& name,
                                                            const PartRequest& request);
[[nodiscard]] std::unique_ptr<stages::Ways> load_ways(const std::string& name, const PartRequest& request);

}  // namespace roborun::board
