#include "platform/mission/flight_setup.hpp"

#include <fmt/format.h>

#include <map>

#include "platform/input/input_error.hpp"

namespace roborun::mission {
namespace {

board::PartRequest request_of(const flight::FlightConfig& config, const board::ImageLimits& images) {
  return {map_bounds_W(config), images, config.bounds_W, slow_radius_m(config.vehicle), config.fence};
}

}  // namespace

FlightSetup::FlightSetup(const flight::FlightConfig& config, const board::BackendNames& backends,
                         const board::ImageLimits& images, const board::OwnParts& own)
    : block_(flight::FlightSystem::arena_bytes(config) + board::backend_bytes(map_bounds_W(config), images) +
             4096),
      arena_(block_),
      parts_(board::make_backends(backends, request_of(config, images), arena_, own)),
      policy_(own.policy ? own.policy(config) : nullptr) {
  if (parts_.ways != nullptr && !flight::knows_ways(config.design))
    throw InputError(fmt::format("ways: design {} knows its horizon alone: must be own, or another design",
                                 governor::to_string(config.design)));
}

void FlightSetup::check() const {
  if (arena_.exhausted()) throw InputError("memory plan: the arena is too small for this world");
}

std::vector<report::PoolUse> FlightSetup::pools() const {
  std::map<std::string, int> of_name;
  for (const core::PoolRecord& p : arena_.plan()) ++of_name[p.name];
  std::vector<report::PoolUse> pools;
  std::map<std::string, int> number;
  for (const core::PoolRecord& p : arena_.plan()) {
    const std::string name = of_name[p.name] == 1 ? p.name : fmt::format("{} {}", p.name, ++number[p.name]);
    pools.push_back({name, p.element_bytes, p.count, p.high_water, p.tells_use});
  }
  return pools;
}

}  // namespace roborun::mission
