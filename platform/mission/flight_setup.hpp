/// Memory, map, planner and memory of ways of a flight, taken before it begins.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "core/memory/arena.hpp"
#include "platform/board/backends.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/report/mission_result.hpp"

namespace roborun::mission {

class FlightSetup {
 public:
  /// Throws InputError as make_backends(), and for ways that the design does not know.
  FlightSetup(const flight::FlightConfig& config, const board::BackendNames& backends,
              const board::ImageLimits& images, const board::OwnParts& own = {});
  FlightSetup(const FlightSetup&) = delete;
  FlightSetup& operator=(const FlightSetup&) = delete;

  [[nodiscard]] flight::FlightParts parts() noexcept {
    return {*parts_.map, *parts_.planner, policy_.get(), parts_.ways.get()};
  }
  [[nodiscard]] core::Arena& arena() noexcept { return arena_; }
  /// To be asked once the flight system stands. Throws InputError if the arena was too small.
  void check() const;
  /// The memory plan, with what was used so far. Pools of one name are numbered.
  [[nodiscard]] std::vector<report::PoolUse> pools() const;

 private:
  std::vector<std::byte> block_;
  core::Arena arena_;
  board::Backends parts_;
  std::unique_ptr<governor::DecisionPolicy> policy_;  ///< Null: the governor that ships.
};

}  // namespace roborun::mission
