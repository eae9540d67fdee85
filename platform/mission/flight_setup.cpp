#include "platform/mission/flight_setup.hpp"

#include <fmt/format.h>
#include <sys/mman.h>

#include <map>

#include "platform/input/input_error.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/planning/rrt_star.hpp"

namespace roborun::mission {
namespace {

board::PartRequest request_of(const flight::FlightConfig& config, const board::ImageLimits& images) {
  return {map_bounds_W(config), images, config.bounds_W, slow_radius_m(config.vehicle), config.fence};
}

}  // namespace

FlightSetup::Block::Block(std::size_t bytes, Pages pages) {
  void* const block = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (block == MAP_FAILED) throw InputError("memory plan: not enough memory");
  if (pages == Pages::kHuge) (void)madvise(block, bytes, MADV_HUGEPAGE);  // a kernel without: normal ones
  bytes_ = {static_cast<std::byte*>(block), bytes};
}

FlightSetup::Block::~Block() { (void)munmap(bytes_.data(), bytes_.size()); }

FlightSetup::FlightSetup(const flight::FlightConfig& config, const board::BackendNames& backends,
                         const board::ImageLimits& images, const board::OwnParts& own, Pages pages)
    : all_own_(backends == board::BackendNames{} && own.empty()),
      block_(flight::FlightSystem::arena_bytes(config) + board::backend_bytes(map_bounds_W(config), images) +
                 4096,
             pages),
      arena_(block_.bytes()),
      parts_(board::make_backends(backends, request_of(config, images), arena_, own)),
      policy_(own.policy ? own.policy(config) : nullptr) {
  if (parts_.ways != nullptr && !flight::knows_ways(config.design))
    throw InputError(fmt::format("ways: design {} knows its horizon alone: must be own, or another design",
                                 governor::to_string(config.design)));
}

void FlightSetup::check() const {
  if (arena_.exhausted()) throw InputError("memory plan: the arena is too small for this world");
}

bool FlightSetup::add_to(FlightMemory& memory) const {
  if (!all_own_) return false;
  memory.add_data(block_.bytes());
  memory.add_object(arena_);
  memory.add_object(static_cast<const stages::BrickMap&>(*parts_.map));
  memory.add_object(static_cast<const stages::RrtStar&>(*parts_.planner));
  return true;
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
